// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/set_light.h"

#include <algorithm>
#include <cmath>

namespace raybundle {
namespace {

// Sums over sides of squared noise and squared light.
struct Sums {
    double noise = 0, signal = 0;

    // a, b: the estimates of the halves; variance: of each channel of both.
    void add(double weight, const glm::dvec3& a, const glm::dvec3& b, double variance) {
        noise += weight * (0.25 * glm::dot(a - b, a - b) + 3 * variance);
        signal += weight * 0.25 * glm::dot(a + b, a + b);
    }
    double relative(double bias) const {
        return signal > 0 ? std::sqrt(noise / signal + bias * bias) : 0;
    }
};

}  // namespace

bool SetLight::isDark() const {
    auto isBlack = [](const glm::vec3& v) { return v == glm::vec3(0.0f); };
    return isBlack(worldRadiance) &&
           std::all_of(shot.emission.begin(), shot.emission.end(), isBlack) &&
           std::all_of(shot.irradiance.begin(), shot.irradiance.end(), isBlack);
}

Irradiance sumOf(const SetLights& lights) {
    Irradiance sum = lights.front().irradiance;
    for (size_t k = 1; k < lights.size(); ++k) {
        const Irradiance& light = lights[k].irradiance;
        for (size_t side = 0; side < sum.direct.size(); ++side) {
            sum.direct[side] += light.direct[side];
            sum.gathered[side] += light.gathered[side];
            sum.indirect[side] += light.indirect[side];
        }
    }
    return sum;
}

std::vector<double> relativeNoise(const SetLights& lights,
                                  const std::vector<std::array<Irradiance, 2>>& halves,
                                  const std::vector<float>& weight, double bias) {
    std::vector<Sums> sums(lights.size());
    for (size_t side = 0; side < weight.size(); ++side) {
        glm::dvec3 allA(0.0), allB(0.0);
        double allVariance = 0;
        for (size_t k = 0; k < lights.size(); ++k) {
            const Irradiance &first = halves[k][0], &second = halves[k][1];
            const glm::dvec3 a(first.direct[side] + first.indirect[side]);
            const glm::dvec3 b(second.direct[side] + second.indirect[side]);
            const double variance =
                double(lights[k].shot.error[side]) * double(lights[k].shot.error[side]);
            if (lights[k].set != kNoLightSet) sums[k].add(double(weight[side]), a, b, variance);
            allA += a;
            allB += b;
            allVariance += variance;
        }
        sums[0].add(double(weight[side]), allA, allB, allVariance);
    }
    std::vector<double> noise;
    for (const Sums& s : sums) noise.push_back(s.relative(bias));
    return noise;
}

}  // namespace raybundle
