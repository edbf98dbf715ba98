// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/placement.h"

#include <algorithm>

#include "job/cancellation.h"
#include "job/error.h"
#include "patches/coincidence.h"

namespace raybundle {
namespace {

// A surface sees itself if a part of it is in front of one of its faces by more than kBlind of the
// surface's diagonal. About kBlindFaces faces are tested.
constexpr double kBlind = 1e-3;
constexpr size_t kBlindFaces = 16;
// Directions that are tried as axes of the scene, and the largest number of faces that are
// evaluated.
constexpr size_t kTriedAxes = 64, kJudgingFaces = size_t(1) << 16;
// Cosines of directions that count as parallel (at least kParallel) and as perpendicular (at most
// kAcross), of axes that count as those of the world (kSameAxes), and of directions so close that
// only one of them is tried (kSame).
constexpr double kParallel = 0.9998, kAcross = 0.02, kSameAxes = 1 - 1e-9, kSame = 1 - 1e-13;

// Returns the unit direction to which most of the vectors are parallel, weighted by length, or 0 if
// there are no vectors. If there is a `pole`, vectors perpendicular to both the direction and the
// pole count too: this holds for the sides of a grid, but not for its diagonals.
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
        // Better by more than rounding, so that of equally good directions the first is taken.
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

// Returns the rotation from the world's axes to those along which most faces lie, so that boxes do
// not depend on how the scene is turned. The axes are the normal of most of the area, and the
// normal of most of the area perpendicular to it. If no area is perpendicular, an edge takes its
// place. Returns the identity if the axes are those of the world.
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
    // Include vertices without faces, which may lie outside all islands.
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

// Returns the extent and properties of each piece.
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

// Returns whether light can pass from one part of a surface to another. The test is whether, for
// some of its faces, vertices lie in front of the face, or for open surfaces also behind it.
// Vertices closer to the plane of the face than `off` (m) lie in the plane.
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

// Returns the normal of a face multiplied by its area, m^2.
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
