// SPDX-License-Identifier: GPL-3.0-or-later
//
// Cuts cells, or the pieces that walls leave of them, into parents. A parallelogram becomes one
// parent. Other polygons are split into triangles, and long thin triangles into several parts. Each
// parent gets a grid of patches.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <utility>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// Returns whether four corners, in order around, form a parallelogram with an area.
bool isParallelogram(const std::vector<glm::dvec3>& corners);
// Returns whether the area of a triangle is only rounding error, and so also that of the
// parallelogram of which it is half.
bool isFlat(const glm::dvec3& p0, const glm::dvec3& p1, const glm::dvec3& p2);

// Adds the parents of cells to Patches::parents, with their grids but without patch indices.
class ParentCutting {
  public:
    // Adds vertices and parents to `patches`. Keeps a reference to it.
    explicit ParentCutting(Patches& patches) : patches(patches) {}

    // Add the parents of a cell, or of a piece of a cell. `vertices` holds the corners in order
    // around, as indices in Patches::vertices; `size` is the edge length of a patch, m.
    void addParallelogram(uint32_t cell, const std::vector<uint32_t>& vertices, double size);
    void addPolygon(uint32_t cell, const std::vector<uint32_t>& vertices, double size);

  private:
    using Triangle = std::array<uint32_t, 3>;  // indices in Patches::vertices

    Parent makeParent(uint32_t cell, const std::array<uint32_t, 3>& corners) const;
    void cutTriangle(uint32_t cell, const Triangle& v, double size);
    void cutNeedle(uint32_t cell, const Triangle& v, double size);
    void cutStrip(uint32_t cell, const std::array<uint32_t, 2>& bottom,
                  const std::array<uint32_t, 2>& top, double size);
    void addTriangle(uint32_t cell, const Triangle& v, double edge, double longest, double size);
    // Returns the vertex in the middle of an edge, which is created at the first call.
    uint32_t middleVertex(uint32_t v0, uint32_t v1);

    Patches& patches;
    // By the two vertices of an edge: the vertex in its middle.
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
};

}  // namespace raybundle
