// SPDX-License-Identifier: GPL-3.0-or-later
//
// The noise of bundles at corners that gather their light from the surfaces they see, instead of
// showing the light of their own patches (reconstruction/corner_gather.h). This noise is a share of
// the noise of the surrounding patches. A corner sees many patches, so that noise which differs
// from patch to patch averages out. What remains is the noise that the patches of a part of the
// object have in common.
#pragma once

#include <cstdint>
#include <vector>

#include "patches/patches.h"
#include "patches/tiles.h"
#include "reconstruction/shown_light.h"
#include "stated_error/noise.h"
#include "transport/set_light.h"

namespace raybundle {

// The noise of all sides whose corners gather (ShownLight::isGathered).
class GatheredNoise {
  public:
    // Finds the gathered sides and their parts. The arguments need not outlive the object.
    GatheredNoise(const Patches& patches, const ShownLight& shown);

    // Changes two estimates of the light (per side of the patches, W/m^2) so that on gathered sides
    // their difference is that of the light which corners gather. Their mean is kept. `weight` is
    // per side: the exposed area of sides with a result, otherwise 0, m^2.
    void apply(LightOfHalves& halves, const std::vector<float>& weight) const;

    // Returns for each light, per side of the tiles, the standard error of the first shot, W/m^2.
    // It is 0 on gathered sides, because their corners have errors of their own.
    std::vector<std::vector<float>> errorsOf(const SetLights& lights, const Tiles& tiles) const;

  private:
    // A side of the patches, and the part that it belongs to.
    struct Side {
        uint32_t side, part;
    };
    std::vector<Side> sides;  // gathered sides
    size_t partCount = 0;
};

}  // namespace raybundle
