// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "patches/patches.h"

namespace raybundle {

// A ray from a point on a patch side to a point of a light source. Positions are in metres relative
// to Patches::centre.
struct ShadowRay {
    glm::vec3 point;
    glm::vec3 direction;          // unit vector towards the light
    float distance;               // metres; may be infinite
    uint32_t target = kNoParent;  // parent on which the ray ends, which does not block it
    // How far the point of the light source lies beyond `distance`, metres. On this part of the ray
    // only a solid that stands on the target blocks it.
    float margin = 0;
};

}  // namespace raybundle
