// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/contacts.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <vector>

#include "job/cancellation.h"
#include "sampling/sobol.h"
#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

// Gaps narrower than this share of a tile's width count, and its edges are halved so often. With
// wider gaps the cuts below round things (scene instances) cost more than they gained; more
// would leave patches that few lines meet.
constexpr float kNarrow = 0.25f;
constexpr uint8_t kContactLevel = 2;
// Rays from each side, one in each quarter of it.
constexpr uint32_t kFirstRays = 4;
// Rays that tell whether a tile is near another surface in part.
constexpr uint32_t kRays = 16;
// Patches that the cuts may add: as many as there are tiles, or so many.
constexpr size_t kMostMore = 40000;

class Gaps {
  public:
    Gaps(const Patches& patches, const Visibility& visibility)
        : patches(patches), visibility(visibility), narrow(patches.sideCount()) {
        for (const float area : patches.area) widest = std::max(widest, kNarrow * std::sqrt(area));
    }

    // Looks from each side which gaps are narrow beside it or beside what it meets.
    void find() {
        parallelFor(uint32_t(0), uint32_t(patches.sideCount()), [&](uint32_t side) {
            if (!counts(side)) return;
            const SobolPoints points(hash(side, 0));
            std::array<ShadowRay, kFirstRays> rays;
            for (uint32_t i = 0; i < kFirstRays; ++i) {
                const glm::vec4 u = points[i];
                rays[i] = {patches.point(side / 2, {u.x, u.y}), patches.normal(side), widest};
            }
            // Over most sides there is nothing, which takes less time to find for all rays at once.
            std::array<float, kFirstRays> shares;
            visibility.visibleShares(side, rays.data(), kFirstRays, shares.data());
            for (uint32_t i = 0; i < kFirstRays; ++i) {
                if (shares[i] == 1) continue;
                uint32_t met = 0;
                const auto gap = gapAt(side, rays[i].point, rays[i].direction, widest, &met);
                if (!gap) continue;
                if (*gap < kNarrow * width(side)) narrow[side] = true;
                if (*gap < kNarrow * width(met)) narrow[met] = true;
            }
        });
    }

    // Whether a side lies at a narrow gap, and only a part of it near another surface.
    bool isContact(uint32_t side) const {
        if (!narrow[side]) return false;
        const SobolPoints points(hash(side, 1));
        uint32_t near = 0;
        for (uint32_t i = 0; i < kRays; ++i) {
            const glm::vec4 u = points[i];
            const glm::vec3 direction = cosineDirection(patches.normal(side), {u.z, u.w});
            if (gapAt(side, patches.point(side / 2, {u.x, u.y}), direction, width(side))) ++near;
        }
        return near > 0 && near < kRays;
    }

  private:
    bool counts(uint32_t side) const {
        const Parent& parent = patches.parentAt(side);
        return parent.exchanges && !(parent.isSolid && side % 2 == 1);
    }
    float width(uint32_t side) const { return std::sqrt(patches.area[side / 2]); }

    // From a point of a side to what is not too far in a direction, metres; none to what touches
    // it.
    std::optional<float> gapAt(uint32_t side, const glm::vec3& point, const glm::vec3& direction,
                               float farthest, uint32_t* met = nullptr) const {
        float distance = 0;
        const auto hit = visibility.firstHit(side, point, direction, &distance, farthest);
        if (!hit || distance <= patches.islandAt(side).touchDistance) return std::nullopt;
        if (met) *met = *hit;
        return distance;
    }

    const Patches& patches;
    const Visibility& visibility;
    float widest = 0;                       // no gap is narrow anywhere that is wider, metres
    std::vector<std::atomic<bool>> narrow;  // per side
};

}  // namespace

Cuts contactCuts(const Patches& patches, const Visibility& visibility, size_t maxPatches) {
    const size_t tiles = patches.count();
    if (maxPatches <= tiles) return {};
    Gaps gaps(patches, visibility);
    gaps.find();
    Cuts cuts;
    cuts.levels.assign(tiles, 0);
    parallelFor(uint32_t(0), uint32_t(tiles), [&](uint32_t tile) {
        if (gaps.isContact(2 * tile) || gaps.isContact(2 * tile + 1))
            cuts.levels[tile] = kContactLevel;
    });
    const size_t most = std::min(maxPatches - tiles, std::max(tiles, kMostMore));
    while (cuts.morePatches() > most)
        for (uint8_t& level : cuts.levels) level = uint8_t(std::max(0, level - 1));
    for (uint8_t level : cuts.levels) cuts.contacts += level > 0;
    if (cuts.contacts == 0) return {};
    return cuts;
}

}  // namespace raybundle
