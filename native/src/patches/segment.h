// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <glm/glm.hpp>

namespace raybundle {

// Returns how far along the straight line between two points its nearest point to `point` is: 0 at
// `from`, 1 at `to`.
inline double nearestShare(const glm::dvec3& point, const glm::dvec3& from, const glm::dvec3& to) {
    const glm::dvec3 along = to - from;
    const double square = glm::dot(along, along);
    return square > 0 ? std::clamp(glm::dot(point - from, along) / square, 0.0, 1.0) : 0;
}

// Returns the distance of a point from the straight line between two points.
inline double distanceToSegment(const glm::dvec3& point, const glm::dvec3& from,
                                const glm::dvec3& to) {
    return glm::distance(point, glm::mix(from, to, nearestShare(point, from, to)));
}

}  // namespace raybundle
