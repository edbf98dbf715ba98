// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sheets: congruent neighbouring parallelograms of one plane that are projected as one. A wall of a
// mesh that was made for vertex colours has thousands of faces of a few pixels each; as a sheet, it
// is one parallelogram. The members of a sheet are parents, or parallelograms that walls have cut
// into several parents (patches/crossings.h). A member is uneven if it consists of several parents
// or of tiles that are cut. On an uneven member, the patch at a point is found by a search.
//
// Differs from the thesis (section 4.2), which projects each patch by itself: as a parent
// represents its patches, a sheet represents its parents. Its outline consists of the edges of
// these parents, so that it fits adjacent surfaces exactly, without rounding.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

struct Patches;

// A parallelogram that consists of smaller ones without gaps: point = origin + s * a + t * b, with
// s and t in [0, 1].
struct Sheet {
    glm::vec3 origin, a, b;          // m, relative to Patches::centre
    uint32_t island = 0;             // index in Patches::islands
    uint32_t columns = 0, rows = 0;  // of the grid of patches, along a and b
    // Row by row, the index of a patch. Values from kUneven on stand for uneven members: kUneven
    // plus the number of the member within the sheet.
    std::vector<uint32_t> patches;
    // The edges in order around, by indices in Patches::vertices.
    std::vector<std::array<uint32_t, 2>> outline;

    // A view of the grid of patches, for inner loops. The sheet must outlive it.
    struct Grid {
        const uint32_t* patches;
        int columns, rows;

        // Returns the entry of `patches` at (s, t), which is clamped to the sheet.
        uint32_t patchAt(float s, float t) const {
            const int column = std::min(std::max(int(s * float(columns)), 0), columns - 1);
            const int row = std::min(std::max(int(t * float(rows)), 0), rows - 1);
            return patches[row * columns + column];
        }
    };
    Grid grid() const { return {patches.data(), int(columns), int(rows)}; }

    // A parent of an uneven member. The affine coordinates of the parent are origin + s * a + t * b
    // at the point (s, t) of the sheet.
    struct Part {
        uint32_t parent;  // index in Patches::parents
        glm::vec2 origin, a, b;
    };
    // Least value of an entry of `patches` that stands for an uneven member.
    static constexpr uint32_t kUneven = 1u << 30;
    std::vector<Part> parts;  // of all uneven members, one after the other
    // Per uneven member, the index of its first part; one more entry at the end.
    std::vector<uint32_t> firstPart;
    // Returns the patch at the point (s, t) of the sheet, on an uneven member. `uneven` is the
    // entry of `patches` there, and `all` the patches from which the sheet was made.
    uint32_t patchIn(uint32_t uneven, const Patches& all, float s, float t) const;
};

// All parents that exchange light, joined into sheets where possible.
struct Sheets {
    std::vector<Sheet> sheets;
    std::vector<uint32_t> loose;  // parents that exchange light and are in no sheet
    size_t joined = 0;            // number of parents in sheets
};

// Joins parents into sheets. The indices of patches must be set.
Sheets findSheets(const Patches& patches);

// Returns the parents without any sheet.
Sheets withoutSheets(const Patches& patches);

}  // namespace raybundle
