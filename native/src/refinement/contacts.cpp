// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/contacts.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <vector>

#include "job/cancellation.h"
#include "patches/side.h"
#include "sampling/sobol.h"
#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

// A gap is narrow if it is narrower than this share of a tile's width. The edges of a tile beside
// it are halved kContactLevel times. Cuts at wider gaps below round objects (scene "instances")
// cost more than they gained. More halvings would leave patches that few lines meet.
constexpr float kNarrow = 0.25f;
constexpr uint8_t kContactLevel = 2;
// First rays from each side, one in each quarter of it.
constexpr uint32_t kFirstRays = 4;
// Rays that decide whether only a part of a tile is near another surface.
constexpr uint32_t kRays = 16;
// Largest number of patches that the cuts may add: the number of tiles, but at least this.
constexpr size_t kMostMore = 40000;

// Finds narrow gaps beside tiles.
class Gaps {
  public:
    Gaps(const Patches& patches, const Visibility& visibility)
        : patches(patches), visibility(visibility), narrow(patches.sideCount()) {
        for (const float area : patches.area) widest = std::max(widest, kNarrow * std::sqrt(area));
    }

    // Casts rays from each side and marks the sides at gaps that are narrow relative to the side or
    // to the side met by the ray.
    void find() {
        parallelFor(uint32_t(0), uint32_t(patches.sideCount()), [&](uint32_t side) {
            if (!counts(side)) return;
            const SobolPoints points(hash(side, 0));
            std::array<ShadowRay, kFirstRays> rays;
            for (uint32_t i = 0; i < kFirstRays; ++i) {
                const glm::vec4 u = points[i];
                rays[i] = {patches.point(patchOf(side), {u.x, u.y}), patches.normal(side), widest};
            }
            // Most sides have nothing above them. Testing all rays at once is faster for these.
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

    // Returns whether a side lies at a narrow gap and only a part of it is near another surface.
    bool isContact(uint32_t side) const {
        if (!narrow[side]) return false;
        const SobolPoints points(hash(side, 1));
        uint32_t near = 0;
        for (uint32_t i = 0; i < kRays; ++i) {
            const glm::vec4 u = points[i];
            const glm::vec3 direction = cosineDirection(patches.normal(side), {u.z, u.w});
            if (gapAt(side, patches.point(patchOf(side), {u.x, u.y}), direction, width(side)))
                ++near;
        }
        return near > 0 && near < kRays;
    }

  private:
    bool counts(uint32_t side) const {
        const Parent& parent = patches.parentAt(side);
        return parent.exchanges && !(parent.isSolid && isBack(side));
    }
    float width(uint32_t side) const { return std::sqrt(patches.area[patchOf(side)]); }

    // Returns the distance from a point of a side to the nearest surface in a direction, m. Returns
    // nothing if the surface is further than `farthest` or touches the side.
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
    float widest = 0;                       // no wider gap is narrow for any tile, m
    std::vector<std::atomic<bool>> narrow;  // per side
};

}  // namespace

Cuts contactCuts(const Patches& patches, const Visibility& visibility, size_t most,
                 bool cutsDense) {
    const size_t tiles = patches.count();
    if (most == 0) return {};
    Gaps gaps(patches, visibility);
    gaps.find();
    Cuts cuts;
    cuts.levels.assign(tiles, 0);
    parallelFor(uint32_t(0), uint32_t(tiles), [&](uint32_t tile) {
        if (!cutsDense && patches.isDense[tile]) return;
        if (gaps.isContact(2 * tile) || gaps.isContact(2 * tile + 1))
            cuts.levels[tile] = kContactLevel;
    });
    most = std::min(most, std::max(tiles, kMostMore));
    while (cuts.morePatches() > most)
        for (uint8_t& level : cuts.levels) level = uint8_t(std::max(0, level - 1));
    for (uint8_t level : cuts.levels) cuts.contacts += level > 0;
    if (cuts.contacts == 0) return {};
    return cuts;
}

}  // namespace raybundle
