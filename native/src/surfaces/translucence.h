// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light that passes diffusely through patches: the side it leaves sends it into all directions, as
// if it had reflected it.
//
// Source: Cycles' Translucent BSDF; the thesis has opaque surfaces only.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/lit_surfaces.h"

namespace raybundle {

// The exitance of the exposed part of a side by light that passes through its patch, W/m^2.
// arriving: the irradiance of the exposed part of the patch's other side, W/m^2.
inline glm::vec3 passedOn(const LitSurfaces& surfaces, size_t side, const glm::vec3& arriving) {
    if (!surfaces.patches.parentAt(uint32_t(side)).exchanges) return glm::vec3(0.0f);
    return surfaces.exposed[side ^ 1] * surfaces.patches.translucenceOf(side) * arriving;
}

}  // namespace raybundle
