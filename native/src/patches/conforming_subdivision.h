// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "scene/scene.h"

namespace raybundle {

// A triangle mesh without T-junctions that subdivides another mesh.
struct ConformingSubdivision {
    std::vector<glm::vec3> vertices;
    std::vector<std::array<int32_t, 3>> triangles;  // into vertices
    std::vector<int32_t> sourceFaces;               // per triangle: face of the source mesh
    // Per corner of each triangle: three corners of the source mesh, and the weights with which
    // they interpolate to it.
    std::vector<std::array<int32_t, 3>> sourceCorners;
    std::vector<std::array<float, 3>> sourceWeights;
};

// Triangulates a mesh, and bisects longest edges until no edge is longer than `maxEdge`, in the
// units of the mesh. Slivers and copies of faces are left out. Throws Error(INVALID_ARGUMENT) if
// more than 2^26 triangles would be needed.
ConformingSubdivision subdivideConforming(const Mesh& mesh, float maxEdge);

}  // namespace raybundle
