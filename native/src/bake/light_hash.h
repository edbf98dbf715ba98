// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "direct_light/direct_light.h"
#include "job/settings.h"

namespace raybundle {

// Of what decides how many samples GATHER takes, and of which, and what it keeps of them, but for
// the lights. isShown: per side; hasDirections: whether it keeps where light comes from.
uint64_t shotHash(const Scene& scene, const Settings& settings, const std::vector<bool>& isShown,
                  bool hasDirections);

// A hash of all that the first shot GATHER of a light set depends on, on patches that stay as they
// are: lights, emission, the image of the world and its shotHash. Equal hashes are taken to mean
// equal light (64 bits).
uint64_t lightHash(const DirectLight& light, uint64_t aims);

}  // namespace raybundle
