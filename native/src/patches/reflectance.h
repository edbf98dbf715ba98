// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "patches/patches.h"
#include "scene/scene.h"

namespace raybundle {

// Gives every side of every patch its reflectance and emission. Images and corner colours are
// averaged over the area of the patch: a lookup at one point would alias.
void assignMaterials(const Scene& scene, Patches& patches);

}  // namespace raybundle
