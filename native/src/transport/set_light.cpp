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

Irradiance meanOver(const Tiles& tiles, const Irradiance& light, const std::vector<float>& weight) {
    Irradiance result;
    result.direct = tiles.mean(light.direct, weight);
    result.ofSources = tiles.mean(light.ofSources, weight);
    result.indirect = tiles.mean(light.indirect, weight);
    return result;
}

Irradiance sumOf(const SetLights& lights) {
    Irradiance sum = lights.front().irradiance;
    for (size_t k = 1; k < lights.size(); ++k) sum.add(lights[k].irradiance);
    return sum;
}

}  // namespace raybundle
