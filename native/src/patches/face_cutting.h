// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "patches/patches.h"
#include "patches/placement.h"
#include "scene/scene.h"

namespace raybundle {

// Cuts the faces of all instances into cells, and the cells into parents with grids of patches,
// whose indices are not set yet. Adds warnings of faces that are left out or not cut. `patches`
// must hold the vertices and islands of `placed`. `patchSize` is the edge length of a patch, m; 0
// takes the automatic sizes of `placed`.
void cutFaces(const Scene& scene, const Placement& placed, float patchSize, Patches& patches);

}  // namespace raybundle
