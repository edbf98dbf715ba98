// SPDX-License-Identifier: GPL-3.0-or-later
//
// Parts of the baked objects, small enough for the light and its noise to be about uniform on each.
#pragma once

#include <cstdint>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// The result of partsOf().
struct Parts {
    std::vector<uint32_t> of;  // per side in the argument `sides`: its part
    // The number of parts.
    size_t count = 0;
};

// Divides sides into parts. A part belongs to one object, faces one way within 45 degrees, and is
// an eighth as wide as a square of the object's area. With `bySurface`, it also belongs to one
// connected surface.
Parts partsOf(const Patches& patches, const std::vector<uint32_t>& sides, bool bySurface);

}  // namespace raybundle
