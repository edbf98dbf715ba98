// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/constants.hpp>
#include <utility>

namespace raybundle {

// Returns two unit vectors x and y such that x, y and the unit vector `n` form a right-handed
// orthonormal frame.
inline std::pair<glm::vec3, glm::vec3> frame(const glm::vec3& n) {
    const glm::vec3 axis = std::abs(n.z) < 0.9f ? glm::vec3(0, 0, 1) : glm::vec3(1, 0, 0);
    const glm::vec3 x = glm::normalize(glm::cross(axis, n));
    return {x, glm::cross(n, x)};
}

// Maps `uv` in [0, 1)^2 to the unit disk such that equal areas stay equal. Source: Shirley and
// Chiu, "A Low Distortion Map Between Disk and Square" (1997).
inline glm::vec2 onDisk(glm::vec2 uv) {
    const glm::vec2 p = 2.0f * uv - 1.0f;
    if (p.x == 0 && p.y == 0) return p;
    const float quarter = glm::quarter_pi<float>();
    if (std::abs(p.x) > std::abs(p.y))
        return p.x * glm::vec2(std::cos(quarter * p.y / p.x), std::sin(quarter * p.y / p.x));
    return p.y * glm::vec2(std::sin(quarter * p.x / p.y), std::cos(quarter * p.x / p.y));
}

// Returns a unit direction in the hemisphere of the unit vector `normal`, distributed by the cosine
// to the normal if `uv` is uniform in [0, 1)^2.
inline glm::vec3 cosineDirection(const glm::vec3& normal, glm::vec2 uv) {
    const glm::vec2 d = onDisk(uv);
    const auto [x, y] = frame(normal);
    return x * d.x + y * d.y + normal * std::sqrt(std::max(0.0f, 1 - glm::dot(d, d)));
}

// Returns a unit direction that is uniform by solid angle in the cone around the unit vector
// `axis`, if `uv` is uniform in [0, 1)^2. `cosMax` is the cosine of the cone's half angle.
inline glm::vec3 inCone(const glm::vec3& axis, float cosMax, glm::vec2 uv) {
    const glm::vec2 d = onDisk(uv);
    const float r2 = glm::dot(d, d);
    const float z = 1 - r2 * (1 - cosMax);
    const float scale = r2 > 0 ? std::sqrt(std::max(0.0f, 1 - z * z) / r2) : 0;
    const auto [x, y] = frame(axis);
    return scale * (d.x * x + d.y * y) + z * axis;
}

// Returns a unit direction that is uniform on the whole sphere if `uv` is uniform in [0, 1)^2.
inline glm::vec3 uniformDirection(glm::vec2 uv) {
    const float z = 1 - 2 * uv.x, r = std::sqrt(std::max(0.0f, 1 - z * z));
    const float phi = glm::two_pi<float>() * uv.y;
    return {r * std::cos(phi), r * std::sin(phi), z};
}

}  // namespace raybundle
