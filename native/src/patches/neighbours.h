// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// A pair of tiles with a common edge. Tiles are counted over all parents (Parent::firstTile).
struct TilePair {
    uint32_t first = 0, second = 0;
};

// Returns the pairs of tiles of parents [firstParent, lastParent) that meet at an edge, each pair
// once. The tiles are neighbours in the grid of one parent, or lie on a common edge of two parents
// of one instance. The grids of these parents must agree along the edge, and the angle between
// their planes must be small, so that light continues smoothly.
std::vector<TilePair> neighbouringTiles(const Patches& patches, uint32_t firstParent,
                                        uint32_t lastParent);

}  // namespace raybundle
