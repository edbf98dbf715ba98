// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/planes.h"

#include <cmath>

#include "patches/side.h"

namespace raybundle {
namespace {

// Key of no fragment. Fragments lie inside the range, so that their depths are above 0.
constexpr uint64_t kNone = 0;
constexpr uint32_t kSky = UINT32_MAX;  // stands for a patch side
constexpr double kRange = 0x1p32;      // steps of depth in the range of the planes

// The range of the planes extends beyond the scene at both ends, by this share of the scene's
// depth.
constexpr double kMargin = 0.1;
// Least depth of the scene that is assumed, as a share of its radius, since a single flat surface
// has no depth.
constexpr double kLeastDepth = 0.01;
// Lower bound of the expected number of crossings. Only pairs closer than rounding error have
// fewer.
constexpr double kLeastCrossings = 0x1p-20;
constexpr double kMostLines = 0x1p30;  // of an exchange
constexpr size_t kDensityBins = 256;

uint32_t sideOf(uint64_t key) { return uint32_t(key); }
uint32_t depthOf(uint64_t key) { return uint32_t(key >> 32); }

double unit(uint64_t hash) { return double(hash >> 11) * 0x1p-53; }

}  // namespace

// Merges the lines of neighbouring pixels, since consecutive pixels usually see the same pair, and
// rounds their sum. One rounding per run makes less noise than one per pixel.
class Planes::Runs {
  public:
    Runs(uint64_t seed, uint32_t planeCount, BundleLines& out)
        : seed(seed), runs(planeCount, Run{0, 0, 0, 0}), out(out) {}

    // Counts a line that meets the scene.
    void countLine() { ++out.lines; }

    // Adds lines between sides i and j in a pixel. `firstPlane` is the first plane that crosses the
    // pair; it differs between all pairs of a pixel. `j` may be kSky.
    void add(uint32_t pixel, uint32_t firstPlane, uint32_t i, uint32_t j, double lines) {
        Run& run = runs[firstPlane];
        if (run.i != i || run.j != j) {
            finish(run, firstPlane);
            run = {i, j, pixel, 0};
        }
        run.lines += lines;
    }

    // Appends all runs to the output.
    void finish() {
        for (uint32_t k = 0; k < runs.size(); ++k) finish(runs[k], k);
    }

  private:
    struct Run {
        uint32_t i, j;
        uint32_t pixel;  // first pixel of the run
        double lines;
    };

    void finish(Run run, uint32_t firstPlane) {
        const uint64_t hash = mixBits(seed ^ mixBits(uint64_t(run.pixel) << 32 | firstPlane));
        const uint32_t lines = uint32_t(std::min(run.lines, kMostLines) + unit(hash));
        if (lines == 0) return;
        if (run.i > run.j) std::swap(run.i, run.j);
        if (run.j == kSky)
            out.sky.insert(out.sky.end(), lines, run.i);
        else
            out.exchanges.push_back({run.i, run.j, lines});
    }

