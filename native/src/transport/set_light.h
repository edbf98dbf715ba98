// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "direct_light/direct_light.h"
#include "first_shot/first_shot.h"
#include "patches/tiles.h"
#include "scene/scene.h"
#include "transport/transport.h"

namespace raybundle {

// The light of one light set during a bake. Light is linear: the light of each set is transported
// separately along the same lines, and the light of all sources is the sum over the sets.
struct SetLight {
    // The index of the light set, or kNoLightSet for light that belongs to no set.
    int32_t set = kNoLightSet;
    // The light of the sources at receivers.
    DirectLight direct;
    FirstShot shot;
    glm::vec3 worldRadiance{0.0f};  // W/(m^2 sr)
    Irradiance irradiance;

    // Returns whether there is no light: no emission, no light of the sources, and no world.
    bool isDark() const;
};

// The lights of a bake. The first one contains all light that belongs to no set; those of the sets
// follow in the order of the scene.
using SetLights = std::vector<SetLight>;

// Returns the mean irradiance over each side of the tiles, W/m^2. `light` is per patch side.
// `weight` is per patch side, and weights the patch sides in the mean. Only `direct`, `gathered`
// and `indirect` of the result are set.
Irradiance meanOver(const Tiles& tiles, const Irradiance& light, const std::vector<float>& weight);

// Returns the sum of the irradiance of all light sets. `lights` must not be empty.
Irradiance sumOf(const SetLights& lights);

}  // namespace raybundle
