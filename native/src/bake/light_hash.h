// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "bake/settings.h"
#include "transport/direct_light.h"

namespace raybundle {

// Of the settings that decide how many samples GATHER takes, and of which.
uint64_t shotHash(const Settings& settings);

// A hash of all that the first shot GATHER of a light set depends on, on patches that stay as they
// are: lights, emission, the image of the world and the settings of the first shot. Equal hashes
// are taken to mean equal light (64 bits).
uint64_t lightHash(const DirectLight& light, const Settings& settings);

}  // namespace raybundle
