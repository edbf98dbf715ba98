// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/line_windows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "job/cancellation.h"
#include "job/settings.h"

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
// An object of less than this share of the surface of its box is dust or wires: nearly all lines of
// a window would pass it by. It gathers with local rays.
constexpr double kLeastFilled = 1e-3;
// Starved patches that are less than this share of their object's area have no windows.
constexpr double kCrumbs = 1e-3;
// What a window costs besides its pixels, in pixels: looking whether the parents meet it.
constexpr double kWindowCost = 500, kParentCost = 1.0 / 32;
constexpr double kWorthSplitting = 0.97;  // share of the cost that splitting must come below
constexpr double kAlmostAll = 0.6;        // a window with so much of the one around replaces it
constexpr int kBins = 16;
// The counts' bits: lines of the largest patch in the finest pixels, times the bundles.
constexpr double kMostUnits = double(1u << 31) / kMostWindowBundles;
// The same between islands, and the least bundles that must be possible: a side has half of the
// units in each bundle at most, so that they need not fit twice.
constexpr double kLeastMostBundles = 4096, kMostIslandUnits = 0x1p32 / kLeastMostBundles;
// All islands together may cost so much more than each would alone, as a share of what the first
// one costs: else the pixels of large ones are coarser.
constexpr double kMostMore = 0.25;

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
    // Of the rectangle around its shadow, which is what a window has, mean over all directions and
    // turns of the plane, in proportion: for a cube it is the shadow. (Of two axes at right angles
    // at random |r.x u.x| has the mean 2 / (3 pi), and |r.x u.y| by simulation 0.2705.)
    double meanRectangle() const {
        if (isEmpty()) return 0;
        const glm::dvec3 d(high - low);
        return 0.141 * glm::dot(d, d) + 0.359 * (d.x * d.y + d.y * d.z + d.z * d.x);
    }
};

using Members = std::vector<uint32_t>;  // parents

class Clustering {
  public:
    explicit Clustering(const Patches& patches) : patches(patches), boxes(patches.parents.size()) {
        for (size_t i = 0; i < boxes.size(); ++i) {
            const Parent& parent = patches.parents[i];
            const glm::vec3 origin = patches.axes * parent.origin, a = patches.axes * parent.a,
                            b = patches.axes * parent.b;
            boxes[i].add(origin);
            boxes[i].add(origin + a);
            boxes[i].add(origin + b);
            if (!parent.isTriangle) boxes[i].add(origin + a + b);
        }
    }

