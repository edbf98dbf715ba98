// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/line_windows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace raybundle {
namespace {

// Patches with fewer pixels than this are starved: 64 bundles give them 4 lines. Where they are at
// least kLeastStarvedShare of all patches, windows are made.
constexpr double kStarvedPixels = 1.0 / 8, kLeastStarvedShare = 0.1;
// A patch belongs into the next level while it has fewer pixels than this. A whole window gets
// finer only for this share of the patches that it was made for.
constexpr double kFewPixels = 0.35, kLeastFinerShare = 0.2;
// Pixels of all windows along a direction, in the mean: finer levels are left out beyond it.
constexpr double kMostWindowPixels = 1 << 17;
constexpr size_t kMostWindows = 24, kLeastPatches = 64;
// Where a window has more pixels for each of the patches that it is made for, these are slivers or
// far apart.
constexpr double kMostPixelsEach = 64;
// What a window costs besides its pixels, in pixels: looking whether the parents meet it.
constexpr double kWindowCost = 500, kParentCost = 1.0 / 32;
constexpr double kWorthSplitting = 0.97;  // share of the cost that splitting must come below
constexpr double kAlmostAll = 0.6;        // a window with so much of the one around replaces it
constexpr int kBins = 16;
// The counts' bits: lines of the largest patch in the finest pixels, times the bundles.
constexpr double kMostUnits = double(1u << 31) / kMostWindowBundles;

struct Box {
    glm::vec3 low{std::numeric_limits<float>::max()}, high{-std::numeric_limits<float>::max()};

    void add(const glm::vec3& p) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    void add(const Box& other) {
        low = glm::min(low, other.low);
        high = glm::max(high, other.high);
    }
    bool isEmpty() const { return low.x > high.x; }
    // Of its shadow, mean over all directions (Cauchy): a quarter of the surface.
    double meanShadow() const {
        if (isEmpty()) return 0;
        const glm::dvec3 d(high - low);
        return 0.5 * (d.x * d.y + d.y * d.z + d.z * d.x);
    }
};

using Members = std::vector<uint32_t>;  // parents

class Clustering {
  public:
    explicit Clustering(const Patches& patches) : patches(patches), boxes(patches.parents.size()) {
        for (size_t i = 0; i < boxes.size(); ++i) {
            const Parent& parent = patches.parents[i];
            boxes[i].add(parent.origin);
            boxes[i].add(parent.origin + parent.a);
            boxes[i].add(parent.origin + parent.b);
            if (!parent.isTriangle) boxes[i].add(parent.origin + parent.a + parent.b);
        }
    }

    double patchArea(uint32_t parent) const {
        return double(patches.area[patches.parents[parent].firstPatch]);
    }
    size_t patchCount(const Members& members) const {
        size_t count = 0;
        for (uint32_t m : members) count += patches.parents[m].patchCount();
        return count;
    }

    // Splits members into clusters, each for a window with the same pixels.
    std::vector<Members> split(Members members, double pixelArea, size_t mostClusters) const {
        std::vector<Members> open{std::move(members)}, done;
        while (!open.empty()) {
            Members cluster = std::move(open.back());
            open.pop_back();
            Members part;
            if (open.size() + done.size() + 2 <= mostClusters && cut(cluster, part, pixelArea)) {
                open.push_back(std::move(part));
                open.push_back(std::move(cluster));
            } else {
                done.push_back(std::move(cluster));
            }
        }
        return done;
    }

    Box boxOf(const Members& members) const {
        Box box;
        for (uint32_t m : members) box.add(boxes[m]);
        return box;
    }

  private:
    double cost(const Box& box, double pixelArea) const {
        return box.meanShadow() / pixelArea + kWindowCost + kParentCost * double(boxes.size());
    }

    // Moves a part of the cluster to `part` if two windows cost less than one.
    bool cut(Members& cluster, Members& part, double pixelArea) const {
        const Box box = boxOf(cluster);
        double best = kWorthSplitting * cost(box, pixelArea);
        int bestAxis = -1;
        float bestPlace = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const float low = box.low[axis], width = (box.high[axis] - low) / kBins;
            if (!(width > 0)) continue;
            std::array<Box, kBins> bins;
            auto binOf = [&](uint32_t m) {
                const float middle = 0.5f * (boxes[m].low[axis] + boxes[m].high[axis]);
                return std::clamp(int((middle - low) / width), 0, kBins - 1);
            };
            for (uint32_t m : cluster) bins[size_t(binOf(m))].add(boxes[m]);
            std::array<Box, kBins> above;  // this bin and all above
            above[kBins - 1] = bins[kBins - 1];
            for (size_t b = kBins - 1; b-- > 0;) {
                above[b] = above[b + 1];
                above[b].add(bins[b]);
            }
            Box below;
            for (size_t b = 0; b + 1 < kBins; ++b) {
                below.add(bins[b]);
                if (below.isEmpty() || above[b + 1].isEmpty()) continue;
                const double both = cost(below, pixelArea) + cost(above[b + 1], pixelArea);
                if (both < best) {
                    best = both;
                    bestAxis = axis;
                    bestPlace = low + float(b + 1) * width;
                }
            }
        }
        if (bestAxis < 0) return false;
        const auto middle = std::stable_partition(cluster.begin(), cluster.end(), [&](uint32_t m) {
            return 0.5f * (boxes[m].low[bestAxis] + boxes[m].high[bestAxis]) < bestPlace;
        });
        part.assign(middle, cluster.end());
        cluster.erase(middle, cluster.end());
        return !part.empty() && !cluster.empty();
    }

