// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/patches.h"
#include "scene/scene.h"

namespace raybundle {

// Whether a material reflects nothing and shines nowhere.
bool isEmptySpace(const Material& material);

// Gives every patch its opacity, averaged likewise, and takes the share that lets light through off
// its area. Once, before assignMaterials; lines depend on it.
void assignOpacity(const Scene& scene, Patches& patches);

// Gives every side of every patch its reflectance, by angle too, and its emission. Images and
// corner colours are averaged over the area of the patch: a lookup at one point would alias.
void assignMaterials(const Scene& scene, Patches& patches);

// Per side: how much of its reflectance is diffuse, of the whole patch, what lets light through
// included.
std::vector<glm::vec3> diffuseReflectances(const Scene& scene, const Patches& patches);

}  // namespace raybundle
