// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/window_noise.h"

#include <algorithm>
#include <cmath>

#include "bake/cancellation.h"

namespace raybundle {
namespace {
// A window darker than this share of its island, and of the first one, may have the noise of one that
// bright.
constexpr double kDarkShare = 0.25;

struct Sums {
    double noise = 0, signal = 0, weight = 0, sides = 0;

    void add(const Sums& other) {
        noise += other.noise;
        signal += other.signal;
        weight += other.weight;
        sides += other.sides;
    }
    double meanSignal() const { return weight > 0 ? signal / weight : 0; }
};

}  // namespace

double windowNoise(const Patches& patches, const std::vector<int32_t>& windowOf,
                   const std::vector<std::array<Irradiance, 2>>& halves,
                   const std::vector<float>& weight) {
    const size_t islandCount = patches.islands.size();
    if (windowOf.empty() && islandCount < 2) return 0;
    std::vector<Sums> windows, islands(islandCount);
    std::vector<uint32_t> islandOf;  // per window
    for (size_t side = 0; side < weight.size(); ++side) {
        throwIfCancelledAt(side);
        if (!(weight[side] > 0)) continue;
        glm::dvec3 a(0.0), b(0.0);
        for (const std::array<Irradiance, 2>& half : halves) {
            a += glm::dvec3(half[0].direct[side] + half[0].indirect[side]);
            b += glm::dvec3(half[1].direct[side] + half[1].indirect[side]);
        }
        const double w = double(weight[side]);
        const Sums own{w * glm::dot(a - b, a - b), w * glm::dot(a + b, a + b), w, 1};
        const uint32_t parent = patches.parentOf[side / 2], island = patches.parents[parent].island;
        islands[island].add(own);
        const int32_t window = windowOf.empty() ? -1 : windowOf[parent];
        if (window < 0) continue;
        const size_t count = std::max(windows.size(), size_t(window) + 1);
        windows.resize(count);
        islandOf.resize(count, 0);
        windows[size_t(window)].add(own);
        islandOf[size_t(window)] = island;
    }
    std::vector<Sums> inWindows(islandCount);  // per island
    std::vector<double> squares(islandCount, 0);
    for (size_t k = 0; k < windows.size(); ++k) {
        const Sums& sums = windows[k];
        const double usual =
            std::max(islands[islandOf[k]].meanSignal(), islands.front().meanSignal());
        const double least = kDarkShare * kDarkShare * usual * sums.weight;
        if (sums.sides == 0 || !(std::max(sums.signal, least) > 0)) continue;
        squares[islandOf[k]] += sums.sides * sums.noise / std::max(sums.signal, least);
        inWindows[islandOf[k]].add(sums);
    }
    double most = 0;
    for (size_t k = 0; k < islandCount; ++k) {
        const Sums& sums = inWindows[k];
        const double dark = kDarkShare * kDarkShare * islands.front().meanSignal() * sums.weight;
        if (sums.signal > 0)
            most = std::max({most, sums.noise / std::max(sums.signal, k == 0 ? 0 : dark),
                             squares[k] / sums.sides});
    }
    if (islandCount > 1 && islands.front().signal > 0)
        most = std::max(most, islands.front().noise / islands.front().signal);
    return std::sqrt(most);
}

}  // namespace raybundle
