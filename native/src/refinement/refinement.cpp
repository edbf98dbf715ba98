// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/refinement.h"

#include <algorithm>
#include <cmath>

#include "job/cancellation.h"
#include "patches/side.h"
#include "reconstruction/reconstruction.h"
#include "scene/channels.h"
#include "stated_error/surplus.h"

namespace raybundle {
namespace {

// RMS error that a cut must remove, relative to the RMS light, in targets (see the head of
// refinement.h).
constexpr double kWorth = 1.5;
// RMS error that all cuts together must remove to be worth their shadow rays, relative to the RMS
// light, in targets.
constexpr double kLeastGain = 0.4;
// Shares of the squared surplus that halving the edges removes: for a step, as at the edge of a
// shadow, and for smooth light.
constexpr double kStepGain = 0.5, kSmoothGain = 15.0 / 16;
// Number of times that the edges of a cut tile are halved, and the number of patches that this
// adds.
constexpr uint8_t kCutLevel = 1;
constexpr size_t kMorePatches = (size_t(1) << (2 * kCutLevel)) - 1;

struct Mark {
    double gain = 0;  // squared error that the cut removes, over the squared light
    bool isShadowEdge = false;
};

// Returns whether the light of a side is part of the result and the side is not the inside of a
// solid.
bool isWanted(const Scene& scene, const Patches& patches, uint32_t side) {
    const Parent& parent = patches.parentAt(side);
    const Instance& instance = scene.instances[parent.instance];
    return instance.hasResultOnFace(size_t(parent.face)) && !(parent.isSolid && isBack(side));
}

// Returns the mean square of the light, under the assumption that all light but that of the sources
// is uniform as in a closed room.
double meanSquareLight(const Patches& patches, const CoarseShot& shot) {
    double sum = 0, squares = 0, area = 0, reflected = 0;
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        throwIfCancelledAt(side);
        const double h = double(brightest(shot.gathered[side].irradiance));
        if (!(h > 0)) continue;
        const double a = double(patches.area[patchOf(side)]);
        sum += a * h;
        squares += a * h * h;
        reflected += a * h * double(brightest(patches.reflectance[side]));
        area += a;
    }
    if (!(area > 0)) return 0;
    const double mean = sum / area, rho = reflected / sum;
    const double more = (mean * rho + shot.bundled) / (1 - rho);
    return squares / area + 2 * mean * more + more * more;
}

// Returns whether the cuts for the light of one set could pay, from an upper bound of what they can
// gain.
bool mayGain(const Patches& patches, const CoarseShot& shot, double light, double targetError) {
    double most = 0;
    for (size_t side = 0; side < patches.sideCount(); ++side)
        most += double(patches.area[patchOf(side)]) * kStepGain *
                double(shot.gathered[side].contrast) * double(shot.gathered[side].contrast);
    return most > std::pow(kLeastGain * targetError, 2) * light * patches.totalArea;
}

// Marks the tiles whose cuts pay for the light of one set.
void mark(const Scene& scene, const Patches& patches, const CoarseShot& shot, bool cutsDense,
          double targetError, std::vector<Mark>& marks) {
    const double light = meanSquareLight(patches, shot);
    if (!(light > 0) || !mayGain(patches, shot, light, targetError)) return;
    const double least = std::pow(kWorth * targetError, 2);
    Irradiance irradiance(patches.sideCount());
    std::vector<float> error(patches.sideCount());
    for (size_t side = 0; side < error.size(); ++side) {
        irradiance.direct[side] = irradiance.ofSources[side] = shot.gathered[side].irradiance;
        error[side] = std::sqrt(shot.gathered[side].variance);
    }
    const std::vector<float> exposed(patches.sideCount(), 1.0f);
    const std::vector<InstanceRange> ranges = instanceRanges(scene, patches);
    parallelFor(size_t(0), 2 * ranges.size(), [&](size_t k) {
        const InstanceRange& range = ranges[k / 2];
        if (range.firstParent >= range.lastParent) return;
        const Parent& last = patches.parents[range.lastParent - 1];
        const uint32_t first = patches.parents[range.firstParent].firstPatch,
                       end = last.firstPatch + last.patchCount(), back = uint32_t(k % 2);
        bool hasEdge = false;
        for (uint32_t tile = first; tile < end && !hasEdge; ++tile)
            hasEdge = shot.gathered[2 * tile + back].contrast > 0;
        if (!hasEdge) return;
        const std::vector<Surplus> surplus =
            surplusOf({patches, exposed}, range.firstParent, range.lastParent, rb_side(back),
                      irradiance, error);
        for (uint32_t tile = first; tile < end; ++tile) {
            const uint32_t side = 2 * tile + back;
            const Surplus& found = surplus[tile - first];
            if (!found.isKnown || !isWanted(scene, patches, side)) continue;
            if (!cutsDense && patches.isDense[tile]) continue;
            const double step = shot.gathered[side].contrast > 0
                                    ? kStepGain * std::max(0.0, double(found.step))
                                    : 0;
            const double smooth = kSmoothGain * double(found.smooth);
            // The surplus is summed over the three channels.
            const double gain = (step + smooth) / (3 * light);
            if (gain > std::max(least, marks[tile].gain)) marks[tile] = {gain, step > smooth};
        }
    });
}

}  // namespace

Cuts worthwhileCuts(const Scene& scene, const Patches& patches,
                    const std::vector<CoarseShot>& shots, size_t most, float targetError,
                    bool cutsDense) {
    const size_t tiles = patches.count();
    std::vector<Mark> marks(tiles);
    for (const CoarseShot& shot : shots)
        mark(scene, patches, shot, cutsDense, double(targetError), marks);

    std::vector<uint32_t> order;
    for (uint32_t tile = 0; tile < tiles; ++tile)
        if (marks[tile].gain > 0) order.push_back(tile);
    std::stable_sort(order.begin(), order.end(),
                     [&](uint32_t a, uint32_t b) { return marks[a].gain > marks[b].gain; });
    order.resize(std::min(order.size(), most / kMorePatches));
    Cuts cuts;
    cuts.levels.assign(tiles, 0);
    double gain = 0;
    for (uint32_t tile : order) {
        cuts.levels[tile] = kCutLevel;
        ++(marks[tile].isShadowEdge ? cuts.shadowEdges : cuts.bentLight);
        gain += marks[tile].gain * double(patches.area[tile]);
    }
    if (gain <= std::pow(kLeastGain * double(targetError), 2) * patches.totalArea) return {};
    return cuts;
}

}  // namespace raybundle
