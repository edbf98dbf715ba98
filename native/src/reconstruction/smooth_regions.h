// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "patches/patches.h"
#include "scene/scene.h"

namespace raybundle {

// Two cells of one smooth region that meet at an edge.
struct SmoothEdge {
    std::array<uint32_t, 2> cell;  // indices in Patches::cells
    // Corners of the mesh: the two ends of the edge in the first cell, then the same ends in the
    // second.
    std::array<int32_t, 4> corner;
};

// The corners of one instance that share a value, as Blender shades them. The shared value is a
// node. Corners at one vertex share a value if the faces around the vertex join smoothly. Corners
// are not joined across sharp edges, borders between materials, borders of the mesh, edges on which
// walls stand, edges with more than two faces, and edges whose two faces wind differently.
struct SmoothRegions {
    std::vector<uint32_t> nodeOf;  // per corner of the mesh: index of its node
    uint32_t nodeCount = 0;
    // Edges across which light is smooth at both ends.
    std::vector<SmoothEdge> edges;
};

// Returns the smooth regions of an instance of `mesh`. The cells of the instance are the entries
// [first, last) of `cells`.
SmoothRegions smoothRegions(const Mesh& mesh, const std::vector<Cell>& cells, uint32_t first,
                            uint32_t last);

}  // namespace raybundle
