// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/fragment_lists.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "patches/side.h"

namespace raybundle {
namespace {

// Number of steps from the nearest to the farthest depth, and the step of the nearest depth. The
// steps before and after serve for rounding.
constexpr double kDepthSteps = 4294967040.0, kFirstStep = 64;
// A double of about this size has a spacing of 1, and the digits of its integer part are in its low
// half.
constexpr double kIntegers = 0x1p52;

uint32_t sideOf(uint64_t key) { return uint32_t(key); }
uint32_t depthOf(uint64_t key) { return uint32_t(key >> 32); }

void sort(uint64_t* first, uint64_t* last) {
    if (last - first > 16) return std::sort(first, last);
    for (uint64_t* a = first + 1; a < last; ++a) {
        const uint64_t key = *a;
        uint64_t* b = a;
        for (; b > first && b[-1] > key; --b) *b = b[-1];
        *b = key;
    }
}

// Sorts four consecutive keys without branches, which would be hard to predict.
void sortFour(uint64_t* key) {
    auto order = [](uint64_t& a, uint64_t& b) {
        const uint64_t low = std::min(a, b), high = std::max(a, b);
        a = low;
        b = high;
    };
    uint64_t a = key[0], b = key[1], c = key[2], d = key[3];
    order(a, b);
    order(c, d);
    order(a, c);
    order(b, d);
    order(b, c);
    key[0] = a;
    key[1] = b;
    key[2] = c;
    key[3] = d;
}

}  // namespace

FragmentLists::FragmentLists(const Patches& patches, float pixelSize, SmallPatches smallPatches,
                             std::vector<LineWindow> windows)
    : depthOrder(patches),
      hasLeaks(smallPatches == SmallPatches::ROULETTE),
      rasteriser(patches, pixelSize, smallPatches, std::move(windows)) {}

std::unique_ptr<Projector> fragmentLists(const ProjectorInput& input) {
    return std::make_unique<FragmentLists>(input.patches, input.pixelSize, input.smallPatches,
                                           input.windows);
}

void FragmentLists::project(const Bundle& bundle, BundleLines& out) {
    const uint64_t drawnBefore = rasteriser.drawnCount();
    rasteriser.begin(bundle);
    depthOrder.begin(bundle.direction);
    // ROULETTE draws patches by chance per pixel of the whole view, so it cannot be split into
    // regions.
    if (hasLeaks)
        projectView(out);
    else
        for (size_t region = 0; region < rasteriser.regionCount(); ++region) {
            rasteriser.lookAt(region);
            projectView(out);
        }
    for (size_t window = 0; window < rasteriser.windowCount(); ++window)
        if (rasteriser.lookThrough(window)) projectView(out);
    out.drawn += rasteriser.drawnCount() - drawnBefore;
}

void FragmentLists::projectView(BundleLines& out) {
    const size_t pixels = rasteriser.pixelCount();
    counts.assign(pixels, 0);
    if (pixels > pixelRoom) {
        pixelRoom = 0;
        layers.reset();
        layers.reset(new uint64_t[kLayers * pixels]);
        pixelRoom = pixels;
    }
    links.clear();
    const double depthLow = rasteriser.depthLow();
    depthSteps = kDepthSteps /
                 std::max(rasteriser.depthHigh() - depthLow, std::numeric_limits<double>::min());
    depthOffset = kIntegers + kFirstStep - depthLow * depthSteps;
    nearSteps =
        uint32_t(std::min(depthOrder.zone(rasteriser.islandsInView()) * depthSteps, kDepthSteps)) +
        1;
    rasteriser.forEachRun([&](uint32_t pixel, int count, const double* depth,
                              const uint32_t* side) { keepRun(pixel, count, depth, side); });
    pairLists(out);
    if (rasteriser.windowCount() > 0)
        out.densities.push_back(
            {rasteriser.lineWeight(), out.exchanges.size(), out.sky.size(), out.touching.size()});
}

inline void FragmentLists::keepRun(uint32_t pixel, int count, const double* depth,
                                   const uint32_t* side) {
    uint64_t key[Rasteriser::kRun];
    for (int k = 0; k < count; ++k) {
        const double d = depth[k] * depthSteps + depthOffset;
        uint64_t bits;
        std::memcpy(&bits, &d, sizeof bits);
        key[k] = bits << 32 | side[k];
    }
    uint32_t* const ofPixel = counts.data() + pixel;
    uint64_t* const place = layers.get() + pixel;
    for (int k = 0; k < count; ++k) {
        const uint32_t layer = ofPixel[k]++;
        if (layer < kLayers) {
            place[layer * pixelRoom + size_t(k)] = key[k];
        } else {
            chain.resize(counts.size());
            uint32_t& last = chain[pixel + uint32_t(k)];
            links.push_back({key[k], last});
            last = uint32_t(links.size() - 1);
        }
    }
}

void FragmentLists::collect(uint32_t pixel, uint32_t count) {
    keys.resize(std::max<size_t>(count, 4));
    std::fill(keys.begin(), keys.begin() + 4, std::numeric_limits<uint64_t>::max());
    for (uint32_t layer = 0; layer < std::min(count, kLayers); ++layer)
        keys[layer] = layers[layer * pixelRoom + pixel];
    for (uint32_t k = kLayers, link = count > kLayers ? chain[pixel] : 0; k < count; ++k) {
        keys[k] = links[link].key;
        link = links[link].next;
    }
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
        for (uint64_t* b = a;
             b > first && areNear(b[-1], *b) &&
             depthOrder.belongBackwards(sideOf(b[-1]), sideOf(*b), along(b[-1], *b));
             --b)
            std::swap(*b, b[-1]);
}

void FragmentLists::pairLists(BundleLines& out) {
    const size_t pixels = counts.size();
    sky.resize(2 * pixels);
    uint32_t* nextSky = sky.data();
    for (uint32_t p = 0; p < pixels; ++p) {
        const uint32_t count = counts[p];
        if (count == 0) continue;
        if (count == 2) {  // most pixels, where surfaces are closed
            const uint64_t a = layers[p], b = layers[pixelRoom + p];
            const uint64_t nearer = std::min(a, b), farther = std::max(a, b);
            if (!hasLeaks && !areNear(nearer, farther)) {
                *nextSky++ = sideOf(nearer);
                *nextSky++ = opposite(sideOf(farther));
                runs.add(0, opposite(sideOf(nearer)), sideOf(farther));
                continue;
            }
        }
        collect(p, count);
        uint64_t *const first = keys.data(), *const last = first + count;
        if (count <= 4)
            sortFour(first);
        else
            sort(first, last);
        bool anyNear = false;
        for (const uint64_t* k = first; k + 1 < last; ++k) anyNear |= areNear(k[0], k[1]);
        if (anyNear) orderCoinciding(first, last);
        *nextSky++ = sideOf(*first);
        *nextSky++ = opposite(sideOf(last[-1]));
        if (anyNear || hasLeaks)
            pairNear(first, last, out);
        else  // the far side of the nearer surface sees the near side of the farther one
            for (const uint64_t* k = first; k + 1 < last; ++k)
                runs.add(size_t(k - first), opposite(sideOf(k[0])), sideOf(k[1]));
    }
    out.lines += size_t(nextSky - sky.data()) / 2;
    out.sky.insert(out.sky.end(), sky.data(), nextSky);
    runs.moveTo(out.exchanges);
}

void FragmentLists::pairNear(const uint64_t* first, const uint64_t* last, BundleLines& out) {
    for (const uint64_t* k = first; k + 1 < last; ++k) {
        const uint32_t i = opposite(sideOf(k[0])), j = sideOf(k[1]);
        if (areNear(k[0], k[1]) && depthOrder.touches(opposite(i), j, along(k[0], k[1]))) {
            out.touching.push_back(i);
            out.touching.push_back(j);
        } else {
            runs.add(size_t(k - first), i, j);
            if (hasLeaks && depthOrder.passesIntoSolid(i, j)) ++out.disordered;
        }
    }
}

}  // namespace raybundle