    double patchArea(uint32_t parent) const {
        return double(patches.area[patches.parents[parent].firstPatch]);
    }
    // Of a parent, or of the cluster that it stands for (patches/clusters.h), m^2.
    double area(uint32_t parent) const {
        return std::max(double(patches.parents[parent].area()), patchArea(parent));
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

    Members withoutDust(const Members& members) const {
        std::vector<Box> box;  // per instance
        std::vector<double> area;
        for (uint32_t m : members) {
            const Parent& parent = patches.parents[m];
            if (parent.instance >= box.size()) {
                box.resize(parent.instance + 1);
                area.resize(parent.instance + 1, 0.0);
            }
            box[parent.instance].add(boxes[m]);
            area[parent.instance] += this->area(m);
        }
        Members rest;
        for (uint32_t m : members)
            if (const uint32_t i = patches.parents[m].instance;
                area[i] > kLeastFilled * 4 * box[i].meanShadow())
                rest.push_back(m);
        return rest;
    }

  private:
    double cost(const Box& box, double pixelArea) const {
        return box.meanRectangle() / pixelArea + kWindowCost + kParentCost * double(boxes.size());
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
constexpr int kMostHalvings = 30;
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
    double pixelsOf(const Box& box, int level) const {
        return box.meanRectangle() / pixelArea(level);
    }

    // Adds a window, or makes the one around finer if that is hardly larger. kNoWindow if it would
    // have too many pixels.
    int32_t place(const Members& members, int32_t around, int level) {
        const Box box = clustering.boxOf(members);
        if (around != kNoWindow) {
            LineWindow& outer = density.windows[size_t(around)];
            const Box outerBox{outer.low, outer.high};
            if (box.meanRectangle() > kAlmostAll * outerBox.meanRectangle()) {
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

namespace {

// What one island has, by its parents, without those around it.
struct IslandDensity {
    Members members;
    size_t patchCount = 0;
    double area = 0, largest = 0;  // of its patches, m^2
    Box box;
    LineDensity density;

    // What a bundle costs: pixels of its shadow, and where its surfaces are twice.
    double cost(double pixel) const { return (box.meanShadow() + area / 2) / (pixel * pixel); }
    double costAlone() const { return cost(double(density.pixelSize)) + windowPixels(); }
    double windowPixels() const {
        const double pixelArea = double(density.pixelSize) * double(density.pixelSize);
        double sum = 0;
        for (const LineWindow& window : density.windows)
            sum += std::ldexp(Box{window.low, window.high}.meanRectangle() / pixelArea,
                              2 * window.level);
        return sum;
    }
};

// Without the starved patches of objects that hardly have any by area: slivers between large faces,
// whose light is that of what lies beside them.
Members withoutCrumbs(const Patches& patches, const Clustering& clustering, const Members& members,
                      double starvedArea) {
    auto isStarved = [&](const Parent& parent) {
        return double(patches.area[parent.firstPatch]) < starvedArea;
    };
    std::vector<double> area, starved;  // per instance
    for (uint32_t m : members) {
        const Parent& parent = patches.parents[m];
        if (parent.instance >= area.size()) {
            area.resize(parent.instance + 1, 0.0);
            starved.resize(parent.instance + 1, 0.0);
        }
        area[parent.instance] += clustering.area(m);
        if (isStarved(parent)) starved[parent.instance] += clustering.area(m);
    }
    Members rest;
    for (uint32_t m : members) {
        const Parent& parent = patches.parents[m];
        if (!isStarved(parent) || starved[parent.instance] > kCrumbs * area[parent.instance])
            rest.push_back(m);
    }
    return rest;
}

void findWindows(const Patches& patches, const Clustering& clustering, float pixelsPerPatch,
                 float leastPixelSize, IslandDensity& island) {
    LineDensity& density = island.density;
    const double starvedArea =
        kStarvedPixels * double(density.pixelSize) * double(density.pixelSize);
    const Members members =
        withoutCrumbs(patches, clustering, clustering.withoutDust(island.members), starvedArea);
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
        double(starved) < kLeastStarvedShare * double(clustering.patchCount(members)))
        return;

    // Outside of the windows the pixels follow the patches that most of the area is made of.
    const double usual = std::exp(logSum / island.area);
    const float before = density.pixelSize;
    density.pixelSize =
        std::max({before, leastPixelSize, float(std::sqrt(usual / double(pixelsPerPatch)))});
    density.windowOf.assign(patches.parents.size(), kNoWindow);
    const double coarse = double(density.pixelSize);
    const int mostLevel =
        int(std::floor(0.5 * std::log2(kMostUnits * coarse * coarse / island.largest)));
    Planner planner(clustering, coarse, density);
    std::vector<Dense> outer{{members, kNoWindow}};
    for (int level = 1; level <= mostLevel && !outer.empty(); ++level)
        outer = planner.refine(outer, level);
    if (density.windows.empty()) {
        density.pixelSize = before;
        density.windowOf.clear();
    }
}

// How often the edge of a pixel is halved for an island: of those after the first not at all as
// long as their patches have pixels enough.
int halvings(const IslandDensity& island, double pixel, bool isFirst) {
    const double finer = std::log2(pixel / double(island.density.pixelSize));
    return isFirst || finer > 1.25 ? std::clamp(int(std::lround(finer)), 0, kMostHalvings) : 0;
}

}  // namespace

LineDensity densityByDetail(const Patches& patches, const std::vector<float>& pixelSizes,
                            float pixelsPerPatch, const std::vector<float>& leastPixelSizes) {
    const Clustering clustering(patches);
    std::vector<IslandDensity> islands(patches.islands.size());
    for (uint32_t i = 0; i < patches.parents.size(); ++i) {
        throwIfCancelledAt(i);
        const Parent& parent = patches.parents[i];
        if (patches.parentOf[parent.firstPatch] != i) continue;  // another stands for its cluster
        IslandDensity& island = islands[parent.island];
        island.members.push_back(i);
        island.patchCount += parent.patchCount();
        for (uint32_t p = parent.firstPatch; p < parent.firstPatch + parent.patchCount(); ++p) {
            island.area += double(patches.area[p]);
            island.largest = std::max(island.largest, double(patches.area[p]));
        }
    }
    double alone = 0, largest = 0;
    for (size_t k = 0; k < islands.size(); ++k) {
        IslandDensity& island = islands[k];
        island.density.pixelSize = pixelSizes[k];
        island.box = clustering.boxOf(island.members);
        findWindows(patches, clustering, pixelsPerPatch, leastPixelSizes[k], island);
        // Long wires, say, have a shadow of many pixels for few patches.
        const double most = islands.front().costAlone();
        if (k > 0 && island.costAlone() > most &&
            island.costAlone() > kMostPixelsEach * double(island.patchCount)) {
            island.density.windows.clear();
            island.density.windowOf.clear();
            island.density.pixelSize =
                std::max(island.density.pixelSize, float(std::sqrt(island.cost(1) / most)));
        }
        alone += island.costAlone();
        largest = std::max(largest, island.largest);
    }
    auto fillClusters = [&](std::vector<int32_t>& windowOf) {
        for (size_t i = 0; i < windowOf.size(); ++i)
            windowOf[i] = windowOf[patches.parentOf[patches.parents[i].firstPatch]];
    };
    if (islands.size() == 1) {
        fillClusters(islands.front().density.windowOf);
        return islands.front().density;
    }

    // The pixels of the first island, or coarser by powers of two.
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
    const double pixel = std::ldexp(first, level);
    const int mostLevel =
        int(std::floor(0.5 * std::log2(kMostIslandUnits * pixel * pixel / largest)));

    // The first islands have the most patches.
    LineDensity all;
    all.pixelSize = float(pixel);
    all.windowOf.assign(patches.parents.size(), kNoWindow);
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
            // Of no effect where pixels are finer already.
            window.level = std::clamp(window.level + finer, 1, std::max(1, mostLevel));
            all.windows.push_back(window);
        }
        if (int32_t(all.windows.size()) == offset) continue;
        for (uint32_t m : island.members)
            if (const int32_t window = island.density.windowOf[m]; window != kNoWindow)
                all.windowOf[m] = offset + window;
    }
    if (all.windows.empty()) all.windowOf.clear();
    fillClusters(all.windowOf);
    return all;
}

uint32_t mostBundles(const Patches& patches, const LineDensity& density) {
    int finest = 0;
    for (const LineWindow& window : density.windows) finest = std::max(finest, window.level);
    double largest = 0;  // m^2
    for (uint32_t p = 0; p < patches.count(); ++p)
        largest = std::max(largest, double(patches.area[p]));
    // Of a half: half of the bundles. A line counts as many as there are finest ones in its pixel.
    const double pixel = double(density.pixelSize);
    const double units = std::ldexp(largest / (pixel * pixel), 2 * finest);
    const double most = density.windows.empty() ? 0x1p30 : double(kMostWindowBundles);
    return std::max(2u, uint32_t(std::min(most, 0x1p32 / units)));
}

}  // namespace raybundle
