// SPDX-License-Identifier: GPL-3.0-or-later
//
// Classification of points as in front of a plane, within it, or behind it. Closed forms, samples
// and facing tests all use it, so that they agree. Positions carry rounding errors, from the file,
// from transforms and from being floats. The plane is therefore as thick as rounding can move
// points that lie in it. A receiver in the plane of a source gets no light from it, to whichever
// side rounding moves the receiver: just in front of the source it would receive the light of a
// whole hemisphere.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>

namespace raybundle {

// The position of a point relative to a plane; FRONT is the side to which the normal points.
enum class PlaneSide { BEHIND = -1, WITHIN = 0, FRONT = 1 };

// A plane with a thickness that accounts for rounding errors.
struct Plane {
    // A point of the plane, m, relative to Patches::centre, and the unit normal.
    glm::dvec3 origin{0.0}, normal{0.0};
    // Half the thickness over the face that spans the plane, m. It grows with the distance from the
    // face.
    double thickness = 0;

    // Half the thickness relative to the extent of the surface in the plane. A mesh that was
    // rotated, sheared or joined may have vertices that are off by 1e-6 of its extent; this is
    // several times as much.
    static constexpr double kOfExtent = 1e-5;
    // Half the thickness relative to the coordinates of the plane, and relative to the distance of
    // a point: their rounding errors, and that of the normal.
    static constexpr double kOfCoordinates = 4 * double(std::numeric_limits<float>::epsilon());

    Plane() = default;
    // Constructs the plane through `origin` that a and b span (m). `normal` is unit, along cross(a,
    // b) or against it. `extent` is the radius of the surface in the plane, or of the mesh that it
    // is part of, m.
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

    // Returns the distance of a point from the plane, m; positive in front of it.
    double height(const glm::dvec3& point) const { return glm::dot(point - origin, normal); }
    // Returns whether a point is in front of the plane, within its thickness, or behind it.
    PlaneSide side(const glm::dvec3& point) const {
        const glm::dvec3 d = point - origin;
        const double h = glm::dot(d, normal);
        // A quick bound of the thickness: nearly all points lie outside it, however the plane is
        // tilted.
        if (std::abs(h) > thickness + tilt * (std::abs(d.x) + std::abs(d.y) + std::abs(d.z)))
            return h > 0 ? PlaneSide::FRONT : PlaneSide::BEHIND;
        const double off = halfThickness(point);
        return h > off ? PlaneSide::FRONT : h < -off ? PlaneSide::BEHIND : PlaneSide::WITHIN;
    }
    // Returns half the thickness at a point, m. Vertices that are off by the thickness tilt the
    // plane, the more the narrower the face that spans it.
    double halfThickness(const glm::dvec3& point) const {
        const glm::dvec3 d = point - origin;
        return thickness * (1 + std::abs(glm::dot(d, alongA)) + std::abs(glm::dot(d, alongB))) +
               kOfCoordinates * mostOf(d);
    }

    // Returns an upper bound of half the thickness at all points within a distance of the origin,
    // m.
    double halfThicknessWithin(double distance) const {
        return thickness + tilt * std::sqrt(3.0) * distance;
    }

  private:
    glm::dvec3 alongA{0.0}, alongB{0.0};  // dot(alongA, d) is the coordinate of d along a, 1/m
    double tilt =
        kOfCoordinates;  // bound of the growth of the half thickness per metre of |x| + |y| + |z|

    static double mostOf(const glm::dvec3& v) {
        return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    }
};

}  // namespace raybundle
