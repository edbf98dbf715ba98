// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "patches/patches.h"
#include "patches/side.h"

namespace raybundle {

// The patches, and how much of each side light can reach. Both must outlive the object.
struct LitSurfaces {
    const Patches& patches;
    const std::vector<float>& exposed;  // per side: the share that no other surface covers, 0 to 1

    // Returns the area of a side that receives and sends light, m^2.
    double exposedArea(size_t side) const {
        return double(patches.area[patchOf(side)]) * double(exposed[side]);
    }
};

}  // namespace raybundle
