// SPDX-License-Identifier: GPL-3.0-or-later
//
// The lines' noise on the patches of each window apart (bundles/line_windows.h): their area is
// nothing beside that of a vast scene, in whose noise theirs would not show.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "patches/patches.h"
#include "transport/transport.h"

namespace raybundle {

// Largest relative noise of any window, by half the difference of two halves. windowOf: see
// LineDensity. halves: of each light set, which are added up. weight: per side, of what is wanted.
double worstWindowNoise(const Patches& patches, const std::vector<int32_t>& windowOf,
                        const std::vector<std::array<Irradiance, 2>>& halves,
                        const std::vector<float>& weight);

}  // namespace raybundle
