// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/noise.h"

#include <algorithm>
#include <cmath>

namespace raybundle {
namespace {

// At the first look the noise is stated so much above what the halves say; less with each look.
constexpr double kSmallSample = 0.15;
// Where the first shot has nearly all the noise of the target, or more, bundles may have this share
// of it: less of theirs would cost many and hardly be seen in the sum.
constexpr double kLeastOfBundles = 0.6;
// Weight of the looks before.
constexpr double kMemory = 0.5;

}  // namespace

Noise::Noise(const Looks& before, const std::vector<float>& weight,
             const std::vector<float>& directError)
    : weight(weight), directError(directError), looked(before.count), before(before) {}

void Noise::look(const std::array<Irradiance, 2>& half, uint32_t count, double sharedBias) {
    const size_t n = weight.size();
    difference.resize(n);
    double squares = 0, direct = 0;
    signal = 0;
    for (size_t side = 0; side < n; ++side) {
        const glm::dvec3 a(half[0].direct[side] + half[0].indirect[side]);
        const glm::dvec3 b(half[1].direct[side] + half[1].indirect[side]);
        const double square = 0.25 * glm::dot(a - b, a - b);
        difference[side] = glm::vec3(0.5 * (a - b));
        squares += double(weight[side]) * square;
        direct += double(weight[side]) * 3 * double(directError[side]) * directError[side];
        signal += double(weight[side]) * 0.25 * glm::dot(a + b, a + b);
    }
    bias = sharedBias;
    bundleNoise = signal > 0 ? squares / signal : 0;
    directNoise = signal > 0 ? direct / signal : 0;
    if (bundles == 0 && count == before.bundles) {
        // An earlier bake has seen the same lines.
        pooled = before.share * bundleNoise;
    } else {
        // What the looks before foretell for this one.
        const double foretold =
            bundles > 0 ? pooled * std::pow(double(bundles) / count, 2 * kNoiseSlope) : bundleNoise;
        pooled = kMemory * foretold + (1 - kMemory) * bundleNoise;
        ++looked;
    }
    bundles = count;
}

double Noise::factor() const { return 1 + kSmallSample / (double(looked) * looked); }

double Noise::relative() const {
    return signal > 0 ? std::hypot(ofBundles(), std::sqrt(directNoise)) : 0;
}

double Noise::ofBundles() const {
    return signal > 0 ? std::hypot(factor() * std::sqrt(pooled), bias) : 0;
}

double Noise::excess(double target) const {
    const double left = std::max(target * target - directNoise,
                                 kLeastOfBundles * kLeastOfBundles * target * target);
    return ofBundles() / std::sqrt(left);
}

Looks Noise::looks() const { return {looked, bundles, bundleNoise > 0 ? pooled / bundleNoise : 1}; }

std::vector<glm::vec3> Noise::perSide() const {
    const float scale = bundleNoise > 0 ? float(factor() * std::sqrt(pooled / bundleNoise)) : 0.0f;
    std::vector<glm::vec3> result = difference;
    for (glm::vec3& d : result) d *= scale;
    return result;
}

SetNoise::SetNoise(const Looks& before, std::vector<std::vector<float>> errors,
                   const std::vector<float>& weight)
    : errorOfSets(std::move(errors)), directError(weight.size()) {
    for (size_t side = 0; side < directError.size(); ++side) {
        double variance = 0;
        for (const std::vector<float>& error : errorOfSets)
            variance += double(error[side]) * double(error[side]);
        directError[side] = float(std::sqrt(variance));
    }
    noises.emplace_back(before, weight, directError);
    for (size_t k = 1; k < errorOfSets.size(); ++k)
        noises.emplace_back(before, weight, errorOfSets[k]);
}

void SetNoise::look(const std::vector<std::array<Irradiance, 2>>& halves, uint32_t bundles,
                    double bias) {
    std::array<Irradiance, 2> all = halves.front();
    for (size_t k = 1; k < halves.size(); ++k) {
        noises[k].look(halves[k], bundles, bias);
        for (size_t h = 0; h < 2; ++h)
            for (size_t side = 0; side < directError.size(); ++side) {
                all[h].direct[side] += halves[k][h].direct[side];
                all[h].indirect[side] += halves[k][h].indirect[side];
            }
    }
    noises.front().look(all, bundles, bias);
}

std::vector<double> SetNoise::relative() const {
    std::vector<double> result;
    for (const Noise& noise : noises) result.push_back(noise.relative());
    return result;
}

double SetNoise::excess(double target) const {
    double most = 0;
    for (const Noise& noise : noises) most = std::max(most, noise.excess(target));
    return most;
}

SideNoise SetNoise::perSide() const {
    SideNoise result(0);
    result.ofBundles = noises.front().perSide();
    result.direct = directError;
    return result;
}

}  // namespace raybundle
