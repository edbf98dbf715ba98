// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "patches/patches.h"
#include "scene/scene.h"

namespace raybundle {

// Two cells that meet at an edge inside a smooth region.
struct SmoothEdge {
    std::array<uint32_t, 2> cell;   // into Patches::cells
    std::array<int32_t, 4> corner;  // of the mesh: both ends of the edge in cell 0, then in cell 1
};

// The corners of one instance that share a value, as Blender shades them: corners of one vertex
// belong together where the faces around the vertex join smoothly. Nothing is joined across sharp
// edges, material borders, mesh borders, edges on which walls stand, and edges with more than two
// faces or with faces that turn differently.
struct SmoothRegions {
    std::vector<uint32_t> nodeOf;  // per corner of the mesh: its value's index
    uint32_t nodeCount = 0;
    std::vector<SmoothEdge> edges;
};

// cells[first .. last) are those of the instance.
SmoothRegions smoothRegions(const Mesh& mesh, const std::vector<Cell>& cells, uint32_t first,
                            uint32_t last);

}  // namespace raybundle
