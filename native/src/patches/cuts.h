// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which tiles of an uncut subdivision are to be cut into smaller patches (cutTiles() in
// patches/patches.h), and why.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace raybundle {

// The levels of tiles that are to be cut, and the number of tiles by reason.
struct Cuts {
    // Per tile, how many times its edges are to be halved. Empty without cuts.
    std::vector<uint8_t> levels;
    size_t contacts = 0;     // tiles cut beside a gap narrower than the tile
    size_t shadowEdges = 0;  // tiles cut at the edge of a shadow
    size_t bentLight = 0;    // tiles cut because the light in them is not linear

    size_t count() const { return contacts + shadowEdges + bentLight; }
    // Returns the number of patches that the cuts add.
    size_t morePatches() const {
        size_t more = 0;
        for (uint8_t level : levels) more += (size_t(1) << (2 * level)) - 1;
        return more;
    }
    // Joins other cuts with these. Each tile gets the higher of both levels; the numbers of tiles
    // are added.
    void add(const Cuts& other) {
        levels.resize(std::max(levels.size(), other.levels.size()), 0);
        for (size_t tile = 0; tile < other.levels.size(); ++tile)
            levels[tile] = std::max(levels[tile], other.levels[tile]);
        contacts += other.contacts;
        shadowEdges += other.shadowEdges;
        bentLight += other.bentLight;
    }
};

}  // namespace raybundle