    const Patches& patches;
    std::vector<Box> boxes;  // per parent
};

// Patches of a window that are still too small for its pixels, and the window; kNoWindow is the
// scene.
constexpr int32_t kNoWindow = -1;
struct Dense {
    Members members;
    int32_t window;
};

// Plans the windows level by level.
class Planner {
  public:
    Planner(const Clustering& clustering, double coarse, LineDensity& density)
        : clustering(clustering), coarse(coarse), density(density) {}

    // Windows of one level within those of the level before.
    std::vector<Dense> refine(const std::vector<Dense>& outer, int level) {
        std::vector<Dense> inner;
        const double around = pixelArea(level - 1);
        for (const Dense& dense : outer) {
            Members small;
            for (uint32_t m : dense.members)
                if (clustering.patchArea(m) < kFewPixels * around) small.push_back(m);
            if (density.windows.size() >= kMostWindows ||
                clustering.patchCount(small) < kLeastPatches)
                continue;
            for (Members& members : clustering.split(std::move(small), pixelArea(level),
                                                     kMostWindows - density.windows.size()))
                if (clustering.patchCount(members) >= kLeastPatches)
                    if (const int32_t window = place(members, dense.window, level);
                        window != kNoWindow)
                        inner.push_back({std::move(members), window});
        }
        return inner;
    }

  private:
    double pixelArea(int level) const { return std::ldexp(coarse * coarse, -2 * level); }
    double pixelsOf(const Box& box, int level) const { return box.meanShadow() / pixelArea(level); }

    // Adds a window, or makes the one around finer if that is hardly larger. kNoWindow if it would
    // have too many pixels.
    int32_t place(const Members& members, int32_t around, int level) {
        const Box box = clustering.boxOf(members);
        if (around != kNoWindow) {
            LineWindow& outer = density.windows[size_t(around)];
            const Box outerBox{outer.low, outer.high};
            if (box.meanShadow() > kAlmostAll * outerBox.meanShadow()) {
                const double more = pixelsOf(outerBox, level) - pixelsOf(outerBox, outer.level);
                const bool isWorthIt = double(clustering.patchCount(members)) >=
                                       kLeastFinerShare * double(madeFor[size_t(around)]);
                if (!isWorthIt || pixels + more > kMostWindowPixels) return kNoWindow;
                pixels += more;
                outer.level = level;
                return around;
            }
        }
        const double own = pixelsOf(box, level);
        if (pixels + own > kMostWindowPixels ||
            own > kMostPixelsEach * double(clustering.patchCount(members)))
            return kNoWindow;
        pixels += own;
        density.windows.push_back({box.low, box.high, level});
        madeFor.push_back(clustering.patchCount(members));
        const int32_t window = int32_t(density.windows.size()) - 1;
        for (uint32_t m : members) density.windowOf[m] = window;
        return window;
    }

    const Clustering& clustering;
    const double coarse;  // edge of a pixel outside of all windows, metres
    LineDensity& density;
    std::vector<size_t> madeFor;  // per window: patches
    double pixels = 0;            // of all windows
};

}  // namespace

LineDensity densityByDetail(const Patches& patches, float pixelSize, float pixelsPerPatch,
                            float leastPixelSize) {
    LineDensity density{pixelSize, {}, {}};
    const double starvedArea = kStarvedPixels * double(pixelSize) * double(pixelSize);
    size_t starved = 0;
    double logSum = 0, largest = 0;
    for (float area : patches.area) {
        starved += double(area) < starvedArea;
        logSum += double(area) * std::log(double(area));
        largest = std::max(largest, double(area));
    }
    if (starved < kLeastPatches || double(starved) < kLeastStarvedShare * double(patches.count()))
        return density;

    // Outside of the windows the pixels follow the patches that most of the area is made of.
    const double usual = std::exp(logSum / patches.totalArea);
    density.pixelSize =
        std::max({pixelSize, leastPixelSize, float(std::sqrt(usual / double(pixelsPerPatch)))});
    density.windowOf.assign(patches.parents.size(), kNoWindow);
    const double coarse = double(density.pixelSize);
    const int mostLevel = int(std::floor(0.5 * std::log2(kMostUnits * coarse * coarse / largest)));

    const Clustering clustering(patches);
    Planner planner(clustering, coarse, density);
    Members all(patches.parents.size());
    std::iota(all.begin(), all.end(), 0u);
    std::vector<Dense> outer{{std::move(all), kNoWindow}};
    for (int level = 1; level <= mostLevel && !outer.empty(); ++level)
        outer = planner.refine(outer, level);
    if (density.windows.empty()) return {pixelSize, {}, {}};
    return density;
}

}  // namespace raybundle
