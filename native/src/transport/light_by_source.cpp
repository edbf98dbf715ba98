// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/light_by_source.h"

#include <numeric>

namespace raybundle {
namespace {

constexpr size_t kMostParts = size_t(1) << 21;  // 40 MB
// A source whose share of the light becomes so many times what it was would have got more samples.
constexpr double kMostGrowth = 2;

}  // namespace

LightBySource::LightBySource(const std::vector<std::unique_ptr<LightSource>>& sources,
                             size_t receivers) {
    if (sources.empty() || receivers > kMostParts / sources.size()) return;
    for (const auto& source : sources) {
        shapes.push_back(source->shape);
        magnitudes.push_back(source->magnitude);
    }
    parts.resize(receivers * sources.size());
}

std::optional<std::vector<glm::vec3>> LightBySource::factors(
    const std::vector<std::unique_ptr<LightSource>>& now) const {
    if (!isWhole || now.size() != shapes.size()) return std::nullopt;
    std::vector<glm::vec3> factors;
    for (size_t k = 0; k < shapes.size(); ++k) {
        if (now[k]->shape != shapes[k]) return std::nullopt;
        glm::vec3 factor(0.0f);
        for (int c = 0; c < 3; ++c) {
            if (magnitudes[k][c] > 0)
                factor[c] = now[k]->magnitude[c] / magnitudes[k][c];
            else if (now[k]->magnitude[c] != 0)
                return std::nullopt;
        }
        factors.push_back(factor);
    }

    // Light of the brightest channel, per source.
    std::vector<double> before(factors.size(), 0.0), after(before);
    for (size_t i = 0; i < parts.size(); ++i) {
        const size_t k = i % factors.size();
        before[k] += double(brightest(parts[i].irradiance));
        after[k] += double(brightest(factors[k] * parts[i].irradiance));
    }
    const double allBefore = std::accumulate(before.begin(), before.end(), 0.0);
    const double allAfter = std::accumulate(after.begin(), after.end(), 0.0);
    for (size_t k = 0; k < factors.size(); ++k)
        if (after[k] * allBefore > kMostGrowth * before[k] * allAfter) return std::nullopt;
    return factors;
}

}  // namespace raybundle
