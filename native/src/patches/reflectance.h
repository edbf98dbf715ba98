// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/patches.h"
#include "scene/scene.h"

namespace raybundle {

// Returns whether a material reflects nothing, emits nothing and is not translucent.
bool isEmptySpace(const Material& material);

// Sets the opacity of every patch, averaged over its area, and multiplies its area by it. Parents
// that are not opaque are no longer solid. Call it once, before assignMaterials(). Lines depend on
// the result.
void assignOpacity(const Scene& scene, Patches& patches);

// Sets the reflectance, its dependence on the angle, the translucence and the emission of every
// side, and the scattering of materials. Images and corner colours are averaged over the area of
// the patch, because a lookup at one point would alias.
void assignMaterials(const Scene& scene, Patches& patches);

// Return for a side, or per side, the diffuse part of its reflectance, relative to the whole patch,
// including the share that its opacity lets through.
glm::vec3 diffuseReflectance(const Scene& scene, const Patches& patches, uint32_t side);
std::vector<glm::vec3> diffuseReflectances(const Scene& scene, const Patches& patches);

}  // namespace raybundle
