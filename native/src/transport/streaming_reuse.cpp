// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/streaming_reuse.h"

#include <algorithm>

#include "patches/side.h"
#include "surfaces/translucence.h"

namespace raybundle {
namespace {

// Largest reflectance for which the steps are chosen. Longer steps would forget too much of the
// light before.
constexpr float kMostReflectance = 0.95f;

}  // namespace

StreamingReuse::StreamingReuse(const LitSurfaces& surfaces, const StreamingStart& start,
                               const std::vector<glm::vec3>& source,
                               const std::vector<glm::vec3>& emission,
                               const glm::vec3& worldExitance)
    : surfaces(surfaces),
      emission(emission),
      worldExitance(worldExitance),
      source(source),
      bundles(start.bundles),
      totalWeight(start.bundles),
      directSum(start.lines.size()),
      indirectSum(start.lines.size()),
      lines(start.lines.begin(), start.lines.end()),
      weight(lines),
      exitance(start.lines.size()),
      isMet(start.lines.size(), false),
      arriving(start.lines.size(), glm::dvec3(0.0)) {
    const std::vector<glm::vec3>&direct = start.direct, &indirect = start.indirect;
    float reflectance = 0;
    for (size_t i = 0; i < lines.size(); ++i) {
        const glm::vec3& rho = surfaces.patches.reflectance[i];
        reflectance = std::max({reflectance, rho.x, rho.y, rho.z});
        directSum[i] = lines[i] * glm::dvec3(direct[i]);
        indirectSum[i] = lines[i] * glm::dvec3(indirect[i]);
        exitance[i] = source[i] + rho * (direct[i] + indirect[i]) +
                      passedOn(surfaces, i, direct[opposite(i)] + indirect[opposite(i)]);
    }
    steps = 1 / (1 - double(std::min(reflectance, kMostReflectance)));
}

void StreamingReuse::meet(uint32_t side, double lineCount) {
    if (!isMet[side]) {
        isMet[side] = true;
        met.push_back(side);
    }
    lines[side] += lineCount;
}

void StreamingReuse::updateExitance(size_t side) {
    const size_t other = opposite(side);
    exitance[side] = source[side] +
                     surfaces.patches.reflectance[side] * (direct(side) + indirect(side)) +
                     passedOn(surfaces, side, direct(other) + indirect(other));
}

void StreamingReuse::add(const BundleLines& bundle) {
    const double newest = totalWeight * steps / bundles;  // g_n
    totalWeight += newest;
    ++bundles;
    auto send = [&](uint32_t from, uint32_t to, double lineCount) {
        meet(to, lineCount);
        weight[to] += newest * lineCount;
        directSum[to] += lineCount * glm::dvec3(emission[from]);
        arriving[to] += lineCount * glm::dvec3(exitance[from]);
    };
    bundle.forEachExchange([&](const Exchange& x, double density) {
        send(x.i, x.j, x.lines * density);
        send(x.j, x.i, x.lines * density);
    });
    bundle.forEachSky([&](uint32_t side, double density) {
        meet(side, density);
        weight[side] += newest * density;
        directSum[side] += density * worldExitance;
    });
    for (uint32_t side : met) {
        indirectSum[side] += newest * arriving[side];
        updateExitance(side);
        if (!surfaces.patches.translucence.empty()) updateExitance(opposite(side));
        arriving[side] = glm::dvec3(0.0);
        isMet[side] = false;
    }
    met.clear();
}

}  // namespace raybundle
