// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light that passes through patches diffusely: it leaves the other side in all directions, as if
// that side had reflected it.
//
// Source: Cycles' Translucent BSDF.
// Differs from the thesis, which has opaque surfaces only.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/lit_surfaces.h"
#include "patches/side.h"

namespace raybundle {

// Returns the exitance of translucent light on the exposed part of a side, W/m^2. `arriving` is the
// irradiance of the exposed part of the patch's other side, W/m^2. Returns 0 if the side takes no
// part in the exchange of light.
inline glm::vec3 passedOn(const LitSurfaces& surfaces, size_t side, const glm::vec3& arriving) {
    if (!surfaces.patches.parentAt(uint32_t(side)).exchanges) return glm::vec3(0.0f);
    return surfaces.exposed[opposite(side)] * surfaces.patches.translucenceOf(side) * arriving;
}

}  // namespace raybundle
