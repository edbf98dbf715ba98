// SPDX-License-Identifier: GPL-3.0-or-later
//
// From cells, or what walls leave of them, to parents: parallelograms as they are, other polygons
// as triangles, and of these long thin ones in several parts. Each parent gets a grid of patches.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <utility>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// Whether four corners are those of a parallelogram with an area.
bool isParallelogram(const std::vector<glm::dvec3>& corners);
// Whether a triangle, or the parallelogram that it is half of, has no area but for rounding.
bool isFlat(const glm::dvec3& p0, const glm::dvec3& p1, const glm::dvec3& p2);

class ParentCutting {
  public:
    // Appends to the vertices and parents of `patches`, which must outlive the object.
    explicit ParentCutting(Patches& patches) : patches(patches) {}

    // Adds the parents of a cell, or of a part of it with corners at those vertices, in order
    // around (into Patches::vertices). size: edge of a patch, metres.
    void addParallelogram(uint32_t cell, const std::vector<uint32_t>& vertices, double size);
    void addPolygon(uint32_t cell, const std::vector<uint32_t>& vertices, double size);

  private:
    using Triangle = std::array<uint32_t, 3>;  // into Patches::vertices

    Parent makeParent(uint32_t cell, const std::array<uint32_t, 3>& corners) const;
    void cutTriangle(uint32_t cell, const Triangle& v, double size);
    void cutNeedle(uint32_t cell, const Triangle& v, double size);
    void cutStrip(uint32_t cell, const std::array<uint32_t, 2>& bottom,
                  const std::array<uint32_t, 2>& top, double size);
    void addTriangle(uint32_t cell, const Triangle& v, double edge, double longest, double size);
    uint32_t middleVertex(uint32_t v0, uint32_t v1);

    Patches& patches;
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;  // of edges
};

}  // namespace raybundle
