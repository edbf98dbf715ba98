// SPDX-License-Identifier: GPL-3.0-or-later
//
// Welding: a surface whose edges are split, or whose faces are meshes of their own, is one surface
// still. Vertices on open edges (of one face alone) that lie in the same place become one, of
// whatever instances, and so light goes on smoothly across (patches/neighbours.h), what is closed
// is solid (patches/coincidence.h), and patches have the size that they have in one piece
// (patches/patch_size.h). Edges with two faces stay as they are: boxes that stand against each
// other are two.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "scene/scene.h"

namespace raybundle {

// Per vertex of all instances, one after the other: the first of those that it is one with, or
// itself. places: of the same vertices in the world, metres; firstVertex: of each instance.
std::vector<uint32_t> weldedVertices(const Scene& scene, const std::vector<glm::dvec3>& places,
                                     const std::vector<size_t>& firstVertex);

// The faces of all instances by welded vertices.
struct WeldedFaces {
    std::vector<size_t> offsets{0};  // per face: its first corner; one more at the end
    std::vector<uint32_t> vertices;  // per corner, so that fronts of mirrored instances stay fronts
    std::vector<uint32_t> instance;  // per face
    std::vector<size_t> firstFace;   // per instance
    std::vector<uint32_t> surface;   // per face: the connected surface that it is part of
    uint32_t surfaceCount = 0;
    std::vector<uint32_t> piece;  // per face: what one instance has of that surface
    uint32_t pieceCount = 0;

    size_t count() const { return instance.size(); }
};

WeldedFaces weldedFaces(const Scene& scene, const std::vector<uint32_t>& welded,
                        const std::vector<size_t>& firstVertex);

}  // namespace raybundle
