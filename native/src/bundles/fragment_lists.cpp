// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/fragment_lists.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "bundles/run_lengths.h"

namespace raybundle {
namespace {

// Depth 1 in the integer steps of a key.
constexpr double kDepthSteps = 4294967040.0;

uint32_t sideOf(uint64_t key) { return uint32_t(key); }
uint32_t depthOf(uint64_t key) { return uint32_t(key >> 32); }

}  // namespace

FragmentLists::FragmentLists(const Patches& patches, float pixelSize, float touchDistance,
                             SmallPatches smallPatches, std::vector<LineWindow> windows)
    : contacts(patches, touchDistance),
      hasLeaks(smallPatches == SmallPatches::ROULETTE),
      rasteriser(patches, pixelSize, smallPatches, std::move(windows)) {}

std::unique_ptr<Projector> fragmentLists(const ProjectorInput& input) {
    return std::make_unique<FragmentLists>(input.patches, input.pixelSize, input.touchDistance,
                                           input.smallPatches, input.windows);
}

void FragmentLists::project(const Bundle& bundle, BundleLines& out) {
    rasteriser.begin(bundle);
    contacts.begin(bundle.direction);
    projectView(out);
    for (size_t window = 0; window < rasteriser.windowCount(); ++window)
        if (rasteriser.lookThrough(window)) projectView(out);
}

void FragmentLists::projectView(BundleLines& out) {
    fragments.clear();
    begin.assign(rasteriser.pixelCount() + 1, 0);
    const double depthLow = rasteriser.depthLow();
    depthSteps = kDepthSteps /
                 std::max(rasteriser.depthHigh() - depthLow, std::numeric_limits<double>::min());
    nearSteps = int64_t(std::min(contacts.zone() * depthSteps, kDepthSteps)) + 1;
    rasteriser.forEachFragment([&](uint32_t pixel, double depth, uint32_t side) {
        fragments.emplace_back(pixel, uint32_t((depth - depthLow) * depthSteps), side);
        ++begin[pixel + 1];
    });
    sortIntoLists();
    pairLists(out);
    if (rasteriser.windowCount() > 0)
        out.densities.push_back(
            {rasteriser.lineWeight(), out.exchanges.size(), out.sky.size(), out.touching.size()});
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

double FragmentLists::along(uint64_t a, uint64_t b) const {
    return (double(depthOf(b)) - double(depthOf(a))) / depthSteps;
}

bool FragmentLists::areNear(uint64_t a, uint64_t b) const {
    return std::abs(int64_t(depthOf(b)) - int64_t(depthOf(a))) <= nearSteps;
}

void FragmentLists::orderCoinciding(uint64_t* first, uint64_t* last) const {
    for (uint64_t* a = first + 1; a < last; ++a)
        for (uint64_t* b = a; b > first && areNear(b[-1], *b) &&
                              contacts.belongBackwards(sideOf(b[-1]), sideOf(*b), along(b[-1], *b));
             --b)
            std::swap(*b, b[-1]);
}

void FragmentLists::pairLists(BundleLines& out) {
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
            if (areNear(keys[k], keys[k + 1]) &&
                contacts.touches(i ^ 1, j, along(keys[k], keys[k + 1]))) {
                out.touching.push_back(i);
                out.touching.push_back(j);
            } else {
                runs.add(k - first, i, j);
                if (hasLeaks && contacts.passesIntoSolid(i, j)) ++out.disordered;
            }
        }
        out.sky.push_back(sideOf(keys[last - 1]) ^ 1);
    }
    runs.flush();
}

}  // namespace raybundle
