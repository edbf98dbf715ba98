// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/placement.h"

#include <algorithm>

#include "job/cancellation.h"
#include "job/error.h"
#include "patches/coincidence.h"

namespace raybundle {
namespace {

// What of a surface lies in front of a face of it by more than this share of its diagonal is seen
// from there; of about so many faces.
constexpr double kBlind = 1e-3;
constexpr size_t kBlindFaces = 16;
// Directions that are tried for the scene's own axes, and faces that they are judged by.
constexpr size_t kTriedAxes = 64, kJudgingFaces = size_t(1) << 16;
// Cosine of what counts as parallel, and as at right angles; of axes that are the world's, and of
// directions of which one is tried.
constexpr double kParallel = 0.9998, kAcross = 0.02, kSameAxes = 1 - 1e-9, kSame = 1 - 1e-13;

// The direction along which most of some vectors lie, by their lengths; 0 without any. pole: what
// lies at right angles to the direction and to this counts too, as the sides of a grid do and its
// diagonals do not.
glm::dvec3 commonest(const std::vector<glm::dvec3>& vectors, const glm::dvec3* pole) {
    double total = 0, passed = 0, next = 0, most = 0;
    std::vector<double> lengths;
    for (const glm::dvec3& v : vectors) {
        lengths.push_back(glm::length(v));
        total += lengths.back();
    }
    glm::dvec3 best(0.0);
    std::vector<glm::dvec3> tried;
    for (size_t k = 0; k < vectors.size(); ++k) {
        passed += lengths[k];
        if (!(lengths[k] > 0) || passed < next) continue;
        next = passed + total / double(kTriedAxes);
        const glm::dvec3 direction = vectors[k] / lengths[k];
        auto isThis = [&](const glm::dvec3& d) { return std::abs(glm::dot(d, direction)) > kSame; };
        if (std::any_of(tried.begin(), tried.end(), isThis)) continue;
        tried.push_back(direction);
        const glm::dvec3 other = pole ? glm::cross(*pole, direction) : glm::dvec3(0.0);
        double along = 0;
        for (size_t j = 0; j < vectors.size(); ++j)
            if (std::max(std::abs(glm::dot(vectors[j], direction)),
                         std::abs(glm::dot(vectors[j], other))) > kParallel * lengths[j])
                along += lengths[j];
        // By more than rounding, so that equal ones stay in their order.
        if (along > most * (1 + 1e-6)) {
            most = along;
            best = direction;
        }
    }
    return best;
}

}  // namespace

Placement::Placement(const Scene& scene) {
    for (const Instance& instance : scene.instances) {
        firstVertex.push_back(world.size());
        for (const glm::vec3& vertex : scene.meshes[size_t(instance.mesh)].vertices) {
            world.push_back(glm::dvec3(instance.transform * glm::dvec4(vertex, 1.0)));
            if (!(glm::length(world.back()) <= kFarthest))
                throw invalidArgument("object \"" + instance.name +
                                      "\" reaches further than 1e12 m from the origin");
        }
    }
    welded = weldedVertices(scene, world, firstVertex);
    allFaces = weldedFaces(scene, welded, firstVertex);
    closedOnes = closedSurfaces(allFaces);
}

// The axes along which most faces lie, for boxes that do not depend on how the scene is turned: the
// normal of most of the area, and of most of what is at right angles to it; if nothing is, an edge.
// The world's, where they are the same.
glm::dmat3 Placement::ownAxes() const {
    std::vector<glm::dvec3> faces, walls, edges;
    const size_t step = 1 + allFaces.count() / kJudgingFaces;
    for (size_t f = 0; f < allFaces.count(); f += step) faces.push_back(areaVector(f));
    const glm::dvec3 x = commonest(faces, nullptr);
    if (x == glm::dvec3(0.0)) return glm::dmat3(1.0);
    for (const glm::dvec3& face : faces)
        if (std::abs(glm::dot(face, x)) < kAcross * glm::length(face)) walls.push_back(face);
    glm::dvec3 y = commonest(walls, &x);
    if (y == glm::dvec3(0.0)) {
        for (size_t f = 0; f < allFaces.count(); f += step) {
            throwIfCancelledAt(f);
            const size_t begin = allFaces.offsets[f], end = allFaces.offsets[f + 1];
            for (size_t c = begin; c < end; ++c) {
                const glm::dvec3 edge = world[allFaces.vertices[c + 1 < end ? c + 1 : begin]] -
                                        world[allFaces.vertices[c]];
                if (std::abs(glm::dot(edge, x)) < kAcross * glm::length(edge))
                    edges.push_back(edge);
            }
        }
        y = commonest(edges, &x);
    }
    if (y == glm::dvec3(0.0)) y = std::abs(x.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
    y = glm::normalize(y - glm::dot(x, y) * x);
    const glm::dmat3 own(x, y, glm::cross(x, y));
    bool isWorlds = true;
    for (int k = 0; k < 3; ++k) {
        const glm::dvec3 c = glm::abs(own[k]);
        isWorlds = isWorlds && std::max({c.x, c.y, c.z}) > kSameAxes;
    }
    return isWorlds ? glm::dmat3(1.0) : glm::transpose(own);
}

void Placement::findIslands(Patches& patches) {
    axes = ownAxes();
    patches.axes = glm::mat3(axes);
    patchSizes = automaticPatchSizes(surfaces());
    const std::vector<Extent>& extents = patchSizes.extent;
    // Vertices of no face lie anywhere.
    Extent all;
    for (const glm::dvec3& vertex : world) all.add(axes * vertex);
    auto middleOf = [&](const Extent& extent) { return glm::transpose(axes) * extent.middle(); };
    patches.centre = middleOf(extents.size() > 1 ? extents.front() : all);
    patches.vertices.reserve(world.size());
    for (const glm::dvec3& vertex : world) {
        patches.vertices.push_back(glm::vec3(vertex - patches.centre));
        patches.radius = std::max(patches.radius, glm::length(patches.vertices.back()));
    }
    if (extents.size() <= 1) {
        patches.islands = {{glm::vec3(0.0f), patches.radius, patches.radius}};
        return;
    }
    for (const Extent& extent : extents)
        patches.islands.push_back({glm::vec3(middleOf(extent) - patches.centre), 0, 0});
    for (size_t f = 0; f < allFaces.count(); ++f)
        for (size_t c = allFaces.offsets[f]; c < allFaces.offsets[f + 1]; ++c) {
            Island& island = patches.islands[patchSizes.island[allFaces.piece[f]]];
            const glm::vec3& vertex = patches.vertices[allFaces.vertices[c]];
            island.radius = std::max(island.radius, glm::distance(vertex, island.centre));
            island.reach = std::max(island.reach, glm::length(vertex));
        }
}

std::vector<Surface> Placement::surfaces() const {
    std::vector<Surface> result(allFaces.pieceCount);
    std::vector<bool> isClosed(result.size());
    std::vector<std::vector<uint32_t>> facesOf(result.size());
    for (size_t f = 0; f < allFaces.count(); ++f) {
        throwIfCancelledAt(f);
        Surface& surface = result[allFaces.piece[f]];
        for (size_t c = allFaces.offsets[f]; c < allFaces.offsets[f + 1]; ++c)
            surface.extent.add(axes * world[allFaces.vertices[c]]);
        surface.area += glm::length(areaVector(f));
        ++surface.faces;
        surface.object = allFaces.instance[f];
        facesOf[allFaces.piece[f]].push_back(uint32_t(f));
        isClosed[allFaces.piece[f]] = closedOnes[allFaces.surface[f]];
    }
    for (size_t s = 0; s < result.size(); ++s)
        result[s].seesItself =
            seesItself(facesOf[s], kBlind * result[s].extent.diagonal(), isClosed[s]);
    return result;
}

// Whether light goes on from one part of a surface to another: by some of its faces, whether not
// all vertices lie behind, or in one plane with them. off: what is in the plane, metres.
bool Placement::seesItself(const std::vector<uint32_t>& faces, double off, bool isClosed) const {
    for (size_t k = 0; k < faces.size(); k += 1 + faces.size() / kBlindFaces) {
        const glm::dvec3 at = world[allFaces.vertices[allFaces.offsets[faces[k]]]];
        const glm::dvec3 across = areaVector(faces[k]);
        if (!(glm::length(across) > 0)) continue;
        const glm::dvec3 normal = glm::normalize(across);
        for (uint32_t f : faces)
            for (size_t c = allFaces.offsets[f]; c < allFaces.offsets[f + 1]; ++c) {
                const double height = glm::dot(world[allFaces.vertices[c]] - at, normal);
                if (height > off || (!isClosed && height < -off)) return true;
            }
    }
    return false;
}

// Along the normal of a face, as long as its area, m^2.
glm::dvec3 Placement::areaVector(size_t face) const {
    const size_t begin = allFaces.offsets[face], end = allFaces.offsets[face + 1];
    const glm::dvec3 first = world[allFaces.vertices[begin]];
    glm::dvec3 doubled(0.0);
    for (size_t c = begin; c + 1 < end; ++c)
        doubled += glm::cross(world[allFaces.vertices[c]] - first,
                              world[allFaces.vertices[c + 1]] - first);
    return 0.5 * doubled;
}

}  // namespace raybundle
