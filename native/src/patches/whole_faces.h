// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "patches/patches.h"
#include "scene/scene.h"

namespace raybundle {

// Returns the number of triangles that a mesh is divided into.
inline size_t triangleCount(const Mesh& mesh) { return mesh.cornerCount() - 2 * mesh.faceCount(); }

// Returns one patch per triangle of the meshes, in the order of instances and faces, in some tens
// of nanoseconds each. This suffices to sample the light of sources, but not to exchange light:
// other than those of subdivide(), the patches have no size to keep to, and faces are not welded,
// joined to surfaces and islands, cut where they cross, or left out where they are doubled or have
// no area. A patch, its parent and its cell have the same index. Returns no patches if there are
// none, if there are more than kMostPatches, or if an object is further than kFarthest.
Patches wholeFaces(const Scene& scene);

}  // namespace raybundle
