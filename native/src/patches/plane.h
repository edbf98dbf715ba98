// SPDX-License-Identifier: GPL-3.0-or-later
//
// Whether a point lies in front of a plane, in it, or behind it: decided here, for closed forms,
// samples and facing tests alike. Positions are rounded, by the file, by transforms and by the
// floats here; so a plane is as thick as rounding can move what lies in it. A receiver in the plane
// of a source gets nothing from it, whichever side rounding has moved it to: in front of the source
// it would have the light of a whole hemisphere.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>

namespace raybundle {

enum class PlaneSide { BEHIND = -1, WITHIN = 0, FRONT = 1 };

struct Plane {
    glm::dvec3 origin{0.0}, normal{0.0};  // metres, relative to Patches::centre; unit
    double thickness = 0;                 // of each half at the origin, metres
    double slope = 0;                     // it grows by so much with the distance from there

    // Half the thickness over the extent of what lies in the plane: some times the 1e-6 by which
    // the vertices of a mesh may be off that was turned, sheared or joined.
    static constexpr double kOfExtent = 1e-5;
    // The same over the coordinates, and over the distance of a point: their roundings, and that of
    // the normal.
    static constexpr double kOfCoordinates = 4 * double(std::numeric_limits<float>::epsilon());
    // More than this the normal of a sliver is not known at all.
    static constexpr double kMostSlope = 0.01;

    Plane() = default;
    // extent: radius of what lies in the plane, or of the mesh that it is part of, metres; narrowest:
    // half the width of the face whose normal it has, metres, over which vertices that are off tilt it.
    Plane(const glm::dvec3& origin, const glm::dvec3& normal, double extent, double narrowest)
        : origin(origin),
          normal(normal),
          thickness(kOfExtent * extent + kOfCoordinates * mostOf(origin)),
          slope(narrowest > 0 ? std::min(kMostSlope, kOfCoordinates + thickness / narrowest)
                              : kMostSlope) {}

    double height(const glm::dvec3& point) const { return glm::dot(point - origin, normal); }
    PlaneSide side(const glm::dvec3& point) const {
        const double off = halfThickness(point), h = height(point);
        return h > off ? PlaneSide::FRONT : h < -off ? PlaneSide::BEHIND : PlaneSide::WITHIN;
    }
    // At a point, metres.
    double halfThickness(const glm::dvec3& point) const {
        return thickness + slope * mostOf(point - origin);
    }

  private:
    static double mostOf(const glm::dvec3& v) {
        return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    }
};

}  // namespace raybundle
