// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <glm/glm.hpp>

#include "lights/receiver.h"
#include "patches/patches.h"
#include "patches/side.h"

namespace raybundle {

// The position of a receiver: a whole patch or a single point. Positions and lengths are in metres,
// relative to Patches::centre.
struct ReceiverPlace {
    glm::vec3 origin, a{0.0f}, b{0.0f};  // a point of the patch is origin + u * a + v * b
    glm::vec3 middle, normal;
    float radius = 0;  // of a sphere around `middle` that contains the receiver
    bool isTriangle = false;

    // The place of a single point with a unit normal.
    ReceiverPlace(const glm::vec3& point, const glm::vec3& normal)
        : origin(point), middle(point), normal(normal) {}

    // The place of a receiver: its point if it has one, else the patch of its side.
    ReceiverPlace(const Patches& patches, const Receiver& receiver)
        : ReceiverPlace(receiver.point.value_or(glm::vec3(0.0f)), receiver.normal) {
        if (receiver.point) return;
        const uint32_t patch = patchOf(receiver.side);
        const Parent& parent = patches.parents[patches.parentOf[patch]];
        isTriangle = parent.isTriangle;
        origin = patches.point(patch, {0, 0});
        a = patches.point(patch, {1, 0}) - origin;
        b = patches.point(patch, {0, 1}) - origin;
        middle = at({0.5f, 0.5f});
        radius = 0.5f * (glm::length(a) + glm::length(b));
    }

    // Returns a point of the patch. Uniform u and v in [0, 1]^2 give points uniform by area: the
    // part of the square beyond a triangle is folded onto the triangle.
    glm::vec3 at(glm::vec2 uv) const {
        if (isTriangle && uv.x + uv.y > 1) uv = 1.0f - uv;
        return origin + uv.x * a + uv.y * b;
    }
    // Returns an upper bound of the distance between `middle` and any point of the receiver,
    // measured along a direction (unit vector), metres.
    float reach(const glm::vec3& direction) const {
        return 0.5f * (std::abs(glm::dot(a, direction)) + std::abs(glm::dot(b, direction)));
    }
    glm::vec3 centroid() const { return isTriangle ? origin + (a + b) / 3.0f : middle; }
};

}  // namespace raybundle
