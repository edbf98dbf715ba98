// SPDX-License-Identifier: GPL-3.0-or-later
//
// A triangle as it is seen from a point: its solid angle, and directions that are uniform in it.
//
// Sources: van Oosterom and Strackee, "The Solid Angle of a Plane Triangle" (1983); Arvo,
// "Stratified Sampling of Spherical Triangles" (1995).
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace raybundle {

class SphericalTriangle {
  public:
    // Corners relative to the point, none of which is 0.
    SphericalTriangle(const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& r)
        : a(glm::normalize(p)), b(glm::normalize(q)), c(glm::normalize(r)) {
        solidAngle = 2 * std::abs(std::atan2(glm::dot(a, glm::cross(b, c)),
                                             1 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a)));
    }

    double area() const { return solidAngle; }  // sr
    // Whether it is large enough to have angles, and not all that is seen.
    bool isSampled() const { return solidAngle > 1e-5 && solidAngle < 6.2; }

    // uv uniform in [0, 1)^2.
    glm::dvec3 sample(glm::vec2 uv) const {
        const glm::dvec3 ab = across(a, b), ac = across(a, c);
        // Of the angle at a, and of the side towards b.
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
    // The unit vector at x, across it, towards y.
    static glm::dvec3 across(const glm::dvec3& x, const glm::dvec3& y) {
        const glm::dvec3 d = y - glm::dot(x, y) * x;
        const double length = glm::length(d);
        return length > 0 ? d / length : glm::dvec3(0.0);
    }

    glm::dvec3 a, b, c;
    double solidAngle;
};

}  // namespace raybundle
