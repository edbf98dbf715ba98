// SPDX-License-Identifier: GPL-3.0-or-later
//
// Simplification: removes vertices that neither the shape of a mesh nor the values at its corners
// (light, texture coordinates, normals) need.
//
// Sources: Kobbelt, Campagna and Seidel, "A General Framework for Mesh Decimation" (1998): edges are
// collapsed to one of their ends, the one that changes least first, as long as all limits are kept.
// Klein, Liebich and Strasser, "Mesh Reduction with Error Control" (1996): each triangle keeps the
// vertices that were removed from it, so that the limits hold for all of them and not for the last
// step alone.
// Differs:
// - A collapse keeps one end as it is, so that all vertices, corners and values are those of the
//   source, and everything else that a corner or a vertex has can be carried over.
// - Values may differ across an edge, as light does across a sharp one. Such edges, borders, edges
//   between faces of different kinds, and edges that the caller wants to keep are features: their
//   vertices move along them only. Vertices where features meet stay.
// - Limits are per value; the distance counts as one more.
// - OpenMesh stores the mesh and collapses edges. The loop is not OpenMesh's decimater, which is in
//   a second library.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/scene.h"

namespace raybundle {

// What a simplified mesh must keep.
struct SimplificationLimits {
    std::vector<int32_t> faceKinds;  // per face of the source: faces of different kinds stay apart
    std::vector<uint8_t> keptEdges;  // per corner: whether the edge to the next corner is a feature
    // Per corner: its values, one after another; as many as `tolerances` has.
    std::vector<float> values;
    // Per value: the largest change at any vertex, positive.
    std::vector<float> tolerances;
    float distance =
        0;  // of removed vertices from the simplified surface, m, object space; positive
};

// A mesh whose vertices are vertices of its source. Faces of the source from which no vertex was
// removed are kept; the others are triangles.
struct SimplifiedMesh {
    std::vector<int32_t> sourceCorners;   // per corner: the corner of the source with its values
    std::vector<int32_t> sourceEdges;     // as in FinerMesh
    std::vector<int32_t> faceOffsets{0};  // as in Mesh
    std::vector<int32_t> sourceFaces;     // per face: a face of the source with its material
    // Per value: RMS over the vertices of what removing vertices has changed at them.
    std::vector<float> changes;
};

// Faces that OpenMesh cannot store, such as three at an edge, and all their vertices are kept.
// Throws Error with INVALID_ARGUMENT if the limits do not fit the mesh.
SimplifiedMesh simplify(const Mesh& source, const SimplificationLimits& limits);

}  // namespace raybundle
