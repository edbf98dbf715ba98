// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which tiles of an uncut subdivision are to be cut into smaller patches (cutTiles in patches.h),
// and why.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace raybundle {

struct Cuts {
    std::vector<uint8_t> levels;  // per tile: how often to halve its edges; empty without cuts
    // Tiles that are cut
    size_t contacts = 0;     // beside a gap narrower than they are,
    size_t shadowEdges = 0;  // for a shadow's edge,
    size_t bentLight = 0;    // and for light that bends within them.

    size_t count() const { return contacts + shadowEdges + bentLight; }
    // Patches that the cuts add to the tiles.
    size_t morePatches() const {
        size_t more = 0;
        for (uint8_t level : levels) more += (size_t(1) << (2 * level)) - 1;
        return more;
    }
    // Cuts each tile as often as the one or the other does.
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
