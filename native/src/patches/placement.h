// SPDX-License-Identifier: GPL-3.0-or-later
//
// Where the vertices of all instances lie, which of them are one, and what they make: surfaces,
// and islands of them with empty space around.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "patches/patch_size.h"
#include "patches/patches.h"
#include "patches/welding.h"
#include "scene/scene.h"

namespace raybundle {

class Placement {
  public:
    // Throws Error(INVALID_ARGUMENT) for what lies too far away. `scene` must outlive it.
    explicit Placement(const Scene& scene);

    // Whether there are no vertices.
    bool isEmpty() const { return world.empty(); }

    // Finds the islands and the automatic sizes; sets centre, radius, vertices and islands.
    void findIslands(Patches& patches);

    // A vertex of an instance's mesh, into Patches::vertices: the one that stands for it.
    uint32_t vertex(uint32_t instance, int32_t ofMesh) const {
        return welded[firstVertex[instance] + size_t(ofMesh)];
    }
    const WeldedFaces& faces() const { return allFaces; }
    // Of each instance, into Patches::vertices.
    const std::vector<size_t>& firstVertices() const { return firstVertex; }
    // Per surface of them.
    const std::vector<bool>& closed() const { return closedOnes; }
    const PatchSizes& sizes() const { return patchSizes; }

  private:
    glm::dmat3 ownAxes() const;
    std::vector<Surface> surfaces() const;
    bool seesItself(const std::vector<uint32_t>& faces, double off, bool isClosed) const;
    glm::dvec3 areaVector(size_t face) const;

    std::vector<glm::dvec3> world;    // per vertex of all instances, metres
    glm::dmat3 axes{1.0};             // from the world's to those of the scene, see ownAxes
    std::vector<size_t> firstVertex;  // per instance
    std::vector<uint32_t> welded;     // per vertex: the one that stands for it
    WeldedFaces allFaces;
    std::vector<bool> closedOnes;
    PatchSizes patchSizes;
};

}  // namespace raybundle
