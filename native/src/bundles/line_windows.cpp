// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/line_windows.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bundles/island_windows.h"
#include "bundles/parent_groups.h"
#include "job/cancellation.h"
#include "job/settings.h"

namespace raybundle {
namespace {

// Limit on the bits of the counts when islands differ: the number of finest lines on the largest
// patch per bundle. With it, at least kLeastMostBundles bundles are possible. On average a side has
// half of these lines in a bundle, so that no further factor of 2 is needed.
constexpr double kLeastMostBundles = 4096, kMostIslandUnits = 0x1p32 / kLeastMostBundles;
// All islands together may cost this much more than each of them alone, as a share of the cost of
// the first island. Otherwise the pixels of the large islands become coarser.
constexpr double kMostMore = 0.25;
constexpr int kMostHalvings = 30;

// Returns how often the edge of a pixel is halved for an island. Islands after the first one keep
// the common pixels as long as these are fine enough for their patches.
int halvings(const IslandDensity& island, double pixel, bool isFirst) {
    const double finer = std::log2(pixel / double(island.density.pixelSize));
    return isFirst || finer > 1.25 ? std::clamp(int(std::lround(finer)), 0, kMostHalvings) : 0;
}

// Returns the parents of each island and the areas of their patches.
std::vector<IslandDensity> islandsOf(const Patches& patches) {
    std::vector<IslandDensity> islands(patches.islands.size());
    for (uint32_t i = 0; i < patches.parents.size(); ++i) {
        throwIfCancelledAt(i);
        const Parent& parent = patches.parents[i];
        // Another parent stands for the cluster of this one.
        if (patches.parentOf[parent.firstPatch] != i) continue;
        IslandDensity& island = islands[parent.island];
        island.members.push_back(i);
        island.patchCount += parent.patchCount();
        for (uint32_t p = parent.firstPatch; p < parent.firstPatch + parent.patchCount(); ++p) {
            island.area += double(patches.area[p]);
            island.largest = std::max(island.largest, double(patches.area[p]));
        }
    }
    return islands;
}

// Returns the edge of a pixel of the first island, or this edge times a power of two, such that all
// islands together cost little more than each alone, metres.
double commonPixel(const std::vector<IslandDensity>& islands) {
    double alone = 0;
    for (const IslandDensity& island : islands) alone += island.costAlone();
    const double first = double(islands.front().density.pixelSize);
    int level = 0;
    auto cost = [&] {
        const double pixel = std::ldexp(first, level);
        double sum = 0;
        for (const IslandDensity& island : islands)
            sum += island.windowPixels() +
                   island.cost(
                       std::ldexp(pixel, -halvings(island, pixel, &island == &islands.front())));
        return sum;
    };
    while (level < kMostHalvings && cost() > alone + kMostMore * islands.front().costAlone())
        ++level;
    return std::ldexp(first, level);
}

// Returns the windows of all islands, and further windows around islands with finer pixels.
// `parents` is the number of all parents.
LineDensity joined(const std::vector<IslandDensity>& islands, size_t parents) {
    const double pixel = commonPixel(islands);
    double largest = 0;
    for (const IslandDensity& island : islands) largest = std::max(largest, island.largest);
    const int mostLevel =
        int(std::floor(0.5 * std::log2(kMostIslandUnits * pixel * pixel / largest)));

    // The islands with the most patches come first.
    LineDensity all;
    all.pixelSize = float(pixel);
    all.windowOf.assign(parents, kNoWindow);
    for (const IslandDensity& island : islands) {
        const int around =
            std::min(halvings(island, pixel, &island == &islands.front()), mostLevel);
        const int32_t before = int32_t(all.windows.size());
        if (around > 0 && island.patchCount >= kLeastPatches && before < int32_t(kMostWindows)) {
            for (uint32_t m : island.members) all.windowOf[m] = before;
            all.windows.push_back({island.box.low, island.box.high, around});
        }
        const int32_t offset = int32_t(all.windows.size());
        const int finer = int(std::lround(std::log2(pixel / double(island.density.pixelSize))));
        for (LineWindow window : island.density.windows) {
            // A window has no effect where pixels are finer already.
            window.level = std::clamp(window.level + finer, 1, std::max(1, mostLevel));
            all.windows.push_back(window);
        }
        if (int32_t(all.windows.size()) == offset) continue;
        for (uint32_t m : island.members)
            if (const int32_t window = island.density.windowOf[m]; window != kNoWindow)
                all.windowOf[m] = offset + window;
    }
    if (all.windows.empty()) all.windowOf.clear();
    return all;
}

}  // namespace

LineDensity densityByDetail(const Patches& patches, const std::vector<float>& pixelSizes,
                            float pixelsPerPatch, const std::vector<float>& leastPixelSizes) {
    const ParentGroups groups(patches);
    std::vector<IslandDensity> islands = islandsOf(patches);
    for (size_t k = 0; k < islands.size(); ++k) {
        IslandDensity& island = islands[k];
        island.density.pixelSize = pixelSizes[k];
        island.box = groups.boxOf(island.members);
        findWindows(patches, groups, pixelsPerPatch, leastPixelSizes[k], island);
        // Long wires, for example, have a shadow of many pixels for few patches.
        const double most = islands.front().costAlone();
        if (k > 0 && island.costAlone() > most &&
            island.costAlone() > kMostPixelsEach * double(island.patchCount)) {
            island.density.windows.clear();
            island.density.windowOf.clear();
            island.density.pixelSize =
                std::max(island.density.pixelSize, float(std::sqrt(island.cost(1) / most)));
        }
    }
    LineDensity density = islands.size() == 1 ? std::move(islands.front().density)
                                              : joined(islands, patches.parents.size());
    // All parents of a cluster get the window of the parent that stands for the cluster.
    for (size_t i = 0; i < density.windowOf.size(); ++i)
        density.windowOf[i] = density.windowOf[patches.parentOf[patches.parents[i].firstPatch]];
    return density;
}

uint32_t mostBundles(const Patches& patches, const LineDensity& density) {
    int finest = 0;
    for (const LineWindow& window : density.windows) finest = std::max(finest, window.level);
    double largest = 0;  // m^2
    for (uint32_t p = 0; p < patches.count(); ++p)
        largest = std::max(largest, double(patches.area[p]));
    // A half has half of the bundles. A line counts as many finest lines as fit into its pixel.
    const double pixel = double(density.pixelSize);
    const double units = std::ldexp(largest / (pixel * pixel), 2 * finest);
    const double most = density.windows.empty() ? 0x1p30 : double(kMostWindowBundles);
    return std::max(2u, uint32_t(std::min(most, 0x1p32 / units)));
}

}  // namespace raybundle
