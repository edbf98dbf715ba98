// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <glm/glm.hpp>

#include "lights/receiver.h"
#include "patches/patches.h"

namespace raybundle {

// Where a receiver is: all of a patch, or a point. Metres, relative to Patches::centre.
struct ReceiverPlace {
    glm::vec3 origin, a{0.0f}, b{0.0f};  // a point is origin + u * a + v * b
    glm::vec3 middle, normal;
    float radius = 0;  // of a sphere around the middle that holds it, metres
    bool isTriangle = false;

    // A point.
    ReceiverPlace(const glm::vec3& point, const glm::vec3& normal)
        : origin(point), middle(point), normal(normal) {}

    ReceiverPlace(const Patches& patches, const Receiver& receiver)
        : ReceiverPlace(receiver.point.value_or(glm::vec3(0.0f)), receiver.normal) {
        if (receiver.point) return;
        const uint32_t patch = receiver.side / 2;
        const Parent& parent = patches.parents[patches.parentOf[patch]];
        isTriangle = parent.isTriangle;
        origin = patches.point(patch, {0, 0});
        a = patches.point(patch, {1, 0}) - origin;
        b = patches.point(patch, {0, 1}) - origin;
        middle = at({0.5f, 0.5f});
        radius = 0.5f * (glm::length(a) + glm::length(b));
    }

    // u, v uniform in [0, 1]^2: uniform by area. The square is folded onto a triangle.
    glm::vec3 at(glm::vec2 uv) const {
        if (isTriangle && uv.x + uv.y > 1) uv = 1.0f - uv;
        return origin + uv.x * a + uv.y * b;
    }
    // No point of it is further from the middle along that direction (unit), metres.
    float reach(const glm::vec3& direction) const {
        return 0.5f * (std::abs(glm::dot(a, direction)) + std::abs(glm::dot(b, direction)));
    }
    glm::vec3 centroid() const { return isTriangle ? origin + (a + b) / 3.0f : middle; }
};

}  // namespace raybundle
