// SPDX-License-Identifier: GPL-3.0-or-later
//
// Doubled faces: two faces in the same place that are turned the same way, such as those of a copy
// that was never moved. Light would reach only one of them, and the other would lie in its shadow.
// Here one of the two stands for both: the other has no patches, and its corners get the light of
// the first.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "patches/welding.h"
#include "scene/scene.h"

namespace raybundle {

// A corner of a doubled face and the corner whose light it gets. Instances are indices in
// Scene::instances; corners are those of the instances' meshes.
struct DoubledCorner {
    uint32_t instance, corner;
    uint32_t ofInstance, ofCorner;
};

// The result of findDoubledFaces().
struct DoubledFaces {
    std::vector<bool> isDouble;  // per face: another face stands for it
    // Corners of doubled faces. The corner that gives the light may belong to a doubled face
    // itself, which then comes later in the list.
    std::vector<DoubledCorner> corners;
    // Whether any faces coincide, also if neither can stand for the other.
    bool anyCoincide = false;
};

// Finds doubled faces. Vertices coincide if only rounding separates them. A face is doubled only if
// both faces act alike on light: both are opaque, and block and exchange light alike. If both are
// baked, they show the same side; if they emit, they have one material and one light set. `places`
// holds the positions of all vertices, m; `firstVertex` is the first vertex of each instance.
DoubledFaces findDoubledFaces(const Scene& scene, const WeldedFaces& faces,
                              const std::vector<size_t>& firstVertex,
                              const std::vector<glm::vec3>& places);

}  // namespace raybundle
