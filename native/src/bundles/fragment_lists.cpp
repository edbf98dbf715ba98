// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/fragment_lists.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "patches/coincidence.h"

namespace raybundle {
namespace {

// Depth 1 in the integer steps of a key.
constexpr double kDepthSteps = 4294967040.0;
// This share of the touching distance tells coinciding surfaces from merely close ones.
constexpr double kCoincidence = 0.05;

// Cosine below which two normals point against each other.
constexpr float kOpposite = -0.99f;

uint32_t sideOf(uint64_t key) { return uint32_t(key); }
uint32_t depthOf(uint64_t key) { return uint32_t(key >> 32); }

// Collects the exchanges of neighbouring pixels: pixel after pixel the same gap of the list usually
// belongs to the same pair.
class RunLengths {
  public:
    explicit RunLengths(std::vector<Exchange>& out) : out(out) {}

    void add(size_t gap, uint32_t i, uint32_t j) {
        if (i > j) std::swap(i, j);
        if (gap >= runs.size()) runs.resize(gap + 1, Exchange{0, 0, 0});
        Exchange& run = runs[gap];
        if (run.i == i && run.j == j) {
            ++run.lines;
            return;
        }
        if (run.lines) out.push_back(run);
        run = {i, j, 1};
    }

    void flush() {
        for (const Exchange& run : runs)
            if (run.lines) out.push_back(run);
    }

  private:
    std::vector<Exchange>& out;
    std::vector<Exchange> runs;  // the open run of each gap
};

}  // namespace

FragmentLists::FragmentLists(const Patches& patches, float pixelSize, float touchDistance,
                             SmallPatches smallPatches)
    : patches(patches),
      touchDistance(touchDistance),
      rasteriser(patches, pixelSize, smallPatches) {}

std::unique_ptr<Projector> fragmentLists(const ProjectorInput& input) {
    return std::make_unique<FragmentLists>(input.patches, input.pixelSize, input.touchDistance,
                                           input.smallPatches);
}

void FragmentLists::project(const Bundle& bundle, BundleLines& out) {
    rasteriser.begin(bundle);
    fragments.clear();
    begin.assign(rasteriser.pixelCount() + 1, 0);
    const double depthLow = rasteriser.depthLow();
    depthSteps = kDepthSteps /
                 std::max(rasteriser.depthHigh() - depthLow, std::numeric_limits<double>::min());
    rasteriser.forEachFragment([&](uint32_t pixel, double depth, uint32_t side) {
        fragments.push_back({pixel, uint32_t((depth - depthLow) * depthSteps), side});
        ++begin[pixel + 1];
    });
    sortIntoLists();
    pairLists(out);
}

void FragmentLists::sortIntoLists() {
    for (size_t p = 1; p < begin.size(); ++p) begin[p] += begin[p - 1];
    keys.resize(fragments.size());
    // Fill the lists back to front: begin[p + 1] counts down to where list p starts.
    for (const Fragment& f : fragments)
        keys[--begin[f.pixel + 1]] = uint64_t(f.depth) << 32 | f.side;
    // Now begin[p + 1] is the start of list p.
    for (size_t p = 0; p + 1 < begin.size(); ++p) {
        uint64_t* const first = keys.data() + begin[p + 1];
        uint64_t* const last =
            p + 2 < begin.size() ? keys.data() + begin[p + 2] : keys.data() + keys.size();
        if (last - first > 32) {
            std::sort(first, last);
        } else {
            for (uint64_t* a = first + 1; a < last; ++a) {
                const uint64_t key = *a;
                uint64_t* b = a;
                for (; b > first && b[-1] > key; --b) *b = b[-1];
                *b = key;
            }
        }
        orderCoinciding(first, last);
    }
}

double FragmentLists::gapAcross(uint64_t a, uint64_t b) const {
    const double along = (double(depthOf(b)) - double(depthOf(a))) / depthSteps;
    // A grazing line stretches the gap; beyond some stretch it is not worth a look.
    constexpr double kMostStretch = 100;
    if (std::abs(along) > kMostStretch * double(touchDistance)) return std::abs(along);
    return std::abs(along *
                    glm::dot(glm::dvec3(patches.normal(sideOf(a))), rasteriser.direction()));
}

void FragmentLists::orderCoinciding(uint64_t* first, uint64_t* last) const {
    auto isBefore = [&](uint64_t a, uint64_t b) {
        const uint32_t p = patches.parentOf[sideOf(a) / 2], q = patches.parentOf[sideOf(b) / 2];
        return areParallel(patches.parents[p], patches.parents[q]) &&
               comesBefore(patches, p, sideOf(a) % 2 == 0, q, sideOf(b) % 2 == 0);
    };
    const double same = kCoincidence * double(touchDistance);
    for (uint64_t* a = first + 1; a < last; ++a)
        for (uint64_t* b = a; b > first && gapAcross(b[-1], *b) <= same && isBefore(*b, b[-1]); --b)
            std::swap(*b, b[-1]);
}

void FragmentLists::pairLists(BundleLines& out) {
    // Surfaces that meet at an angle are close only at their edge, and see each other.
    auto touches = [&](uint64_t a, uint64_t b) {
        return gapAcross(a, b) <= double(touchDistance) &&
               glm::dot(patches.normal(sideOf(a) ^ 1), patches.normal(sideOf(b))) < kOpposite;
    };
    RunLengths runs(out.exchanges);
    for (size_t p = 0; p + 1 < begin.size(); ++p) {
        const size_t first = begin[p + 1];
        const size_t last = p + 2 < begin.size() ? begin[p + 2] : keys.size();
        if (first == last) continue;
        ++out.lines;
        out.sky.push_back(sideOf(keys[first]));
        for (size_t k = first; k + 1 < last; ++k) {
            // The far side of the nearer surface sees the near side of the farther one.
            const uint32_t i = sideOf(keys[k]) ^ 1, j = sideOf(keys[k + 1]);
            if (touches(keys[k], keys[k + 1])) {
                out.touching.push_back(i);
                out.touching.push_back(j);
            } else {
                runs.add(k - first, i, j);
            }
        }
        out.sky.push_back(sideOf(keys[last - 1]) ^ 1);
    }
    runs.flush();
}

}  // namespace raybundle
