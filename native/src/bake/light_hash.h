// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "bake/settings.h"
#include "scene/scene.h"
#include "transport/direct_light.h"

namespace raybundle {

// A hash of all that the first shot GATHER of a light set depends on, on patches and surfaces that
// stay as they are: lights, emission, the world and the settings of the first shot. Equal hashes
// are taken to mean equal light (64 bits).
uint64_t lightHash(const Scene& scene, const DirectLight& light, int32_t lightSet,
                   const Settings& settings);

}  // namespace raybundle
