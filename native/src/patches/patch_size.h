// SPDX-License-Identifier: GPL-3.0-or-later
//
// Automatic patch sizes, according to what is near.
//
// Islands are separated by empty space. Two connected surfaces (patches/welding.h) belong to one
// island if the extent of both together is at most that of the larger one plus most of that of the
// smaller one. The patches of an island are a 64th of its diagonal, as if it were baked alone, and
// smaller on groups of surfaces that are tiny compared to the island. How faces are distributed
// over objects hardly matters: it only decides what counts as part of something large.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

// A bounding box, m.
struct Extent {
    glm::dvec3 low{INFINITY}, high{-INFINITY};

    // Extends the box to contain a point.
    void add(const glm::dvec3& point) {
        low = glm::min(low, point);
        high = glm::max(high, point);
    }
    // Extends the box to contain another box.
    void add(const Extent& other) {
        low = glm::min(low, other.low);
        high = glm::max(high, other.high);
    }
    bool isEmpty() const { return !(low.x <= high.x); }
    // Returns the length of the diagonal, or 0 if the box is empty.
    double diagonal() const { return isEmpty() ? 0 : glm::length(high - low); }
    glm::dvec3 middle() const { return 0.5 * (low + high); }
    // Returns the distance of a point from the box, or 0 inside.
    double distance(const glm::dvec3& point) const {
        return glm::length(glm::max(glm::max(low - point, point - high), glm::dvec3(0.0)));
    }
    // Returns whether the gap between the boxes is at most `away` along each axis. A negative
    // `away` requires that they overlap by that length along each axis.
    bool isNear(const Extent& other, double away) const {
        return glm::all(glm::lessThanEqual(low - away, other.high)) &&
               glm::all(glm::lessThanEqual(other.low, high + away));
    }
};

// A connected surface, or the part of it that belongs to one object (WeldedFaces::piece).
struct Surface {
    Extent extent;    // along the scene's own axes (Placement::ownAxes)
    double area = 0;  // m^2
    size_t faces = 0;
    uint32_t object = 0;  // index of the object
    // False if the surface is flat, or convex and closed: then all its light comes from other
    // surfaces.
    bool seesItself = true;
};

// The result of automaticPatchSizes().
struct PatchSizes {
    // Per surface: target edge length of its patches, m; 0 if the surface has no extent.
    std::vector<double> size;
    std::vector<uint32_t> island;  // per surface: index of its island
    // Per island. The first island has the most patches of those that see themselves.
    std::vector<Extent> extent;
};

// Returns the islands of the surfaces and a patch size for each surface.
PatchSizes automaticPatchSizes(const std::vector<Surface>& surfaces);

}  // namespace raybundle
