// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

// Splits a polygon into points.size() - 2 triangles by ear clipping. The polygon has at least 3
// points, is simple, convex or concave, and roughly planar. Each triangle holds three indices into
// `points`, in the winding of the polygon. If no ear is left, because the polygon intersects
// itself, the rest is cut as a fan.
//
// Source: Meisters, "Polygons Have Ears" (1975).
std::vector<std::array<int, 3>> triangulate(const std::vector<glm::dvec3>& points);

// Returns the area of a polygon times its unit normal, in the square of the unit of the points.
// Source: Newell's formula.
glm::dvec3 vectorArea(const std::vector<glm::dvec3>& points);

}  // namespace raybundle
