// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "patches/patches.h"
#include "patches/placement.h"
#include "scene/scene.h"

namespace raybundle {

// Cuts the faces of all instances into cells and these into parents, with grids of patches that are
// not numbered yet; says what is left out. patches: with the vertices and islands of `placed`;
// patchSize: edge of a patch, metres; 0: the automatic ones.
void cutFaces(const Scene& scene, const Placement& placed, float patchSize, Patches& patches);

}  // namespace raybundle
