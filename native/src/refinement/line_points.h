// SPDX-License-Identifier: GPL-3.0-or-later
//
// Lines on faces as rows of points, and the polygons with few corners that stand for them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

// A point at which a line crosses an edge of a triangle.
struct LinePoint {
    glm::dvec3 at;    // m
    double edge;      // length of the edge, m
    double accuracy;  // m
    glm::dvec3 soft;  // part of the edge over which the light changes, m
};

// The points of a line on a face, in order.
struct PointLine {
    int32_t face;  // of the source
    std::vector<LinePoint> points{};
    std::array<bool, 2> isOpen{};    // per end: whether the line ends within the face
    std::array<uint32_t, 2> edge{};  // per end: the index of the edge that the line crosses there
    double jump = 0;                 // largest difference of the light across the line, W/m^2

    const LinePoint& end(bool isLast) const { return isLast ? points.back() : points.front(); }
    // Returns the direction in which the line arrives at an end; no unit vector.
    glm::dvec3 outwards(bool isLast) const;
    double length() const;    // m
    double meanEdge() const;  // m
    // Returns the mean width over which the light changes across the line, m.
    double width() const;
};

// Joins open ends that are close to each other, beginning with the closest, unless they arrive
// there beside each other.
std::vector<PointLine> joinEnds(const std::vector<PointLine>& lines);

// Returns the corners of a polygon for a line, m. Its long sides are the straight lines nearest to
// their points, and meet where no other side lies between them but a short one that cuts the corner
// off. Corners that then lie on a straight line, or at which the line turns back, are left out.
std::vector<glm::dvec3> cornersOf(const PointLine& line);

}  // namespace raybundle
