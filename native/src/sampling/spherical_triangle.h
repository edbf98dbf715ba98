// SPDX-License-Identifier: GPL-3.0-or-later
//
// A triangle projected on the unit sphere around a point: its solid angle, and uniform directions
// towards it.
//
// Sources: van Oosterom and Strackee, "The Solid Angle of a Plane Triangle" (1983); Arvo,
// "Stratified Sampling of Spherical Triangles" (1995).
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace raybundle {

// The spherical triangle that a flat triangle subtends at a point. Used to sample emissive
// triangles by solid angle.
class SphericalTriangle {
  public:
    // Constructs the spherical triangle from the corners of a flat triangle, relative to the point
    // from which it is seen. No corner may be 0, since its direction would be undefined.
    SphericalTriangle(const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& r)
        : a(glm::normalize(p)), b(glm::normalize(q)), c(glm::normalize(r)) {
        solidAngle = 2 * std::abs(std::atan2(glm::dot(a, glm::cross(b, c)),
                                             1 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a)));
    }

    // Returns the solid angle, sr.
    double area() const { return solidAngle; }
    // Returns whether sample() may be called: the solid angle is large enough (above 1e-5 sr) for
    // accurate angles at the corners, and below that of the whole hemisphere (2 pi sr).
    bool isSampled() const { return solidAngle > 1e-5 && solidAngle < 6.2; }

    // Returns a unit direction that is uniform by solid angle in the triangle, if `uv` is uniform
    // in [0, 1)^2. Call it only if isSampled().
    glm::dvec3 sample(glm::vec2 uv) const {
        const glm::dvec3 ab = across(a, b), ac = across(a, c);
        // The angle of the spherical triangle at the corner a, and the side from a to b, as
        // cosines.
        const double cosA = std::clamp(glm::dot(ab, ac), -1.0, 1.0);
        const double sinA = std::sqrt(1 - cosA * cosA), cosSide = glm::dot(a, b);
        const double turn = double(uv.x) * solidAngle - std::acos(cosA);
        const double s = std::sin(turn), t = std::cos(turn);
        const double u = t - cosA, v = s + sinA * cosSide;
        const double divisor = (v * s + u * t) * sinA;
        const double q =
            divisor != 0 ? std::clamp(((v * t - u * s) * cosA - v) / divisor, -1.0, 1.0) : 1.0;
        const glm::dvec3 end = q * a + std::sqrt(1 - q * q) * ac;
        const double z = 1 - double(uv.y) * (1 - glm::dot(end, b));
        return z * b + std::sqrt(std::max(0.0, 1 - z * z)) * across(b, end);
    }

  private:
    // Returns the unit vector that is perpendicular to the unit vector `x`, in the plane of `x` and
    // `y`, on the side of `y`. Returns 0 if `y` is parallel to `x`.
    static glm::dvec3 across(const glm::dvec3& x, const glm::dvec3& y) {
        const glm::dvec3 d = y - glm::dot(x, y) * x;
        const double length = glm::length(d);
        return length > 0 ? d / length : glm::dvec3(0.0);
    }

    glm::dvec3 a, b, c;
    double solidAngle;
};

}  // namespace raybundle
