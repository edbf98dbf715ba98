// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

// Splits a simple polygon (convex or concave, roughly planar, at least 3 points) into points.size()
// - 2 triangles by ear clipping (Meisters, "Polygons Have Ears", 1975). Triangles hold indices into
// points and keep its winding. Where no ear is left (self-intersecting input) the rest is cut as a
// fan.
std::vector<std::array<int, 3>> triangulate(const std::vector<glm::dvec3>& points);

// Area times unit normal of a polygon (Newell's formula), m^2.
glm::dvec3 vectorArea(const std::vector<glm::dvec3>& points);

}  // namespace raybundle
