// SPDX-License-Identifier: GPL-3.0-or-later
//
// Visibility queries: whether a segment is free, and which surface a ray meets first. This folder
// holds the only code that uses Embree. All surfaces block from both sides, as in Cycles. Patches
// that let light through (Patches::opacity) weaken shadow rays, and stop other rays with the
// probability of their opacity (patches/opacity.h).
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "lights/shadow_ray.h"
#include "patches/patches.h"

namespace raybundle {

// An intersection of a line with a surface.
struct LineHit {
    double depth;   // signed distance along the line from its point, metres
    uint32_t side;  // patch side that faces against the line's direction
};

// The surfaces that block: those that exchange light, or those that stop direct light.
enum class Blockers { EXCHANGING, STOPPING_DIRECT };

// What the acceleration structure is made for: many queries, or few, so that a structure that
// answers slightly more slowly and is built in a third of the time is the faster one.
enum class Queries { MANY, FEW };

// Ray queries against the parents of a scene. All queries are thread-safe. Points are in metres
// relative to Patches::centre, directions are unit vectors.
class Visibility {
  public:
    // Builds the acceleration structure over the parents that block. `patches` must outlive the
    // object. Throws Error with OUT_OF_MEMORY, UNSUPPORTED_HARDWARE or UNKNOWN if Embree fails.
    explicit Visibility(const Patches& patches, Blockers blockers = Blockers::EXCHANGING,
                        Queries queries = Queries::MANY);
    ~Visibility();

    // Returns the share of the light, 0 to 1, that passes along a shadow ray from a patch side. The
    // ray ends slightly before its far end, which usually lies on a surface. Of the surfaces that
    // coincide with the patch, those on its other side do not block (see comesBefore).
    float visibleShare(uint32_t side, const ShadowRay& ray) const;

    // Largest number of rays in visibleShares().
    static constexpr int kPacket = 8;
    // Stores in `shares` the result of visibleShare() for each of `count` rays from one side. The
    // closer together the rays lie, the faster is the query.
    void visibleShares(uint32_t side, const ShadowRay* rays, int count, float* shares) const;

    // Returns whether no light passes along a segment of length `distance` (metres) from a side.
    bool isBlocked(uint32_t side, const glm::vec3& point, const glm::vec3& direction,
                   float distance) const {
        return visibleShare(side, {point, direction, distance}) <= 0;
    }

    // Returns the patch side that a ray from a side meets first, or nothing. Stores the distance
    // from `point` in `distance`, metres, if not null. Of surfaces that coincide at the hit, the
    // result is the one that comesBefore the others. `farthest` is the length of the ray in metres.
    std::optional<uint32_t> firstHit(uint32_t side, const glm::vec3& point,
                                     const glm::vec3& direction, float* distance = nullptr,
                                     float farthest = std::numeric_limits<float>::infinity()) const;

    // Returns the patch side that a ray meets first, or nothing, and the distance as above. For rays
    // whose origin lies on no surface, at least offset() away from any.
    std::optional<uint32_t> firstHit(const glm::vec3& origin, const glm::vec3& direction,
                                     float* distance = nullptr) const;

    // Stores in `hits` all intersections of an endless line through a point, in order of depth. The
    // point must not lie outside the scene's sphere. If a line passes through an edge or a vertex
    // between faces that it crosses in the same direction, only one of them is a hit.
    void lineHits(const glm::dvec3& point, const glm::dvec3& direction,
                  std::vector<LineHit>& hits) const;

    // Returns a length of some tens of float rounding errors anywhere in the scene, metres.
    float offset() const { return surfaceOffset; }

  private:
    struct Embree;
    struct FromSide;
    // Returns the side of a parent that faces against `direction`, for the patch at `point`.
    uint32_t sideOf(uint32_t parent, const glm::vec3& point, const glm::vec3& direction) const;

    const Patches& patches;
    float surfaceOffset;
    std::unique_ptr<Embree> embree;
};

}  // namespace raybundle
