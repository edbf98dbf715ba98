// SPDX-License-Identifier: GPL-3.0-or-later
//
// Welding: a surface whose edges are split, or whose faces are separate meshes, is still one
// surface. Vertices on open edges (edges of only one face) that lie in the same place are merged,
// also across instances. As a consequence, light is continuous across such edges
// (patches/neighbours.h), closed surfaces are solid (patches/coincidence.h), and patches have the
// size that they have on a surface in one piece (patches/patch_size.h). Edges with two faces are
// not welded: boxes that stand against each other remain two surfaces.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "scene/scene.h"

namespace raybundle {

// Returns, per vertex of all instances, the first vertex that it is merged with, or itself.
// `places` holds the positions of the vertices in the world, m; `firstVertex` is the first vertex
// of each instance.
std::vector<uint32_t> weldedVertices(const Scene& scene, const std::vector<glm::dvec3>& places,
                                     const std::vector<size_t>& firstVertex);

// The faces of all instances, by welded vertices.
struct WeldedFaces {
    std::vector<size_t> offsets{0};  // per face: its first corner; one more entry at the end
    // Per corner. The order is reversed in mirrored instances, so that their fronts remain fronts.
    std::vector<uint32_t> vertices;
    std::vector<uint32_t> instance;  // per face
    std::vector<size_t> firstFace;   // per instance: its first face
    std::vector<uint32_t> surface;   // per face: its connected surface
    uint32_t surfaceCount = 0;
    std::vector<uint32_t> piece;  // per face: the part of its surface that belongs to one instance
    uint32_t pieceCount = 0;

    size_t count() const { return instance.size(); }
};

// Returns the faces of all instances, with their surfaces and pieces. `welded` is the result of
// weldedVertices().
WeldedFaces weldedFaces(const Scene& scene, const std::vector<uint32_t>& welded,
                        const std::vector<size_t>& firstVertex);

}  // namespace raybundle
