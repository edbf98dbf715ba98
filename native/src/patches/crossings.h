// SPDX-License-Identifier: GPL-3.0-or-later
//
// Crossings: where a wall goes through a face or stands on it, the light on one side has nothing to
// do with that on the other. A patch that has both would let it through: it receives on one side
// and sends on the other. So faces are cut along such lines, and values are not joined across edges
// on which walls stand. What is narrower than a patch (the legs of a chair) cuts nothing.
//
// Source: discontinuity meshing, here of the discontinuities of the light itself (order 0 in
// Heckbert, "Discontinuity Meshing for Radiosity", 1992), by a binary partition of the face.
// Differs: a line cuts a whole piece of the face, and only where it runs along about a patch of it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "patches/cut_cell.h"
#include "patches/patches.h"

namespace raybundle {

// Per cell and corner: the common vertex that it is. The fourth of a triangle means nothing.
using CellVertices = std::vector<std::array<uint32_t, 4>>;

struct Crossings {
    std::map<uint32_t, Crossing> ofCell;  // of the cells that have any
    bool isAll = true;                    // whether all that cross were found and cut
};

// sizes: per cell, edge of a patch where the cell is no smaller, metres. Large cells come first:
// what exceeds some tests a cell, or a quarter more patches than there are cells, stays whole.
Crossings findCrossings(const std::vector<Cell>& cells, const std::vector<double>& sizes,
                        const CellVertices& vertices);

}  // namespace raybundle
