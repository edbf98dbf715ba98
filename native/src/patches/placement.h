// SPDX-License-Identifier: GPL-3.0-or-later
//
// The positions of the vertices of all instances in the world, the welding of vertices, and the
// surfaces and islands that result.
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

// Vertices in the world, welded, with their surfaces and islands.
class Placement {
  public:
    // Transforms and welds all vertices. Throws Error(INVALID_ARGUMENT) if an object reaches
    // further than kFarthest from the origin. Does not keep a reference to `scene`.
    explicit Placement(const Scene& scene);

    // Returns whether the scene has no vertices.
    bool isEmpty() const { return world.empty(); }

    // Finds the islands and the automatic patch sizes. Sets the axes, centre, radius, vertices and
    // islands of `patches`.
    void findIslands(Patches& patches);

    // Returns the index in Patches::vertices of a vertex of an instance's mesh, after welding.
    uint32_t vertex(uint32_t instance, int32_t ofMesh) const {
        return welded[firstVertex[instance] + size_t(ofMesh)];
    }
    // Returns the faces of all instances, by welded vertices.
    const WeldedFaces& faces() const { return allFaces; }
    // Returns, per instance, the index in Patches::vertices of its first vertex.
    const std::vector<size_t>& firstVertices() const { return firstVertex; }
    // Returns, per surface (WeldedFaces::surface), whether it is closed.
    const std::vector<bool>& closed() const { return closedOnes; }
    // Returns sizes and islands per piece (WeldedFaces::piece). Only after findIslands().
    const PatchSizes& sizes() const { return patchSizes; }

  private:
    glm::dmat3 ownAxes() const;
    std::vector<Surface> surfaces() const;
    bool seesItself(const std::vector<uint32_t>& faces, double off, bool isClosed) const;
    glm::dvec3 areaVector(size_t face) const;

    std::vector<glm::dvec3> world;    // per vertex of all instances, m
    glm::dmat3 axes{1.0};             // from the world's axes to the scene's own, see ownAxes()
    std::vector<size_t> firstVertex;  // per instance, index in `world`
    std::vector<uint32_t> welded;     // per vertex: the vertex that represents it
    WeldedFaces allFaces;
    std::vector<bool> closedOnes;  // per surface
    PatchSizes patchSizes;
};

}  // namespace raybundle
