// SPDX-License-Identifier: GPL-3.0-or-later
//
// The state of a ray while Embree follows it, and the filter callbacks that decide which surfaces
// the ray passes. Each query begins with Embree's context, through which the callbacks find the
// query. Only the source files of this folder include this header.
#pragma once

#include <tbb/task_group.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <new>
#include <optional>
#include <vector>

#include "patches/patches.h"
#include "visibility/embree3.h"
#include "visibility/visibility.h"

namespace raybundle {

// Tolerance of positions as a share of how far an island reaches: some tens of float rounding
// errors.
constexpr float kRelativeOffset = 2e-6f;

// Returns the tolerance of positions at a parent: some tens of float rounding errors, metres.
inline float offsetAt(const Patches& patches, uint32_t parent) {
    return kRelativeOffset * patches.islands[patches.parents[parent].island].reach;
}

// The acceleration structure. Owns Embree's device and scene.
struct Visibility::Embree {
    // The context of the build. An Embree scene keeps a context of its own whose parent is the one
    // in which it was built, and oneTBB follows the parents of all contexts whenever any work is
    // cancelled or throws. The parent must therefore live as long as the scene.
    tbb::task_group_context building{tbb::task_group_context::isolated};
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    // Per quad of the scene: index into Patches::parents.
    std::vector<uint32_t> parentOf;

    // Builds the tree of the scene. Ends early if the bake of the calling thread is cancelled.
    void build(Queries queries);

    ~Embree() {
        if (scene) embree3.releaseScene(scene);
        if (device) embree3.releaseDevice(device);
    }
};

// A list that filter callbacks append to. Since Embree swallows their exceptions, a failed
// allocation is stored, and check() throws when the ray is done.
struct MetParents {
    std::vector<uint32_t> all;
    bool isIncomplete = false;

    bool has(uint32_t parent) const {
        return std::find(all.begin(), all.end(), parent) != all.end();
    }
    void add(uint32_t parent) {
        try {
            all.push_back(parent);
        } catch (const std::bad_alloc&) {
            isIncomplete = true;
        }
    }
    // Throws std::bad_alloc if the list is incomplete.
    void check() const {
        if (isIncomplete) throw std::bad_alloc();
    }
};

// How a ray passes patches that let light through: it loses a share of its light, or passes by
// chance.
struct Passage {
    const Patches* patches;
    const uint32_t* parentOf;
    std::optional<uint64_t> line;  // identifier of the ray (lineName); set if it passes by chance
    float share = 1;               // share of the light that has passed so far
    // The parents that have already taken their share. A ray along the diagonal of a quad meets
    // both of its triangles, and Embree may report a hit twice.
    MetParents passed;

    // Returns whether the ray passes a parent that it meets at a point. Updates `share`.
    bool goesOn(uint32_t parent, const glm::vec3& point);
};

// The first surface that a ray meets. Of surfaces that coincide there, it is the one that
// comesBefore the others. Therefore a ray that has met a surface continues a little, through all
// surfaces that may coincide with it.
struct NearestHit {
    struct Other {
        uint32_t parent;
        float distance;  // metres along the ray
    };
    uint32_t parent = kNoParent;
    float distance = 0;  // metres along the ray
    float zone = 0;      // hits at most this far behind the first may coincide with it, metres
    // Further hits at about the same distance. If there are more than fit, those that were met
    // first are kept. The array has a fixed size, since Embree would swallow the exception of a
    // failed allocation.
    std::array<Other, 16> others;
    size_t count = 0;

    // Records a hit on parent `other` at the distance `at`, with the tolerance `otherZone`, all
    // metres. Returns the distance up to which the ray continues, metres.
    float meet(uint32_t other, float at, float otherZone);

    // Returns the parent that comes before the others, of the nearest one and those that coincide
    // with it. kNoParent if there was no hit.
    uint32_t first(const Patches& patches, const glm::vec3& direction) const;

  private:
    void keep(const Other& other);
};

// The state of one ray. It begins with Embree's context.
struct RayQuery {
    RTCIntersectContext context;
    Passage passage;
    NearestHit nearest;

    explicit RayQuery(const Patches& patches, const uint32_t* parentOf) {
        rtcInitIntersectContext(&context);
        passage.patches = &patches;
        passage.parentOf = parentOf;
    }
};

// The state of rays that leave a patch side.
struct SideQuery : RayQuery {
    using RayQuery::RayQuery;
    // Parent of the side that the rays leave.
    uint32_t parent;
    bool isFront;      // whether the rays leave the front of the parent
    glm::vec3 normal;  // of the side
    float zone;        // height over the side within which a hit coincides with it, metres
    // Per ray, by its index in the packet: the distance along the ray by which it starts behind the
    // surface (metres), and the parent on which it ends. The target needs to be known because a
    // parent that is not exactly plane may lie in front of a point of its plane by a rounding
    // error.
    std::array<float, Visibility::kPacket> behind;
    std::array<uint32_t, Visibility::kPacket> target;
    // Per ray of passStartAndEnd(): the distance along the ray from which only a solid that stands
    // on the target blocks it, metres.
    std::array<float, Visibility::kPacket> lastPart;
};

// Filter for rays of a SideQuery of which it is only asked whether they are blocked.
void passStart(const RTCFilterFunctionNArguments* args);
// The same filter for rays from the inside of a solid to a target on which the solid may stand.
// Such rays end beyond the target, and from SideQuery::lastPart on only the solid blocks them.
void passStartAndEnd(const RTCFilterFunctionNArguments* args);
// Filter for a ray of a SideQuery that searches for the first surface.
void meetAfterStart(const RTCFilterFunctionNArguments* args);
// Filter for a ray of a RayQuery, which starts on no surface and searches for the first one.
void meetFirst(const RTCFilterFunctionNArguments* args);

// Sets the origin, direction (unit) and length (metres) of a ray. A ray with NaN, or with values
// whose squares leave the range of floats, is set to meet nothing.
void setRay(RTCRay& ray, glm::vec3 origin, glm::vec3 direction, float length);

}  // namespace raybundle
