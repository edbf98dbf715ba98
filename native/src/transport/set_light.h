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

// The light of one light set on its way through a bake. Light is linear: all sets go along the same
// lines, each by itself, and the light of all is their sum.
struct SetLight {
    int32_t set = kNoLightSet;
    DirectLight direct;
    FirstShot shot;
    glm::vec3 worldRadiance{0.0f};  // W/(m^2 sr)
    Irradiance irradiance;

    // Whether there is nothing for bundles to carry.
    bool isDark() const;
};

// What belongs to no set comes first in a list of lights, then each set in the scene's order.
using SetLights = std::vector<SetLight>;

// Of light per patch side: the mean over each side of the tiles, by weight, per patch side.
Irradiance meanOver(const Tiles& tiles, const Irradiance& light, const std::vector<float>& weight);

// Irradiance by all of them.
Irradiance sumOf(const SetLights& lights);

}  // namespace raybundle
