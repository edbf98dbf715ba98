// SPDX-License-Identifier: GPL-3.0-or-later
//
// Crossings: where a wall passes through a face or stands on it, the light on one side of the wall
// is independent of the light on the other. A patch on both sides would let light through the wall,
// because it would receive on one side and send on the other. Faces are therefore cut along the
// lines of crossing, and values are not joined across edges on which walls stand. Walls narrower
// than a patch, such as the legs of a chair, cut nothing.
//
// Source: discontinuity meshing, here of the discontinuities of the light itself (order 0 in
// Heckbert, "Discontinuity Meshing for Radiosity", 1992), by a binary partition of the face.
// Differs: a line cuts a whole piece of the face, but only if the wall runs along about a patch of
// it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "patches/cut_cell.h"
#include "patches/patches.h"

namespace raybundle {

// Per cell and corner: its index in Patches::vertices after welding. The fourth corner of a
// triangle is undefined.
using CellVertices = std::vector<std::array<uint32_t, 4>>;

// The result of findCrossings().
struct Crossings {
    // By cell, for cells with pieces or parted edges.
    std::map<uint32_t, Crossing> ofCell;
    bool isAll = true;  // false if some cells exceeded the limits and are not cut
};

// Finds the cells that walls pass through or stand on. `sizes` holds, per cell, the edge length of
// its patches, m (cells may be smaller). Large cells are examined first, relative to their patches.
// Once the tests exceed their limit for all cells, or the pieces a quarter of the number of cells,
// the rest of the cells stays whole.
Crossings findCrossings(const std::vector<Cell>& cells, const std::vector<double>& sizes,
                        const CellVertices& vertices);

}  // namespace raybundle
