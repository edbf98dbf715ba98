// SPDX-License-Identifier: GPL-3.0-or-later
//
// What is asked of a ray while Embree follows it: through which of the surfaces that it offers the
// ray goes on. The queries start with Embree's own part, through which its callbacks find them.
// Only visibility/*.cpp includes this.
#pragma once

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

// Share of how far an island reaches: some tens of float rounding errors.
constexpr float kRelativeOffset = 2e-6f;

// Some tens of float rounding errors at a parent, metres.
inline float offsetAt(const Patches& patches, uint32_t parent) {
    return kRelativeOffset * patches.islands[patches.parents[parent].island].reach;
}

// The acceleration structure. parentOf: per quad of it, into Patches::parents.
struct Visibility::Embree {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::vector<uint32_t> parentOf;

    ~Embree() {
        if (scene) embree3.releaseScene(scene);
        if (device) embree3.releaseDevice(device);
    }
};

// A list that filters write to. Embree swallows their exceptions: that there is no memory left is
// kept until the ray is done.
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
    void check() const {
        if (isIncomplete) throw std::bad_alloc();
    }
};

// How a ray passes what lets light through: in part, or by chance.
struct Passage {
    const Patches* patches;
    const uint32_t* parentOf;
    std::optional<uint64_t> line;  // its name, where it passes by chance
    float share = 1;               // that has come through, where it passes in part
    // Parents that have taken their part: a ray along the diagonal of a quad meets both of its
    // triangles, and Embree may offer a hit twice.
    MetParents passed;

    // Whether the ray goes on through a parent that it meets at a point.
    bool goesOn(uint32_t parent, const glm::vec3& point);
};

// What a ray meets first. Of surfaces that coincide there it is the one that comesBefore the
// others; so a ray that has met one goes on a little, through all that may coincide with it.
struct NearestHit {
    struct Other {
        uint32_t parent;
        float distance;  // metres along the ray
    };
    uint32_t parent = kNoParent;
    float distance = 0;  // metres along the ray
    float zone = 0;      // what it meets less than this behind may coincide, metres
    // What it has met about as far away; of more than that, those that it met first. Without memory
    // of its own: Embree would swallow the exception if there were none left.
    std::array<Other, 16> others;
    size_t count = 0;

    // Notes what the ray meets; returns how far it goes on, metres.
    float meet(uint32_t other, float at, float otherZone);

    // Of the nearest one and those that coincide with it, the first.
    uint32_t first(const Patches& patches, const glm::vec3& direction) const;

  private:
    void keep(const Other& other);
};

// What the filters need to know of a ray; starts with Embree's own part.
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

// What they need to know of rays that leave a side.
struct SideQuery : RayQuery {
    using RayQuery::RayQuery;
    uint32_t parent;
    bool isFront;      // the ray leaves the front of the parent
    glm::vec3 normal;  // of the side
    float zone;        // height over the side within which a hit coincides with it, metres
    // Of each ray, by its id in the packet: how far behind the surface it starts, metres along it,
    // and the parent that it ends on. A parent whose corners lie in a plane but for a rounding
    // error may stand before a point of its plane.
    std::array<float, Visibility::kPacket> behind;
    std::array<uint32_t, Visibility::kPacket> target;
};

// Filters, one for each kind of ray.
// Of rays of a SideQuery that are blocked or not.
void passStart(const RTCFilterFunctionNArguments* args);
// Of a ray of a SideQuery that is to find the first surface.
void meetAfterStart(const RTCFilterFunctionNArguments* args);
// Of a ray of a RayQuery, which starts on no surface.
void meetFirst(const RTCFilterFunctionNArguments* args);

// A ray of this length, metres.
void setRay(RTCRay& ray, glm::vec3 origin, glm::vec3 direction, float length);

}  // namespace raybundle
