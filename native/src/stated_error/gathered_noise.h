// SPDX-License-Identifier: GPL-3.0-or-later
//
// The noise of bundles where corners gather their light from what they see, and do not show that of
// the patches beneath them (reconstruction/corner_gather.h): a share of that of the patches around.
// What differs from patch to patch evens out among the many that a corner sees, so that what they
// have in common by parts of the object counts.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "patches/patches.h"
#include "patches/tiles.h"
#include "reconstruction/shown_light.h"
#include "transport/set_light.h"

namespace raybundle {

class GatheredNoise {
  public:
    GatheredNoise(const Patches& patches, const ShownLight& shown);

    // Brings two estimates of the light on sides so near to each other as what corners gather is.
    // weight: per side, of what is wanted.
    void apply(std::array<Irradiance, 2>& halves, const std::vector<float>& weight) const;

    // The standard error of the first shot of each light, in W/m^2 per side of the tiles, without
    // that of gathered sides: corners have their own.
    std::vector<std::vector<float>> errorsOf(const SetLights& lights, const Tiles& tiles) const;

  private:
    struct Side {
        uint32_t side, part;
    };
    std::vector<Side> sides;  // that are gathered
    size_t partCount = 0;
};

}  // namespace raybundle
