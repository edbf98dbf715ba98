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
    double thickness = 0;                 // of each half over the face that spans it, metres

    // Half the thickness over the extent of what lies in the plane: some times the 1e-6 by which
    // the vertices of a mesh may be off that was turned, sheared or joined.
    static constexpr double kOfExtent = 1e-5;
    // The same over the coordinates, and over the distance of a point: their roundings, and that of
    // the normal.
    static constexpr double kOfCoordinates = 4 * double(std::numeric_limits<float>::epsilon());

    Plane() = default;
    // a, b: what spans it from the origin on, metres; normal: unit, along their cross product or
    // against it; extent: radius of what lies in the plane, or of the mesh that it is part of,
    // metres.
    Plane(const glm::dvec3& origin, const glm::dvec3& a, const glm::dvec3& b,
          const glm::dvec3& normal, double extent)
        : origin(origin),
          normal(normal),
          thickness(kOfExtent * extent + kOfCoordinates * mostOf(origin)) {
        const glm::dvec3 n = glm::cross(a, b);
        const double square = glm::dot(n, n);
        if (!(square > 0)) return;
        alongA = glm::cross(b, n) / square;
        alongB = glm::cross(n, a) / square;
        tilt += thickness * (mostOf(alongA) + mostOf(alongB));
    }

    double height(const glm::dvec3& point) const { return glm::dot(point - origin, normal); }
    PlaneSide side(const glm::dvec3& point) const {
        const glm::dvec3 d = point - origin;
        const double h = glm::dot(d, normal);
        // Nearly all points are clear of it, however it is tilted.
        if (std::abs(h) > thickness + tilt * (std::abs(d.x) + std::abs(d.y) + std::abs(d.z)))
            return h > 0 ? PlaneSide::FRONT : PlaneSide::BEHIND;
        const double off = halfThickness(point);
        return h > off ? PlaneSide::FRONT : h < -off ? PlaneSide::BEHIND : PlaneSide::WITHIN;
    }
    // At a point, metres: vertices that are off by the thickness tilt the plane, the more the
    // narrower what spans it.
    double halfThickness(const glm::dvec3& point) const {
        const glm::dvec3 d = point - origin;
        return thickness * (1 + std::abs(glm::dot(d, alongA)) + std::abs(glm::dot(d, alongB))) +
               kOfCoordinates * mostOf(d);
    }

    // No point within a distance of the origin, metres, has more half thickness.
    double halfThicknessWithin(double distance) const {
        return thickness + tilt * std::sqrt(3.0) * distance;
    }

  private:
    glm::dvec3 alongA{0.0}, alongB{0.0};  // shares of a and b in a vector, per metre
    double tilt = kOfCoordinates;         // bound of what the thickness grows by, per metre away

    static double mostOf(const glm::dvec3& v) {
        return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    }
};

}  // namespace raybundle
