// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/whole_faces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "job/cancellation.h"
#include "job/settings.h"
#include "patches/reflectance.h"
#include "scene/triangulation.h"

namespace raybundle {
namespace {

// Surfaces within this share of the radius of the scene touch.
constexpr float kTouchOfScene = 1e-6f;

// Makes the patches of one instance. The vertices of all instances must be set.
class Faces {
  public:
    // `firstVertex` and `firstTriangle` are the indices of the instance's first vertex and patch.
    Faces(const Scene& scene, uint32_t index, size_t firstVertex, size_t firstTriangle,
          Patches& patches)
        : instance(scene.instances[index]),
          mesh(scene.meshes[size_t(instance.mesh)]),
          index(index),
          firstVertex(uint32_t(firstVertex)),
          firstTriangle(firstTriangle),
          isMirrored(instance.isMirrored()),
          patches(patches) {}

    void add(size_t face) const {
        const int32_t begin = mesh.faceOffsets[face];
        const int count = mesh.faceOffsets[face + 1] - begin;
        const size_t first = firstTriangle + size_t(begin) - 2 * face;
        if (count <= 4) {
            // From the corner at which both triangles of a quad face the same way.
            const int from = count == 4 && !isConvexFrom(begin) ? 1 : 0;
            for (int k = 0; k < count - 2; ++k)
                addTriangle(first + size_t(k), face,
                            {begin + from, begin + from + 1 + k, begin + (from + 2 + k) % count});
        } else {
            std::vector<glm::dvec3> points;
            for (int k = 0; k < count; ++k) points.push_back(at(begin + k));
            size_t next = first;
            for (const std::array<int, 3>& t : triangulate(points))
                addTriangle(next++, face, {begin + t[0], begin + t[1], begin + t[2]});
        }
    }

  private:
    uint32_t vertexOf(int32_t corner) const {
        return firstVertex + uint32_t(mesh.cornerVertices[size_t(corner)]);
    }
    const glm::vec3& at(int32_t corner) const { return patches.vertices[vertexOf(corner)]; }

    bool isConvexFrom(int32_t begin) const {
        const glm::vec3 middle = at(begin + 2) - at(begin);
        return glm::dot(glm::cross(at(begin + 1) - at(begin), middle),
                        glm::cross(middle, at(begin + 3) - at(begin))) >= 0;
    }

    void addTriangle(size_t patch, size_t face, std::array<int32_t, 3> corners) const {
        if (isMirrored) std::swap(corners[1], corners[2]);
        Parent& parent = patches.parents[patch];
        for (size_t k = 0; k < 3; ++k) parent.vertex[k] = vertexOf(corners[k]);
        parent.vertex[3] = parent.vertex[2];
        parent.origin = at(corners[0]);
        parent.a = at(corners[1]) - parent.origin;
        parent.b = at(corners[2]) - parent.origin;
        const glm::dvec3 normal = glm::cross(glm::dvec3(parent.a), glm::dvec3(parent.b));
        const double length = glm::length(normal);
        parent.normal = length > 0 ? glm::vec3(normal / length) : glm::vec3(0, 0, 1);
        parent.firstPatch = parent.firstTile = parent.cell = uint32_t(patch);
        parent.stopsDirect = instance.stopsDirect;
        parent.exchanges = instance.exchanges;
        parent.instance = index;
        parent.face = int32_t(face);
        Cell& cell = patches.cells[patch];
        cell.origin = parent.origin;
        cell.a = parent.a;
        cell.b = parent.b;
        cell.corner = {corners[0], corners[1], corners[2], -1};
        cell.instance = index;
        cell.face = int32_t(face);
        patches.parentOf[patch] = uint32_t(patch);
        patches.area[patch] = std::max(float(0.5 * length), std::numeric_limits<float>::min());
    }

    const Instance& instance;
    const Mesh& mesh;
    uint32_t index;
    uint32_t firstVertex;
    size_t firstTriangle;
    bool isMirrored;
    Patches& patches;
};

// Sets the vertices, the centre and the radius, and the scene as one island. Returns whether all
// vertices are near enough.
bool placeVertices(const Scene& scene, const std::vector<size_t>& firstVertex, Patches& patches) {
    std::vector<glm::dvec3> world(firstVertex.back());
    for (size_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const std::vector<glm::vec3>& vertices = scene.meshes[size_t(instance.mesh)].vertices;
        parallelFor(size_t(0), vertices.size(), [&](size_t v) {
            world[firstVertex[i] + v] =
                glm::dvec3(instance.transform * glm::dvec4(vertices[v], 1.0));
        });
    }
    glm::dvec3 low(INFINITY), high(-INFINITY);
    for (const glm::dvec3& place : world) {
        low = glm::min(low, place);
        high = glm::max(high, place);
    }
    patches.centre = 0.5 * (low + high);
    if (!(glm::length(patches.centre) + glm::length(high - low) <= kFarthest)) return false;
    patches.vertices.resize(world.size());
    parallelFor(size_t(0), world.size(),
                [&](size_t v) { patches.vertices[v] = glm::vec3(world[v] - patches.centre); });
    patches.radius = float(0.5 * glm::length(high - low));
    patches.size = patches.finest = patches.radius;
    patches.touchDistance = kTouchOfScene * patches.radius;
    patches.islands = {{glm::vec3(0.0f), patches.radius, patches.radius, patches.size,
                        patches.finest, patches.touchDistance}};
    return true;
}

}  // namespace

Patches wholeFaces(const Scene& scene) {
    std::vector<size_t> firstVertex{0}, firstTriangle{0};
    for (const Instance& instance : scene.instances) {
        const Mesh& mesh = scene.meshes[size_t(instance.mesh)];
        firstVertex.push_back(firstVertex.back() + mesh.vertices.size());
        firstTriangle.push_back(firstTriangle.back() + triangleCount(mesh));
    }
    const size_t count = firstTriangle.back();
    Patches patches;
    if (count == 0 || count > kMostPatches || firstVertex.back() > UINT32_MAX ||
        !placeVertices(scene, firstVertex, patches))
        return Patches();
    parallelInvoke([&] { patches.parents.resize(count); },
                   [&] {
                       patches.cells.resize(count);
                       patches.parentOf.resize(count);
                       patches.area.resize(count);
                   });
    patches.tileCount = count;
    for (uint32_t i = 0; i < scene.instances.size(); ++i) {
        const Faces faces(scene, i, firstVertex[i], firstTriangle[i], patches);
        parallelFor(size_t(0), scene.meshes[size_t(scene.instances[i].mesh)].faceCount(),
                    [&](size_t face) { faces.add(face); });
    }
    for (const float area : patches.area) patches.totalArea += double(area);
    assignOpacity(scene, patches);
    assignMaterials(scene, patches);
    return patches;
}

}  // namespace raybundle
