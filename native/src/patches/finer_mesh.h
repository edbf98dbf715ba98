// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "scene/scene.h"

namespace raybundle {

// A mesh whose faces lie on the faces of another mesh, its source. Faces that were not divided are
// those of the source.
struct FinerMesh {
    std::vector<glm::vec3> vertices;      // object space; those of the source come first
    std::vector<int32_t> cornerVertices;  // per corner
    std::vector<int32_t> faceOffsets{0};  // as in Mesh
    std::vector<int32_t> sourceFaces;     // per face: the face of the source that contains it
    // Per corner: three corners of the source, and the weights with which they interpolate to it.
    std::vector<std::array<int32_t, 3>> sourceCorners;
    std::vector<std::array<float, 3>> sourceWeights;
    // Per corner: if the edge from it to the next corner lies on an edge of the source, the corner
    // of the source at which that edge begins, in the order of the source's face. Otherwise -1.
    std::vector<int32_t> sourceEdges;
    // Per corner: whether the light jumps across the edge from it to the next corner.
    std::vector<uint8_t> isAbrupt;
    size_t sourceCornerCount = 0;

    // Returns the mesh whose faces are those of the source.
    static FinerMesh of(const Mesh& source);

    // Returns whether the mesh has vertices that the source does not have.
    bool isFinerThan(const Mesh& source) const { return vertices.size() > source.vertices.size(); }
    size_t faceCount() const { return sourceFaces.size(); }
    // Returns the value at a corner of values at the corners of the source.
    template <class Value>
    Value interpolate(size_t corner, const std::vector<Value>& values) const {
        Value sum(0.0f);
        for (size_t k = 0; k < 3; ++k)
            sum += sourceWeights[corner][k] * values[size_t(sourceCorners[corner][k])];
        return sum;
    }
    // Returns the mesh with the name and the interpolated attributes of its source. Edges across
    // which the light jumps count as sharp.
    Mesh withAttributesOf(const Mesh& source) const;
};

}  // namespace raybundle
