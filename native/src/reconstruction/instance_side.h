// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "raybundle/raybundle.h"
#include "reconstruction/corner_weights.h"
#include "reconstruction/smooth_regions.h"

namespace raybundle {

// One side of an instance's faces, whose light is reconstructed. References must outlive it.
struct InstanceSide {
    const InstanceRange& range;    // its cells and parents
    const SmoothRegions& regions;  // which of its corners share a value: the nodes
    rb_side side;
};

}  // namespace raybundle
