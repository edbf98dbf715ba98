// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// Two tiles with a common edge, by their numbers over all parents (Parent::firstTile).
struct TilePair {
    uint32_t first = 0, second = 0;
};

// The tiles of parents [firstParent, lastParent) that meet at an edge, each pair once: within the
// grid of a parent, and across an edge of two parents of one instance whose grids agree there and
// whose planes turn by little, so that light goes on smoothly.
std::vector<TilePair> neighbouringTiles(const Patches& patches, uint32_t firstParent,
                                        uint32_t lastParent);

}  // namespace raybundle
