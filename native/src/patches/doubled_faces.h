// SPDX-License-Identifier: GPL-3.0-or-later
//
// Doubled faces: two in the same place that look the same way, as a copy that was never moved
// leaves them. Light sees one of them, and the other lay in its shadow. One stands for both here:
// the other has no patches, and its corners get the light of the one's.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "patches/welding.h"
#include "scene/scene.h"

namespace raybundle {

// A corner of a doubled face and the one whose light it gets; instances and corners of their
// meshes.
struct DoubledCorner {
    uint32_t instance, corner;
    uint32_t ofInstance, ofCorner;
};

struct DoubledFaces {
    std::vector<bool> isDouble;  // per face: another stands for it
    // Those that a corner's light comes from may be doubles themselves, which come later.
    std::vector<DoubledCorner> corners;
    bool anyCoincide = false;  // also of those that do not do alike
};

// places: of all vertices, metres. The same place is so but for a rounding error. Only faces that
// do alike are doubles: opaque ones that block, exchange and are baked alike, and of one material
// where they emit.
DoubledFaces findDoubledFaces(const Scene& scene, const WeldedFaces& faces,
                              const std::vector<size_t>& firstVertex,
                              const std::vector<glm::vec3>& places);

}  // namespace raybundle
