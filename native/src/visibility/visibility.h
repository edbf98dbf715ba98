// SPDX-License-Identifier: GPL-3.0-or-later
//
// The only code that knows Embree: is a segment free, and what does a ray meet first. All surfaces
// block from both sides, as in Cycles. Patches that let light through (Patches::opacity) weaken
// shadow rays and stop other rays with the probability of their opacity (patches/opacity.h).
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

// Where a line crosses a surface.
struct LineHit {
    double depth;   // along the line from its point, metres
    uint32_t side;  // that faces against the direction
};

// Which surfaces block: those that light is exchanged with, or those that stop direct light.
enum class Blockers { EXCHANGING, STOPPING_DIRECT };

class Visibility {
  public:
    // Builds the acceleration structure over the parents that block. `patches` must outlive it.
    explicit Visibility(const Patches& patches, Blockers blockers = Blockers::EXCHANGING);
    ~Visibility();

    // Share of the light that comes through along a ray from a side. The far end is kept a little
    // off, since it usually lies on a surface. Of surfaces that coincide with the patch, those on
    // its other side do not block (see comesBefore).
    float visibleShare(uint32_t side, const ShadowRay& ray) const;

    // The same for up to kPacket rays from one side, which is quicker the nearer they lie together.
    static constexpr int kPacket = 8;
    void visibleShares(uint32_t side, const ShadowRay* rays, int count, float* shares) const;

    // Whether nothing comes through.
    bool isBlocked(uint32_t side, const glm::vec3& point, const glm::vec3& direction,
                   float distance) const {
        return visibleShare(side, {point, direction, distance}) <= 0;
    }

    // The patch side that a ray from a side meets first, if any, and how far from the point. Of
    // surfaces that coincide there, it meets the one that comesBefore. farthest: how far to look,
    // metres.
    std::optional<uint32_t> firstHit(uint32_t side, const glm::vec3& point,
                                     const glm::vec3& direction, float* distance = nullptr,
                                     float farthest = std::numeric_limits<float>::infinity()) const;

    // The same for origins that lie on no surface, or at least `offset` off it.
    std::optional<uint32_t> firstHit(const glm::vec3& origin, const glm::vec3& direction,
                                     float* distance = nullptr) const;

    // All hits along the endless line through a point (relative to Patches::centre, not outside the
    // scene's sphere), in order of depth. A line through an edge or a vertex between faces that
    // turn alike crosses one of them.
    void lineHits(const glm::dvec3& point, const glm::dvec3& direction,
                  std::vector<LineHit>& hits) const;

    // Some tens of float rounding errors anywhere in the scene, metres.
    float offset() const { return surfaceOffset; }

  private:
    struct Embree;
    struct FromSide;
    uint32_t sideOf(uint32_t parent, const glm::vec3& point, const glm::vec3& direction) const;

    const Patches& patches;
    float surfaceOffset;
    std::unique_ptr<Embree> embree;
};

}  // namespace raybundle
