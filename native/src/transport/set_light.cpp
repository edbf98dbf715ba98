// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/set_light.h"

#include <algorithm>

namespace raybundle {
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

}  // namespace raybundle
