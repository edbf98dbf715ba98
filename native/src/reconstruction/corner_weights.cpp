// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/corner_weights.h"

#include <algorithm>
#include <map>

#include "job/cancellation.h"
#include "patches/side.h"

namespace raybundle {
namespace {

// Where a wall cuts a cell, these exposed shares of a corner's own side of the wall decide which
// patches count at the corner. Up to kLeastExposed, the patches beyond the wall count fully; from
// kEnoughExposed on, they do not count. In between they count in part. The exposed shares are
// estimates from lines, and a small change of them then changes the light at the corner only a
// little.
constexpr float kLeastExposed = 0.05f, kEnoughExposed = 0.15f;
// If at least this share of a face lies inside a solid, the face keeps the darkness of the solid at
// its corners there.
constexpr float kMostInside = 0.5f;
// Affine coordinates of a point of a patch that is off the edges and the diagonal.
constexpr glm::vec2 kInside{0.35f, 0.3f};

// Returns the affine coordinates of the centroid of a parent or patch.
glm::vec2 middleOf(const Parent& parent) {
    return parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
}

}  // namespace

CornerWeights::CornerWeights(const LitSurfaces& surfaces, const InstanceRange& range, rb_side side)
    : patches(surfaces.patches),
      first(range.firstParent),
      counts(range.lastParent - range.firstParent, {1, 1, 1, 1}) {
    // Per cell that walls cut, and per corner of the cell: the area of the parents on the corner's
    // own side of the wall, weighted by the interpolation, and the exposed part of it, m^2.
    struct Support {
        std::array<float, 4> all{}, exposed{};
    };
    std::map<uint32_t, Support> supports;
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        throwIfCancelledAt(p);
        const Parent& parent = patches.parents[p];
        if (parent.seenCorners == 15) continue;
        Support& support = supports[parent.cell];
        for (uint32_t k = 0; k < parent.patchCount(); ++k) {
            const uint32_t patch = parent.firstPatch + k;
            const auto weights = patches.cells[parent.cell].weights(
                parent.position(parent.pointOn(k, middleOf(parent))));
            for (size_t a = 0; a < 4; ++a) {
                if (!(parent.seenCorners >> a & 1)) continue;
                const float own = patches.area[patch] * std::max(weights[a], 0.0f);
                support.all[a] += own;
                support.exposed[a] += own * surfaces.exposed[2 * patch + uint32_t(side)];
            }
        }
    }
    if (supports.empty()) return;
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        const Parent& parent = patches.parents[p];
        if (parent.seenCorners == 15) continue;
        const Support& support = supports.at(parent.cell);
        for (size_t a = 0; a < 4; ++a)
            if (!(parent.seenCorners >> a & 1) && support.all[a] > 0)
                counts[p - first][a] -=
                    std::clamp((support.exposed[a] / support.all[a] - kLeastExposed) /
                                   (kEnoughExposed - kLeastExposed),
                               0.0f, 1.0f);
    }
}

CornerWeights::OfPatch CornerWeights::of(uint32_t index, uint32_t patchInParent) const {
    const Parent& parent = patches.parents[index];
    OfPatch weights{patches.cells[parent.cell].weights(
                        parent.position(parent.pointOn(patchInParent, middleOf(parent)))),
                    1};
    if (!isParted(index)) return weights;
    weights.all = 0;
    for (size_t k = 0; k < 4; ++k) {
        weights.corner[k] *= counts[index - first][k];
        weights.all += weights.corner[k];
    }
    if (weights.all > 0)
        for (float& weight : weights.corner) weight /= weights.all;
    return weights;
}

std::vector<float> exposedOutside(const LitSurfaces& surfaces, const Visibility& visibility) {
    const Patches& patches = surfaces.patches;
    std::vector<float> exposed = surfaces.exposed;
    std::vector<uint8_t> isInside(patches.sideCount(), false);
    parallelFor(size_t(0), patches.parents.size(), [&](size_t p) {
        const Parent& parent = patches.parents[p];
        if (parent.seenCorners == 15) return;
        for (uint32_t k = 0; k < 2 * parent.patchCount(); ++k) {
            const uint32_t side = 2 * parent.firstPatch + k;
            float distance = 0;
            const auto met = visibility.firstHit(side, patches.point(patchOf(side), kInside),
                                                 patches.normal(side), &distance);
            if (!met) continue;
            const Parent& other = patches.parentAt(*met);
            isInside[side] = other.isSolid && !other.isInward && isBack(*met);
        }
    });
    // Per cell and side: area inside of a solid, and whole area, m^2.
    std::map<uint32_t, std::array<float, 2>> inside, all;
    auto forEach = [&](const auto& visit) {
        for (const Parent& parent : patches.parents) {
            if (parent.seenCorners == 15) continue;
            for (uint32_t k = 0; k < 2 * parent.patchCount(); ++k)
                visit(2 * parent.firstPatch + k, parent.cell);
        }
    };
    forEach([&](uint32_t side, uint32_t cell) {
        all[cell][isBack(side)] += patches.area[patchOf(side)];
        if (isInside[side]) inside[cell][isBack(side)] += patches.area[patchOf(side)];
    });
    forEach([&](uint32_t side, uint32_t cell) {
        if (isInside[side] && inside[cell][isBack(side)] < kMostInside * all[cell][isBack(side)])
            exposed[side] = 0;
    });
    return exposed;
}

}  // namespace raybundle
