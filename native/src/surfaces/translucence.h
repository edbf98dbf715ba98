// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light that passes diffusely through patches: the side it leaves sends it into all directions, as
// if it had reflected it.
//
// Source: Cycles' Translucent BSDF; the thesis has opaque surfaces only.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// What leaves the exposed part of a side, exitance, W/m^2. arriving: the irradiance of the exposed
// part of the patch's other side; exposed: per side, the share of it that nothing covers.
inline glm::vec3 passedOn(const Patches& patches, const std::vector<float>& exposed, size_t side,
                          const glm::vec3& arriving) {
    if (!patches.parentAt(uint32_t(side)).exchanges) return glm::vec3(0.0f);
    return exposed[side ^ 1] * patches.translucenceOf(side) * arriving;
}

}  // namespace raybundle
