// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "patches/patches.h"

namespace raybundle {

// A way to a light from a point on a side of a patch, relative to Patches::centre.
struct ShadowRay {
    glm::vec3 point;
    glm::vec3 direction;          // unit
    float distance;               // metres; may be infinite
    uint32_t target = kNoParent;  // the parent that it ends on, which does not block it
};

}  // namespace raybundle
