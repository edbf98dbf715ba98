// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/window_noise.h"

#include <algorithm>
#include <cmath>

namespace raybundle {

double worstWindowNoise(const Patches& patches, const std::vector<int32_t>& windowOf,
                        const std::vector<std::array<Irradiance, 2>>& halves,
                        const std::vector<float>& weight) {
    if (windowOf.empty()) return 0;
    std::vector<double> noise, signal;  // per window
    for (size_t side = 0; side < weight.size(); ++side) {
        const int32_t window = windowOf[patches.parentOf[side / 2]];
        if (window < 0 || !(weight[side] > 0)) continue;
        noise.resize(std::max(noise.size(), size_t(window) + 1));
        signal.resize(noise.size());
        glm::dvec3 a(0.0), b(0.0);
        for (const std::array<Irradiance, 2>& half : halves) {
            a += glm::dvec3(half[0].direct[side] + half[0].indirect[side]);
            b += glm::dvec3(half[1].direct[side] + half[1].indirect[side]);
        }
        noise[size_t(window)] += double(weight[side]) * glm::dot(a - b, a - b);
        signal[size_t(window)] += double(weight[side]) * glm::dot(a + b, a + b);
    }
    double worst = 0;
    for (size_t k = 0; k < noise.size(); ++k)
        if (signal[k] > 0) worst = std::max(worst, std::sqrt(noise[k] / signal[k]));
    return worst;
}

}  // namespace raybundle
