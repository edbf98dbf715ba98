// SPDX-License-Identifier: GPL-3.0-or-later
//
// Direct light over a face that has one patch and shares no value with others, as those of a flatly
// shaded dense mesh: the patch tells its mean, and nothing tells its slope. What the sources would
// give at the corners without occluders does, without a shadow ray.
//
// Where a part of the light is blocked the slope is that share of it.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/patches.h"
#include "raybundle/raybundle.h"
#include "reconstruction/least_squares.h"
#include "reconstruction/shown_light.h"
#include "reconstruction/smooth_regions.h"
#include "transport/set_light.h"

namespace raybundle {

// Adds what light differs there from its mean to the nodes of an instance: to the direct
// irradiance, and times the colour to the exitance, W/m^2.
void addFaceSlopes(const Patches& patches, const InstanceRange& range, const SmoothRegions& regions,
                   rb_side side, const ShownLight& shown, const SetLight& light, float targetError,
                   std::vector<glm::vec3>& direct, std::vector<glm::vec3>& exitance);

}  // namespace raybundle