    const uint64_t seed;
    std::vector<Run> runs;  // the open run of each plane
    BundleLines& out;
};

Planes::Planes(const ProjectorInput& input, int planeCount)
    : input(input),
      planeCount(uint32_t(planeCount)),
      depthOrder(input.patches),
      rasteriser(input.patches, input.pixelSize, input.smallPatches),
      planes(size_t(planeCount)) {
    density.setUniform();
}

std::unique_ptr<Projector> plane(const ProjectorInput& input) {
    ProjectorInput one = input;
    one.planePlacement = PlanePlacement::SYSTEMATIC;
    one.planeCoherence = false;  // there is only one plane
    return std::make_unique<Planes>(one, 1);
}

std::unique_ptr<Projector> planes(const ProjectorInput& input) {
    return std::make_unique<Planes>(input, input.planeCount);
}

void Planes::project(const Bundle& bundle, BundleLines& out) {
    rasteriser.begin(bundle);
    depthOrder.begin(bundle.direction);
    const double depth = std::max(rasteriser.depthHigh() - rasteriser.depthLow(),
                                  kLeastDepth * double(input.patches.radius));
    depthLow = 0.5 * (rasteriser.depthLow() + rasteriser.depthHigh()) - (0.5 + kMargin) * depth;
    depthSteps = kRange / ((1 + 2 * kMargin) * depth);
    zoneSteps = uint64_t(std::min(depthOrder.zone() * depthSteps, kRange));

    const uint64_t seed = lineName(bundle);
    if (input.planePlacement == PlanePlacement::CLOSE_DISTANCE) measureDensity();
    placePlanes(seed);
    Runs runs(mixBits(seed), planeCount, out);
    if (input.planeCoherence)
        sweep(runs);
    else
        projectOneByOne(runs);
    runs.finish();
}

template <class Visit>
void Planes::forEachFragment(const Visit& visit) {
    rasteriser.forEachFragment([&](uint32_t pixel, double depth, uint32_t side) {
        visit(pixel, Key(uint32_t((depth - depthLow) * depthSteps)) << 32 | side);
    });
}

void Planes::measureDensity() {
    fragmentsInBin.assign(kDensityBins, 0);
    forEachFragment([&](uint32_t, Key fragment) {
        ++fragmentsInBin[uint64_t(depthOf(fragment)) * kDensityBins >> 32];
    });
    density.setMixture(fragmentsInBin);
}

void Planes::placePlanes(uint64_t seed) {
    for (uint32_t k = 0; k < planeCount; ++k) {
        const bool isStratified = input.planePlacement == PlanePlacement::STRATIFIED;
        const double offset = unit(mixBits(seed + (isStratified ? k : 0)));
        const double depth = density.depthAt((k + offset) / planeCount) * kRange;
        planes[k] = uint32_t(std::min(std::ceil(depth), kRange - 1));
    }
}

double Planes::along(Key a, Key b) const {
    return (double(depthOf(b)) - double(depthOf(a))) / depthSteps;
}

bool Planes::isBefore(Key a, Key b) const {
    const bool isNearer = a < b;
    const uint64_t gap = isNearer ? b - a : a - b;
    if (depthOf(gap) > zoneSteps) return isNearer;
    if (depthOrder.belongBackwards(sideOf(a), sideOf(b), along(a, b))) return false;
    return isNearer || depthOrder.belongBackwards(sideOf(b), sideOf(a), along(b, a));
}

void Planes::keepFirst(Key& first, Key fragment) const {
    if (first == kNone || isBefore(fragment, first)) first = fragment;
}

void Planes::keepLast(Key& last, Key fragment) const {
    if (last == kNone || isBefore(last, fragment)) last = fragment;
}

// Computes the pairs of all planes at once: a plane's buffers follow from those of the previous
// plane and the fragments between the two.
void Planes::sweep(Runs& runs) {
    const size_t slabCount = planeCount + 1;
    slabs.assign(rasteriser.pixelCount() * slabCount, Slab{kNone, kNone});
    forEachFragment([&](uint32_t pixel, Key fragment) {
        size_t slab = 0;
        for (uint32_t plane : planes) slab += depthOf(fragment) >= plane;
        Slab& s = slabs[pixel * slabCount + slab];
        if (s.first == kNone) {
            s = {fragment, fragment};
        } else {
            keepFirst(s.first, fragment);
            keepLast(s.last, fragment);
        }
    });
    for (size_t pixel = 0; pixel < rasteriser.pixelCount(); ++pixel) {
        const Slab* const ofPixel = slabs.data() + pixel * slabCount;
        Key below = kNone;
        uint32_t from = 0;  // first plane above `below`
        for (uint32_t k = 0; k < slabCount; ++k) {
            if (ofPixel[k].first == kNone) continue;
            if (k > from) addPair(uint32_t(pixel), from, k - from, below, ofPixel[k].first, runs);
            below = ofPixel[k].last;
            from = k;
        }
        if (below == kNone) continue;
        runs.countLine();
        if (planeCount > from)
            addPair(uint32_t(pixel), from, planeCount - from, below, kNone, runs);
    }
}

// Computes the same pairs as sweep(), with separate depth buffers for each plane.
void Planes::projectOneByOne(Runs& runs) {
    buffers.assign(rasteriser.pixelCount() * planeCount, Buffers{kNone, kNone});
    for (uint32_t k = 0; k < planeCount; ++k)
        forEachFragment([&](uint32_t pixel, Key fragment) {
            Buffers& b = buffers[pixel * planeCount + k];
            if (depthOf(fragment) < planes[k])
                keepLast(b.below, fragment);
            else
                keepFirst(b.above, fragment);
        });
    for (size_t pixel = 0; pixel < rasteriser.pixelCount(); ++pixel) {
        const Buffers* const ofPixel = buffers.data() + pixel * planeCount;
        if (ofPixel[0].below == kNone && ofPixel[0].above == kNone) continue;
        runs.countLine();
        uint32_t from = 0;
        for (uint32_t k = 1; k <= planeCount; ++k) {
            const Buffers& b = ofPixel[from];
            if (k < planeCount && ofPixel[k].below == b.below && ofPixel[k].above == b.above)
                continue;
            addPair(uint32_t(pixel), from, k - from, b.below, b.above, runs);
            from = k;
        }
    }
}

void Planes::addPair(uint32_t pixel, uint32_t firstPlane, uint32_t crossings, Key below, Key above,
                     Runs& runs) const {
    const double low = below == kNone ? 0 : density.below(depthOf(below) / kRange);
    const double high = above == kNone ? 1 : density.below(depthOf(above) / kRange);
    const double lines = crossings / std::max(kLeastCrossings, planeCount * (high - low));
    if (below == kNone) {
        runs.add(pixel, firstPlane, sideOf(above), kSky, lines);
    } else if (above == kNone) {
        runs.add(pixel, firstPlane, opposite(sideOf(below)), kSky, lines);
    } else if (!depthOrder.touches(sideOf(below), sideOf(above), along(below, above))) {
        // The far side of the nearer surface sees the near side of the farther one.
        runs.add(pixel, firstPlane, opposite(sideOf(below)), sideOf(above), lines);
    }
}

}  // namespace raybundle
