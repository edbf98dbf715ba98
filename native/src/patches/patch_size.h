// SPDX-License-Identifier: GPL-3.0-or-later
//
// The automatic patch size: by what is near.
//
// Islands are what empty space sets apart: connected surfaces (patches/welding.h) belong to one
// island where both together are no longer than the larger one and most of the smaller laid end to
// end. An island's patches are a 64th of its diagonal, as if it were baked alone, and less for
// groups of surfaces that are tiny in a vast one. Which object has which faces matters hardly: only
// what is part of something large.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

// A bounding box, metres.
struct Extent {
    glm::dvec3 low{INFINITY}, high{-INFINITY};

    void add(const glm::dvec3& point) {
        low = glm::min(low, point);
        high = glm::max(high, point);
    }
    void add(const Extent& other) {
        low = glm::min(low, other.low);
        high = glm::max(high, other.high);
    }
    bool isEmpty() const { return !(low.x <= high.x); }
    double diagonal() const { return isEmpty() ? 0 : glm::length(high - low); }
    glm::dvec3 middle() const { return 0.5 * (low + high); }
    double distance(const glm::dvec3& point) const {
        return glm::length(glm::max(glm::max(low - point, point - high), glm::dvec3(0.0)));
    }
    // Whether they are no further apart along any axis, or for less than 0 have so much in common.
    bool isNear(const Extent& other, double away) const {
        return glm::all(glm::lessThanEqual(low - away, other.high)) &&
               glm::all(glm::lessThanEqual(other.low, high + away));
    }
};

// A connected surface, or what one object has of it.
struct Surface {
    Extent extent;    // along the scene's own axes (Placement::ownAxes)
    double area = 0;  // m^2
    size_t faces = 0;
    uint32_t object = 0;  // that it is of
    bool seesItself =
        true;  // false of what is flat, or convex and closed: all its light comes from outside
};

struct PatchSizes {
    std::vector<double> size;      // per surface: edge of a patch, metres
    std::vector<uint32_t> island;  // per surface
    std::vector<Extent> extent;    // per island; the first is the one that has the most patches
};

PatchSizes automaticPatchSizes(const std::vector<Surface>& surfaces);

}  // namespace raybundle
