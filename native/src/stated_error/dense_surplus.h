// SPDX-License-Identifier: GPL-3.0-or-later
//
// The surplus of faces on dense surfaces: the difference between the light on a face and the
// interpolation between its corners, estimated from the light that the corners have gathered
// (reconstruction/node_gather.h). The patches of such faces exchange light in clusters, whose light
// does not show where a shadow ends within the cluster.
//
// Source: as of stated_error/surplus.h, of which this is the part that remains if light is known at
// corners instead of means over patches.
// - Where light is smooth, the gradient on a face is the mean of the gradients on both sides of it.
//   Where the light jumps within a face, the interpolation between its corners is a ramp, and the
//   faces on both sides have no such gradient. What a face has more than those beside it, along its
//   gradient, is taken for a jump at a random place. The mean square difference between a jump of 1
//   and a ramp of equal width is 1/12.
#pragma once

#include <vector>

#include "patches/patches.h"
#include "reconstruction/instance_light.h"

namespace raybundle {

// Returns the surplus of the patches of an instance, in the order of its parents [firstParent,
// lastParent): its mean square, summed over RGB, (W/m^2)^2. `isGathered` is per side whether the
// corners have gathered its light; elsewhere, the surplus is 0. `light` is that of the instance.
// Patches are whole faces. Empty if there are no parents.
std::vector<float> denseSurplus(const Patches& patches, uint32_t firstParent, uint32_t lastParent,
                                rb_side side, const std::vector<bool>& isGathered,
                                const InstanceLight& light);

}  // namespace raybundle
