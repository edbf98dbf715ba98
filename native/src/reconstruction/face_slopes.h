// SPDX-License-Identifier: GPL-3.0-or-later
//
// Slopes of the direct light over faces that have only one patch and share no value with other
// faces. A dense mesh with flat shading has such faces. The patch provides the mean of the light on
// the face, but not its slope. The slope is taken from the irradiance that the sources would give
// at the corners without occluders, which needs no shadow rays.
//
// If occluders block a part of the light, the slope is reduced to the share of the light that
// arrives.
#pragma once

#include "patches/patches.h"
#include "reconstruction/instance_side.h"
#include "reconstruction/node_light.h"
#include "reconstruction/shown_light.h"
#include "transport/set_light.h"

namespace raybundle {

// The light whose slopes are added, and per side its irradiance by sources, W/m^2. References must
// outlive the object.
struct LightOfSources {
    const SetLight& light;
    const std::vector<glm::vec3>& arriving;
};

// Adds to each node of a face that has only one patch and shares no node with other faces the
// difference between the direct light at the node and its mean over the face. The difference is
// added to the direct irradiance, and multiplied by the shown reflectance (ShownLight::color) to
// the exitance. `targetError` is relative; sources whose light changes by less than a quarter of it
// over the patch get no slope. Nodes for which `isKept` (per node; empty: none) is true keep their
// light. `nodes` is per node of `surface.regions`, W/m^2.
void addFaceSlopes(const Patches& patches, const InstanceSide& surface, const ShownLight& shown,
                   const LightOfSources& sources, float targetError,
                   const std::vector<bool>& isKept, NodeLight& nodes);

}  // namespace raybundle
