// SPDX-License-Identifier: GPL-3.0-or-later
#include "stated_error/gathered_noise.h"

#include "job/cancellation.h"
#include "patches/parts.h"

namespace raybundle {
namespace {

// Share of the noise common to the patches of a part that remains in the light of a corner. A
// corner gathers from many parts, which absorb some of this noise. Fitted: with this share, the
// stated noise of the room `subdivided` of lamp_noise.py is 0.93 and 1.30 times its true noise, at
// the targets 0.02 and 0.005.
constexpr float kShare = 0.3f;

}  // namespace

GatheredNoise::GatheredNoise(const Patches& patches, const ShownLight& shown) {
    std::vector<uint32_t> gathered;
    for (uint32_t side = 0; side < patches.sideCount(); ++side) {
        throwIfCancelledAt(side);
        if (shown.isGathered(side)) gathered.push_back(side);
    }
    const Parts parts = partsOf(patches, gathered, false);
    for (size_t k = 0; k < gathered.size(); ++k) sides.push_back({gathered[k], parts.of[k]});
    partCount = parts.count;
}

void GatheredNoise::apply(LightOfHalves& halves, const std::vector<float>& weight) const {
    std::vector<glm::vec3>&a = halves[0], &b = halves[1];
    std::vector<glm::dvec3> difference(partCount, glm::dvec3(0.0));
    std::vector<double> weights(partCount, 0.0);
    for (const auto& [side, part] : sides) {
        const double w = double(weight[side]);
        if (!(w > 0)) continue;
        difference[part] += w * glm::dvec3(a[side] - b[side]);
        weights[part] += w;
    }
    parallelFor(size_t(0), sides.size(), [&](size_t k) {
        const auto& [side, part] = sides[k];
        if (!(weights[part] > 0)) return;
        const glm::vec3 mean = 0.5f * (a[side] + b[side]);
        const glm::vec3 half = 0.5f * kShare * glm::vec3(difference[part] / weights[part]);
        a[side] = mean + half;
        b[side] = mean - half;
    });
}

std::vector<std::vector<float>> GatheredNoise::errorsOf(const SetLights& lights,
                                                        const Tiles& tiles) const {
    std::vector<std::vector<float>> result;
    for (const SetLight& light : lights) {
        std::vector<float> error = light.shot.error;
        for (const Side& one : sides) error[one.side] = 0;
        result.push_back(tiles.errorOfMean(error));
    }
    return result;
}

}  // namespace raybundle
