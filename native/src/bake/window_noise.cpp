// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/window_noise.h"

#include <algorithm>
#include <cmath>

namespace raybundle {
namespace {
// A window darker than this share of the scene may have the noise of one that bright.
constexpr double kDarkShare = 0.25;
}  // namespace

double windowNoise(const Patches& patches, const std::vector<int32_t>& windowOf,
                   const std::vector<std::array<Irradiance, 2>>& halves,
                   const std::vector<float>& weight) {
    struct Sums {
        double noise = 0, signal = 0, weight = 0, sides = 0;
    };
    if (windowOf.empty()) return 0;
    std::vector<Sums> windows;
    Sums all;
    for (size_t side = 0; side < weight.size(); ++side) {
        if (!(weight[side] > 0)) continue;
        glm::dvec3 a(0.0), b(0.0);
        for (const std::array<Irradiance, 2>& half : halves) {
            a += glm::dvec3(half[0].direct[side] + half[0].indirect[side]);
            b += glm::dvec3(half[1].direct[side] + half[1].indirect[side]);
        }
        const double w = double(weight[side]), signal = w * glm::dot(a + b, a + b);
        all.signal += signal;
        all.weight += w;
        const int32_t window = windowOf[patches.parentOf[side / 2]];
        if (window < 0) continue;
        windows.resize(std::max(windows.size(), size_t(window) + 1));
        Sums& sums = windows[size_t(window)];
        sums.noise += w * glm::dot(a - b, a - b);
        sums.signal += signal;
        sums.weight += w;
        ++sums.sides;
    }
    Sums inWindows;
    double squares = 0;
    for (const Sums& sums : windows) {
        const double least = kDarkShare * kDarkShare * all.signal / all.weight * sums.weight;
        if (sums.sides == 0 || !(std::max(sums.signal, least) > 0)) continue;
        squares += sums.sides * sums.noise / std::max(sums.signal, least);
        inWindows.sides += sums.sides;
        inWindows.noise += sums.noise;
        inWindows.signal += sums.signal;
    }
    if (!(inWindows.signal > 0)) return 0;
    return std::sqrt(std::max(inWindows.noise / inWindows.signal, squares / inWindows.sides));
}

}  // namespace raybundle
