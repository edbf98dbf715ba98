// SPDX-License-Identifier: GPL-3.0-or-later
#include "first_shot/spot_coverage.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "patches/side.h"
#include "sampling/sobol.h"

namespace raybundle {
namespace {

// A point in the interior of any patch.
constexpr glm::vec2 kInside(0.3f, 0.3f);
// Number of points on a side that are tested for another surface lying on it: at first, and if any
// of these is covered.
constexpr uint32_t kLooks = 16, kMoreLooks = 256;
// A side of which less than this share is exposed is no bright spot.
constexpr float kLeastExposed = 0.1f;

// What lies on a side.
struct Coverage {
    float exposed = 1;          // share of the side
    std::set<uint32_t> covers;  // surfaces (Parent::surface) that lie on it, all of them solids
};

// Returns what lies on a side, or nothing if the side cannot be a source: too little of it is
// exposed, or a sheet lies on it. A solid blocks the shadow rays to what it covers.
std::optional<Coverage> coverageOf(const Patches& patches, const Visibility& exchange,
                                   uint32_t side) {
    const glm::vec3 normal = patches.normal(side);
    const float touching = patches.islandAt(side).touchDistance;
    Coverage result;
    uint32_t covered = 0, looks = 0;
    for (const uint32_t most : {kLooks, kMoreLooks}) {
        for (; looks < most; ++looks) {
            const glm::vec4 u = sobolPoint(looks, side);
            const auto met = exchange.firstHit(side, patches.point(patchOf(side), {u.x, u.y}),
                                               normal, nullptr, touching);
            if (!met) continue;
            const Parent& cover = patches.parentAt(*met);
            if (!cover.isSolid || cover.isInward) return std::nullopt;
            result.covers.insert(cover.surface);
            ++covered;
        }
        if (covered == 0) return result;
    }
    result.exposed = 1 - float(covered) / float(looks);
    return result.exposed >= kLeastExposed ? std::optional(result) : std::nullopt;
}

// Returns the surfaces of `covers` inside whose bounding box any of `sides` lies.
std::set<uint32_t> coversAround(const Patches& patches, const std::set<uint32_t>& covers,
                                const std::vector<uint32_t>& sides) {
    struct Box {
        glm::vec3 low{INFINITY}, high{-INFINITY};
    };
    std::map<uint32_t, Box> boxes;
    for (const Parent& parent : patches.parents) {
        if (covers.count(parent.surface) == 0) continue;
        Box& box = boxes[parent.surface];
        for (size_t k = 0; k < (parent.isTriangle ? 3 : 4); ++k) {
            box.low = glm::min(box.low, patches.vertices[parent.vertex[k]]);
            box.high = glm::max(box.high, patches.vertices[parent.vertex[k]]);
        }
    }
    std::set<uint32_t> around;
    for (const uint32_t side : sides) {
        const glm::vec3 at = patches.point(patchOf(side), kInside);
        const float touching = patches.islandAt(side).touchDistance;
        for (const auto& [surface, box] : boxes)
            if (glm::all(glm::greaterThan(at, box.low + touching)) &&
                glm::all(glm::lessThan(at, box.high - touching)))
                around.insert(surface);
    }
    return around;
}

}  // namespace

SpotSources spotSources(const Patches& patches, const Visibility& exchange,
                        const std::vector<uint32_t>& bright, const std::vector<glm::vec3>& sent) {
    SpotSources spots;
    if (bright.empty()) return spots;
    std::map<uint32_t, Coverage> coverage;  // by side
    for (const uint32_t side : bright)
        if (auto found = coverageOf(patches, exchange, side)) {
            spots.covers.insert(found->covers.begin(), found->covers.end());
            coverage.emplace(side, std::move(*found));
        }
    const std::set<uint32_t> around = coversAround(patches, spots.covers, bright);
    for (const uint32_t surface : around) spots.covers.erase(surface);
    spots.light.ofSources.resize(patches.sideCount());
    spots.light.isSource.resize(patches.sideCount());
    for (const auto& [side, found] : coverage) {
        if (std::any_of(found.covers.begin(), found.covers.end(),
                        [&](uint32_t surface) { return around.count(surface) > 0; }))
            continue;
        spots.sides.push_back(side);
        spots.light.isSource[side] = true;
        spots.light.ofSources[side] = sent[side] / found.exposed;
    }
    return spots;
}

}  // namespace raybundle
