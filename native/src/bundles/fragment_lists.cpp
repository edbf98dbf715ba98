// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/fragment_lists.h"

#include <algorithm>
#include <limits>

namespace raybundle {
namespace {

// Depth 1 in the integer steps of a key.
constexpr double kDepthSteps = 4294967040.0;
constexpr size_t kFirstFragments = 1024;

uint32_t sideOf(uint64_t key) { return uint32_t(key); }
uint32_t depthOf(uint64_t key) { return uint32_t(key >> 32); }

// Lists are short.
void sort(uint64_t* first, uint64_t* last) {
    if (last - first == 2) {
        const uint64_t a = first[0], b = first[1];
        first[0] = std::min(a, b);
        first[1] = std::max(a, b);
        return;
    }
    if (last - first > 32) return std::sort(first, last);
    for (uint64_t* a = first + 1; a < last; ++a) {
        const uint64_t key = *a;
        uint64_t* b = a;
        for (; b > first && b[-1] > key; --b) *b = b[-1];
        *b = key;
    }
}

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
    begin.assign(rasteriser.pixelCount() + 1, 0);
    const double depthLow = rasteriser.depthLow();
    depthSteps = kDepthSteps /
                 std::max(rasteriser.depthHigh() - depthLow, std::numeric_limits<double>::min());
    nearSteps = uint32_t(std::min(contacts.zone() * depthSteps, kDepthSteps)) + 1;
    Fragment* next = fragments.data();
    const Fragment* end = next + fragments.size();
    rasteriser.forEachFragment(
        [&, steps = depthSteps](uint32_t pixel, double depth, uint32_t side) {
            if (next == end) {
                const size_t count = fragments.size();
                fragments.resize(std::max(kFirstFragments, 2 * count));
                next = fragments.data() + count;
                end = fragments.data() + fragments.size();
            }
            // Part by part: the copy of a temporary waits for its parts to be stored.
            next->pixel = pixel;
            next->depth = uint32_t((depth - depthLow) * steps);
            next->side = side;
            ++next;
            ++begin[pixel + 1];
        });
    fragmentCount = size_t(next - fragments.data());
    scatter();
    pairLists(out);
    if (rasteriser.windowCount() > 0)
        out.densities.push_back(
            {rasteriser.lineWeight(), out.exchanges.size(), out.sky.size(), out.touching.size()});
}

void FragmentLists::scatter() {
    for (size_t p = 1; p < begin.size(); ++p) begin[p] += begin[p - 1];
    keys.resize(fragmentCount);
    // Fill the lists back to front: begin[p + 1] counts down to where list p starts.
    for (const Fragment *f = fragments.data(), *end = f + fragmentCount; f < end; ++f)
        keys[--begin[f->pixel + 1]] = uint64_t(f->depth) << 32 | f->side;
}

double FragmentLists::along(uint64_t a, uint64_t b) const {
    return (double(depthOf(b)) - double(depthOf(a))) / depthSteps;
}

bool FragmentLists::areNear(uint64_t a, uint64_t b) const {
    const uint32_t x = depthOf(a), y = depthOf(b);
    return (x < y ? y - x : x - y) <= nearSteps;
}

void FragmentLists::orderCoinciding(uint64_t* first, uint64_t* last) const {
    for (uint64_t* a = first + 1; a < last; ++a)
        for (uint64_t* b = a; b > first && areNear(b[-1], *b) &&
                              contacts.belongBackwards(sideOf(b[-1]), sideOf(*b), along(b[-1], *b));
             --b)
            std::swap(*b, b[-1]);
}

void FragmentLists::pairLists(BundleLines& out) {
    const size_t pixels = begin.size() - 1;
    sky.resize(2 * pixels);
    uint32_t* nextSky = sky.data();
    uint64_t* first = keys.data();
    for (size_t p = 0; p < pixels; ++p) {
        uint64_t* const last = keys.data() + (p + 1 < pixels ? begin[p + 2] : keys.size());
        if (first == last) continue;
        sort(first, last);
        bool anyNear = false;
        for (const uint64_t* k = first; k + 1 < last; ++k) anyNear |= areNear(k[0], k[1]);
        if (anyNear) orderCoinciding(first, last);
        *nextSky++ = sideOf(*first);
        *nextSky++ = sideOf(last[-1]) ^ 1;
        if (anyNear || hasLeaks)
            pairNear(first, last, out);
        else  // the far side of the nearer surface sees the near side of the farther one
            for (const uint64_t* k = first; k + 1 < last; ++k)
                runs.add(size_t(k - first), sideOf(k[0]) ^ 1, sideOf(k[1]));
        first = last;
    }
    out.lines += size_t(nextSky - sky.data()) / 2;
    out.sky.insert(out.sky.end(), sky.data(), nextSky);
    runs.moveTo(out.exchanges);
}

void FragmentLists::pairNear(const uint64_t* first, const uint64_t* last, BundleLines& out) {
    for (const uint64_t* k = first; k + 1 < last; ++k) {
        const uint32_t i = sideOf(k[0]) ^ 1, j = sideOf(k[1]);
        if (areNear(k[0], k[1]) && contacts.touches(i ^ 1, j, along(k[0], k[1]))) {
            out.touching.push_back(i);
            out.touching.push_back(j);
        } else {
            runs.add(size_t(k - first), i, j);
            if (hasLeaks && contacts.passesIntoSolid(i, j)) ++out.disordered;
        }
    }
}

}  // namespace raybundle
