// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/first_shot.h"

#include <cmath>

namespace raybundle {

FirstShot gatherFirstShot(const DirectLight& light, const Patches& patches, float targetError,
                          const Progress& progress) {
    const size_t n = patches.sideCount();
    FirstShot shot;
    shot.emission = light.bundledEmission();
    shot.irradiance.resize(n);
    shot.error.resize(n);
    const std::vector<Gathered> results = light.gather(
        n,
        [&](size_t side) {
            return Receiver{uint32_t(side), patches.normal(uint32_t(side)), std::nullopt,
                            uint32_t(side)};
        },
        targetError, [&](double done) { progress.report(RB_STAGE_FIRST_SHOT, done); });
    for (size_t side = 0; side < n; ++side) {
        shot.irradiance[side] = results[side].irradiance;
        shot.emitted += double(patches.area[side / 2]) * glm::dvec3(results[side].unpowered);
        shot.error[side] = std::sqrt(results[side].variance);
        shot.rays += results[side].rays;
        shot.unblockedSides += results[side].unblocked;
        shot.hiddenSides += results[side].hidden;
    }
    for (const auto& source : light.lightSources()) shot.emitted += glm::dvec3(source->power());
    shot.escaped = light.escapedPower();
    progress.report(RB_STAGE_FIRST_SHOT, 1);
    return shot;
}

}  // namespace raybundle
