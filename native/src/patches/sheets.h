// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sheets: congruent neighbouring parallelograms of one plane, which are projected as one. A wall of
// a mesh made for vertex colours has thousands of faces of a few pixels each; as a sheet it is one.
// The parallelograms are parents, or what walls have cut into several parents
// (patches/crossings.h): where these, or tiles that are cut, make it uneven, the patch at a point
// is looked up.
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

// A parallelogram of others without gaps. point = origin + s * a + t * b, s and t in [0, 1].
struct Sheet {
    glm::vec3 origin, a, b;          // metres, relative to Patches::centre
    uint32_t island = 0;             // into Patches::islands
    uint32_t columns = 0, rows = 0;  // of its patches, along a and b
    // Row by row. From kUneven on: an uneven parallelogram, by its number.
    std::vector<uint32_t> patches;
    std::vector<std::array<uint32_t, 2>> outline;  // edges in order around, into Patches::vertices

    // The patches alone.
    struct Grid {
        const uint32_t* patches;
        int columns, rows;

        // What `patches` has at (s, t); clamps to the sheet.
        uint32_t patchAt(float s, float t) const {
            const int column = std::min(std::max(int(s * float(columns)), 0), columns - 1);
            const int row = std::min(std::max(int(t * float(rows)), 0), rows - 1);
            return patches[row * columns + column];
        }
    };
    Grid grid() const { return {patches.data(), int(columns), int(rows)}; }

    // A parent of an uneven parallelogram, whose affine coordinates are origin + s * a + t * b.
    struct Part {
        uint32_t parent;  // into Patches::parents
        glm::vec2 origin, a, b;
    };
    static constexpr uint32_t kUneven = 1u << 30;
    std::vector<Part> parts;          // of all uneven parallelograms, one after the other
    std::vector<uint32_t> firstPart;  // of each; one more at the end
    // The patch at (s, t) in an uneven parallelogram, by what `patches` has there.
    uint32_t patchIn(uint32_t uneven, const Patches& all, float s, float t) const;
};

struct Sheets {
    std::vector<Sheet> sheets;
    std::vector<uint32_t> loose;  // the parents that exchange light and are in no sheet
    size_t joined = 0;            // parents that are in a sheet
};

// Of parents whose patches are numbered.
Sheets findSheets(const Patches& patches);

// Each parent by itself.
Sheets withoutSheets(const Patches& patches);

}  // namespace raybundle
