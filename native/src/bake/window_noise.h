// SPDX-License-Identifier: GPL-3.0-or-later
//
// The lines' noise on the patches of each window apart (bundles/line_windows.h): their area is
// nothing beside that of a vast scene, in whose noise theirs would not show. And that on the first
// island (patches/patch_size.h), which is not to be noisier beside something bright far away.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "patches/patches.h"
#include "transport/transport.h"

namespace raybundle {

// The relative noise in the windows of an island, by half the difference of two halves: of all of
// them together, or the quadratic mean over their sides of their window's, whichever is larger; of
// the island where that is most. Not the worst window: a few strips of a bevel beside a lamp are not
// what a bake waits for. If there are several islands, that on the first one too.
// windowOf: see LineDensity. halves: of each light set, which are added up. weight: per side, of
// what is wanted.
double windowNoise(const Patches& patches, const std::vector<int32_t>& windowOf,
                   const std::vector<std::array<Irradiance, 2>>& halves,
                   const std::vector<float>& weight);

}  // namespace raybundle
