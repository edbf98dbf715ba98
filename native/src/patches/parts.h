// SPDX-License-Identifier: GPL-3.0-or-later
//
// Parts of what is baked, small enough that each is lit, and noisy, much the same all over.
#pragma once

#include <cstdint>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

struct Parts {
    std::vector<uint32_t> of;  // per side that was given
    size_t count = 0;
};

// Each part is of one object, faces one way within 45 degrees, and is an eighth as wide as a square
// of the object's area; bySurface: and hangs together with itself.
Parts partsOf(const Patches& patches, const std::vector<uint32_t>& sides, bool bySurface);

}  // namespace raybundle
