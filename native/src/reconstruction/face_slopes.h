// SPDX-License-Identifier: GPL-3.0-or-later
//
// Direct light over a face that has one patch and shares no value with others, as those of a flatly
// shaded dense mesh: the patch tells its mean, and nothing tells its slope. What the sources would
// give at the corners without occluders does, without a shadow ray.
//
// Where a part of the light is blocked the slope is that share of it.
#pragma once

#include "patches/patches.h"
#include "reconstruction/instance_side.h"
#include "reconstruction/node_light.h"
#include "reconstruction/shown_light.h"
#include "transport/set_light.h"

namespace raybundle {

// Adds what light differs there from its mean to the nodes of an instance: to the direct
// irradiance, and times the colour to the exitance.
void addFaceSlopes(const Patches& patches, const InstanceSide& surface, const ShownLight& shown,
                   const SetLight& light, float targetError, NodeLight& nodes);

}  // namespace raybundle
