// SPDX-License-Identifier: GPL-3.0-or-later
//
// The triangles of a mesh while its edges are collapsed (refinement/simplification.h), and the edges
// that must stay.
#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <unordered_map>
#include <vector>

#include "refinement/simplification.h"
#include "scene/scene.h"

namespace raybundle {

// A triangle of the source, or what became of it.
struct CollapsingTriangle {
    int32_t face;                   // of the source
    std::array<int32_t, 3> vertex;  // of CollapsingMesh; -1: none, the face is kept
    std::array<int32_t, 3> corner;  // of the source
    bool isChanged = false, isRemoved = false;
    // Corners of the source whose vertices were removed, and which are nearest to this triangle.
    std::vector<int32_t> removed = {};

    int at(int32_t v) const { return vertex[0] == v ? 0 : vertex[1] == v ? 1 : 2; }
};

class CollapsingMesh {
  public:
    using Mesh3 = OpenMesh::TriMesh_ArrayKernelT<>;

    // Cuts the faces of a mesh into triangles and finds the features. References must outlive the
    // object. Throws Error with INVALID_ARGUMENT if the limits do not fit the mesh.
    CollapsingMesh(const Mesh& source, const SimplificationLimits& limits);

    bool isFeature(int32_t a, int32_t b) const { return features.count(edgeKey(a, b)) > 0; }
    // Return the position of a corner of the source, or of three, m.
    glm::dvec3 positionOf(int32_t corner) const {
        return source.vertices[size_t(source.cornerVertices[size_t(corner)])];
    }
    std::array<glm::dvec3, 3> pointsOf(const std::array<int32_t, 3>& corners) const {
        return {positionOf(corners[0]), positionOf(corners[1]), positionOf(corners[2])};
    }

    std::vector<CollapsingTriangle> triangles;
    Mesh3 mesh;
    std::vector<int32_t> triangleOf;     // per face of `mesh`
    std::vector<uint8_t> isLocked;       // per vertex of `mesh`: whether it stays
    std::vector<int32_t> featureCounts;  // per vertex of `mesh`: features that end there
    // By edgeKey() of vertices of `mesh` with a feature between them: the corner of the source at
    // which an edge of the source begins that lies on it.
    std::unordered_map<uint64_t, int32_t> features;
    float extent = 0;  // the largest of the mesh along an axis, m

  private:
    void cutIntoTriangles();
    void keepWhatCannotBeStored();
    void addVertices();
    void addFaces();
    void findFeatures();
    bool differ(int32_t cornerA, int32_t cornerB) const;

    const Mesh& source;
    const SimplificationLimits& limits;
    std::vector<uint8_t> isKept;  // per face of the source: whether it is not simplified
};

}  // namespace raybundle
