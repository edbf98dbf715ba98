// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sheets: congruent neighbouring parents of one plane, which are projected as one. A wall of a mesh
// made for vertex colours has thousands of faces of a few pixels each; as a sheet it is one.
//
// Differs from the thesis (section 4.2), which projects each patch by itself: as a parent stands
// for its patches, a sheet stands for its parents. Its outline is made of the edges of these, so
// that it fits what lies beside it to the last bit.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

struct Patches;

// A parallelogram of parents without gaps. point = origin + s * a + t * b, s and t in [0, 1].
struct Sheet {
    glm::vec3 origin, a, b;                        // metres, relative to Patches::centre
    uint32_t columns = 0, rows = 0;                // of its patches, along a and b
    std::vector<uint32_t> patches;                 // row by row
    std::vector<std::array<uint32_t, 2>> outline;  // edges in order around, into Patches::vertices

    // The patches alone.
    struct Grid {
        const uint32_t* patches;
        int columns, rows;

        // The patch at (s, t); clamps to the sheet.
        uint32_t patchAt(float s, float t) const {
            const int column = std::min(std::max(int(s * float(columns)), 0), columns - 1);
            const int row = std::min(std::max(int(t * float(rows)), 0), rows - 1);
            return patches[row * columns + column];
        }
    };
    Grid grid() const { return {patches.data(), int(columns), int(rows)}; }
};

struct Sheets {
    std::vector<Sheet> sheets;
    std::vector<uint32_t> loose;  // the parents that exchange light and are in no sheet
    size_t joined = 0;            // parents that are in a sheet
};

// Of parents whose patches are numbered. Cut ones (patches/refinement.h) are loose.
Sheets findSheets(const Patches& patches);

// Each parent by itself.
Sheets withoutSheets(const Patches& patches);

}  // namespace raybundle
