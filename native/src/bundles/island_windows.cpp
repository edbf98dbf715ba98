// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/island_windows.h"

#include <algorithm>
#include <cmath>

#include "job/settings.h"

namespace raybundle {

double IslandDensity::windowPixels() const {
    const double pixelArea = double(density.pixelSize) * double(density.pixelSize);
    double sum = 0;
    for (const LineWindow& window : density.windows)
        sum += std::ldexp(WindowBox{window.low, window.high}.meanRectangle() / pixelArea,
                          2 * window.level);
    return sum;
}

namespace {

// Patches with fewer pixels than kStarvedPixels are starved: 64 bundles give them 4 lines. Windows
// are made if at least kLeastStarvedShare of all patches are starved.
constexpr double kStarvedPixels = 1.0 / 8, kLeastStarvedShare = 0.1;
// A patch belongs to the next level as long as it has fewer pixels than kFewPixels. A whole window
// gets finer only for at least kLeastFinerShare of the patches that it was made for.
constexpr double kFewPixels = 0.35, kLeastFinerShare = 0.2;
// Largest number of pixels of all windows, averaged over directions. Finer levels that would exceed
// it are left out.
constexpr double kMostWindowPixels = 1 << 17;
// A window that fills more than this share of the one around it replaces it.
constexpr double kAlmostAll = 0.6;
// Limit on the bits of the counts: finest lines on the largest patch, times the number of bundles.
constexpr double kMostUnits = double(1u << 31) / kMostWindowBundles;

// Patches of a window that are still too small for its pixels. The window kNoWindow is the scene.
struct Dense {
    ParentGroup members;
    int32_t window;
};

// Plans the windows of an island, level by level.
class Planner {
  public:
    Planner(const ParentGroups& groups, double coarse, LineDensity& density)
        : groups(groups), coarse(coarse), density(density) {}

    // Returns the windows of one level inside those of the previous level.
    std::vector<Dense> refine(const std::vector<Dense>& outer, int level) {
        std::vector<Dense> inner;
        const double around = pixelArea(level - 1);
        for (const Dense& dense : outer) {
            ParentGroup small;
            for (uint32_t m : dense.members)
                if (groups.patchArea(m) < kFewPixels * around) small.push_back(m);
            if (density.windows.size() >= kMostWindows || groups.patchCount(small) < kLeastPatches)
                continue;
            for (ParentGroup& members : groups.split(std::move(small), pixelArea(level),
                                                     kMostWindows - density.windows.size()))
                if (groups.patchCount(members) >= kLeastPatches)
                    if (const int32_t window = place(members, dense.window, level);
                        window != kNoWindow)
                        inner.push_back({std::move(members), window});
        }
        return inner;
    }

  private:
    double pixelArea(int level) const { return std::ldexp(coarse * coarse, -2 * level); }
    double pixelsOf(const WindowBox& box, int level) const {
        return box.meanRectangle() / pixelArea(level);
    }

    // Adds a window, or makes the surrounding window finer if it is hardly larger. Returns the
    // index of the window, or kNoWindow if it would have too many pixels.
    int32_t place(const ParentGroup& members, int32_t around, int level) {
        const WindowBox box = groups.boxOf(members);
        if (around != kNoWindow) {
            LineWindow& outer = density.windows[size_t(around)];
            const WindowBox outerBox{outer.low, outer.high};
            if (box.meanRectangle() > kAlmostAll * outerBox.meanRectangle()) {
                const double more = pixelsOf(outerBox, level) - pixelsOf(outerBox, outer.level);
                const bool isWorthIt = double(groups.patchCount(members)) >=
                                       kLeastFinerShare * double(madeFor[size_t(around)]);
                if (!isWorthIt || pixels + more > kMostWindowPixels) return kNoWindow;
                pixels += more;
                outer.level = level;
                return around;
            }
        }
        const double own = pixelsOf(box, level);
        if (pixels + own > kMostWindowPixels ||
            own > kMostPixelsEach * double(groups.patchCount(members)))
            return kNoWindow;
        pixels += own;
        density.windows.push_back({box.low, box.high, level});
        madeFor.push_back(groups.patchCount(members));
        const int32_t window = int32_t(density.windows.size()) - 1;
        for (uint32_t m : members) density.windowOf[m] = window;
        return window;
    }

    const ParentGroups& groups;
    const double coarse;  // edge of a pixel outside of all windows, metres
    LineDensity& density;
    std::vector<size_t> madeFor;  // per window: number of patches that it was made for
    double pixels = 0;            // total of all windows
};

}  // namespace

void findWindows(const Patches& patches, const ParentGroups& groups, float pixelsPerPatch,
                 float leastPixelSize, IslandDensity& island) {
    LineDensity& density = island.density;
    const double starvedArea =
        kStarvedPixels * double(density.pixelSize) * double(density.pixelSize);
    const ParentGroup members =
        groups.withoutCrumbs(groups.withoutDust(island.members), starvedArea);
    size_t starved = 0;
    double logSum = 0;
    for (uint32_t m : members) {
        const Parent& parent = patches.parents[m];
        for (uint32_t p = parent.firstPatch; p < parent.firstPatch + parent.patchCount(); ++p) {
            const double area = double(patches.area[p]);
            starved += area < starvedArea;
            logSum += area * std::log(area);
        }
    }
    if (starved < kLeastPatches ||
        double(starved) < kLeastStarvedShare * double(groups.patchCount(members)))
        return;

    // Outside of the windows, the pixel size follows the patches that most of the area consists of.
    const double usual = std::exp(logSum / island.area);
    const float before = density.pixelSize;
    density.pixelSize =
        std::max({before, leastPixelSize, float(std::sqrt(usual / double(pixelsPerPatch)))});
    density.windowOf.assign(patches.parents.size(), kNoWindow);
    const double coarse = double(density.pixelSize);
    const int mostLevel =
        int(std::floor(0.5 * std::log2(kMostUnits * coarse * coarse / island.largest)));
    Planner planner(groups, coarse, density);
    std::vector<Dense> outer{{members, kNoWindow}};
    for (int level = 1; level <= mostLevel && !outer.empty(); ++level)
        outer = planner.refine(outer, level);
    if (density.windows.empty()) {
        density.pixelSize = before;
        density.windowOf.clear();
    }
}

}  // namespace raybundle
