// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "raybundle/raybundle.h"
#include "reconstruction/corner_weights.h"
#include "reconstruction/smooth_regions.h"

namespace raybundle {

// The side of an instance's faces on which light is reconstructed. References must outlive the
// object.
struct InstanceSide {
    const InstanceRange& range;    // cells and parents of the instance
    const SmoothRegions& regions;  // which of its corners share a value: the nodes
    rb_side side;
};

}  // namespace raybundle
