// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "direct_light/direct_light.h"
#include "job/settings.h"

namespace raybundle {

// Returns a hash of everything except the lights that determines how many samples GATHER takes, at
// which sides, and which results it keeps. `isShown` is per side whether its light is shown
// (ShownLight::sides). `hasDirections` is whether GATHER keeps the directions from which light
// arrives.
uint64_t shotHash(const Scene& scene, const Settings& settings, const std::vector<bool>& isShown,
                  bool hasDirections);

// Returns a hash of everything that the first shot GATHER of a light set depends on if the patches
// are unchanged: lights, emission, the image of the world and `aims`, the result of shotHash().
// First shots with equal hashes are assumed to be equal (64 bits).
uint64_t lightHash(const DirectLight& light, uint64_t aims);

}  // namespace raybundle
