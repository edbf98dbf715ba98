// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "reconstruction/least_squares.h"
#include "reconstruction/smooth_regions.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

constexpr float kRegularization = 0.02f;  // the default

// One mesh, cut, with the light of each patch given by a function of its centroid in the world.
class Surface {
  public:
    explicit Surface(Mesh mesh, float patchSize, const Material& material = grey("", 0.5f)) {
        place(scene, std::move(mesh), material);
        cut(patchSize);
    }
    Surface(Scene given, float patchSize) : scene(std::move(given)) { cut(patchSize); }

    const Mesh& mesh() const { return scene.meshes[0]; }
    glm::vec3 position(size_t corner) const {
        return mesh().vertices[size_t(mesh().cornerVertices[corner])];
    }

    // Value of each corner, reconstructed from light(centroid, normal) on every front.
    std::vector<glm::vec3> reconstruct(const std::function<glm::vec3(glm::vec3, glm::vec3)>& light,
                                       float regularization = kRegularization) const {
        std::vector<glm::vec3> field(patches.sideCount(), glm::vec3(0));
        for (uint32_t p = 0; p < patches.count(); ++p) {
            const bool isTriangle = patches.parents[patches.parentOf[p]].isTriangle;
            const glm::vec2 uv = isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
            field[2 * p] = light(glm::vec3(glm::dvec3(patches.point(p, uv)) + patches.centre),
                                 patches.normal(2 * p));
        }
        return reconstruct(field, regularization);
    }

    std::vector<glm::vec3> reconstruct(const std::vector<glm::vec3>& field,
                                       float regularization) const {
        const InstanceRange range{0, uint32_t(patches.cells.size()), 0,
                                  uint32_t(patches.parents.size())};
        const SmoothRegions regions = smoothRegions(mesh(), patches.cells, 0, range.lastCell);
        const auto nodes =
            leastSquares(patches, range, regions, RB_SIDE_FRONT, exposed, regularization, {&field});
        std::vector<glm::vec3> corners;
        for (uint32_t node : regions.nodeOf) corners.push_back(nodes[0][node]);
        return corners;
    }

    Scene scene;
    Patches patches;
    std::vector<float> exposed;  // per side

  private:
    void cut(float patchSize) {
        patches = subdivide(scene, patchSize, kMany);
        exposed.assign(patches.sideCount(), 1.0f);
    }
};

// The same grid with every quad cut in two, diagonals in both ways.
Mesh triangulated(const Mesh& quads) {
    std::vector<std::vector<int32_t>> faces;
    for (size_t f = 0; f < quads.faceCount(); ++f) {
        const int32_t* c = quads.cornerVertices.data() + 4 * f;
        if (f % 2)
            faces.insert(faces.end(), {{c[0], c[1], c[2]}, {c[0], c[2], c[3]}});
        else
            faces.insert(faces.end(), {{c[0], c[1], c[3]}, {c[1], c[2], c[3]}});
    }
    return polygons(quads.name, quads.vertices, faces);
}

Mesh plane(int n) { return grid("plane", {0, 0, 0}, {2, 0, 0}, {0, 1, 0}, n, n); }

TEST(Reconstruction, ConstantLightStaysConstant) {
    for (const Mesh& mesh :
         {plane(1), plane(5), triangulated(plane(4)), box("box", {0, 0, 0}, {1, 1, 1}, true),
          icosphere("ball", 1, 2, false),
          polygons("L", {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}},
                   {{0, 1, 2, 3, 4, 5}})})
        for (float patchSize : {0.07f, 0.5f, 10.0f})
            for (const glm::vec3& v : Surface(mesh, patchSize).reconstruct([](auto, auto) {
                     return glm::vec3(3, 1, 0.2f);
                 }))
                ASSERT_LT(glm::distance(v, {3, 1, 0.2f}), 1e-4f)
                    << mesh.name << ", patch size " << patchSize;
}

TEST(Reconstruction, LinearLightIsExactUpToTheBorder) {
    auto linear = [](glm::vec3 at, glm::vec3) {
        return glm::vec3(1 + at.x, 2 - 0.5f * at.x + at.y, 0.1f + 0.2f * at.y);
    };
    for (float regularization : {0.0f, kRegularization, 1.0f})
        for (const Mesh& mesh : {plane(1), plane(5), triangulated(plane(4))}) {
            const Surface surface(mesh, 0.06f);
            const std::vector<glm::vec3> found = surface.reconstruct(linear, regularization);
            for (size_t c = 0; c < found.size(); ++c)
                ASSERT_LT(glm::distance(found[c], linear(surface.position(c), {})), 1e-4f)
                    << (surface.patches.cells[0].isTriangle() ? "triangles" : "quads") << " at "
                    << surface.position(c).x << ", " << surface.position(c).y << ", regularization "
                    << regularization;
        }
}

TEST(Reconstruction, SharpEdgesKeepEachFacesOwnLight) {
    const Surface surface(box("box", {0, 0, 0}, {1, 1, 1}, true), 0.2f);
    const std::vector<glm::vec3> found =
        surface.reconstruct([](glm::vec3, glm::vec3 normal) { return 2.0f + normal; });
    for (size_t c = 0; c < found.size(); ++c) {
        const Cell& cell = surface.patches.cells[c / 4];
        EXPECT_LT(glm::distance(found[c], 2.0f + glm::normalize(glm::cross(cell.a, cell.b))),
                  1e-4f);
    }
}

TEST(Reconstruction, MaterialBordersAreNotAveraged) {
    Scene scene;
    Mesh mesh = plane(4);
    scene.addMaterial(grey("left", 0.5f));
    scene.addMaterial(grey("right", 0.5f));
    for (size_t f = 0; f < mesh.faceCount(); ++f) mesh.faceMaterials.push_back(f % 4 < 2 ? 0 : 1);
    scene.addInstance({"plane", scene.addMesh(mesh), glm::dmat4(1), RB_ROLE_BAKE, RB_SIDE_FRONT});
    const Surface surface(scene, 0.1f);
    const std::vector<glm::vec3> found =
        surface.reconstruct([](glm::vec3 at, glm::vec3) { return glm::vec3(at.x < 1 ? 1 : 5); });
    for (size_t c = 0; c < found.size(); ++c)
        EXPECT_NEAR(found[c].x, (c / 4) % 4 < 2 ? 1 : 5, 1e-4) << "corner " << c;
}

TEST(Reconstruction, CornersOfASmoothVertexAgree) {
    Mesh ball = icosphere("ball", 1, 2, false);
    for (int32_t v : ball.cornerVertices)
        ball.cornerNormals.push_back(glm::normalize(ball.vertices[size_t(v)]));
    const Surface smooth(ball, 0.05f);
    const std::vector<glm::vec3> found =
        smooth.reconstruct([](glm::vec3 at, glm::vec3) { return glm::vec3(2.0f + at.z); });
    std::vector<float> first(ball.vertices.size(), -1);
    for (size_t c = 0; c < found.size(); ++c) {
        float& of = first[size_t(ball.cornerVertices[c])];
        if (of < 0) of = found[c].x;
        ASSERT_EQ(found[c].x, of) << "corners of one smooth vertex share a value";
        // Light is linear in space, the facets are flat: off by the facets' sagitta, 0.02.
        ASSERT_NEAR(found[c].x, 2 + smooth.position(c).z, 0.04);
    }
    // Without normals facets are flat-shaded, and their corners are independent.
    ball.cornerNormals.clear();
    const Surface flat(ball, 0.05f);
    const SmoothRegions regions =
        smoothRegions(flat.mesh(), flat.patches.cells, 0, uint32_t(flat.patches.cells.size()));
    EXPECT_EQ(regions.nodeCount, flat.mesh().cornerCount());
}

TEST(Reconstruction, ASharpEdgeAmongSmoothOnesSplitsItsVerticesOnly) {
    // A roof over a ridge along x: normals smooth at the end where they agree, sharp where they do
    // not.
    Mesh roof =
        polygons("roof", {{0, -1, 0}, {1, -1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 0}, {1, 1, 0}},
                 {{0, 1, 3, 2}, {2, 3, 5, 4}});
    const glm::vec3 left = glm::normalize(glm::vec3(0, -1, 1)),
                    right = glm::normalize(glm::vec3(0, 1, 1)), up(0, 0, 1);
    roof.cornerNormals = {left, left, left, up, up, left, right, right};
    roof.cornerNormals[5] = right;  // vertex 3 in the second face: disagrees with `left`
    roof.cornerNormals[2] = left;
    const Surface surface(roof, 0.2f);
    const SmoothRegions regions = smoothRegions(surface.mesh(), surface.patches.cells, 0,
                                                uint32_t(surface.patches.cells.size()));
    EXPECT_EQ(regions.nodeOf[3], regions.nodeOf[4]) << "vertex 2: both say up";
    EXPECT_NE(regions.nodeOf[2], regions.nodeOf[5]) << "vertex 3: left and right";
    EXPECT_EQ(regions.nodeCount, 7u);
}

TEST(Reconstruction, NonManifoldAndTurnedNeighboursAreNotJoined) {
    // Three coplanar-looking fins on one edge, and two faces that turn against each other.
    const Mesh fins = polygons(
        "fins",
        {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {1, 0, 1}, {-1, 0, 0}, {-1, 0, 1}, {0, 1, 0}, {0, 1, 1}},
        {{0, 2, 3, 1}, {4, 0, 1, 5}, {0, 6, 7, 1}});
    const Mesh turned =
        polygons("turned", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {2, 1, 0}},
                 {{0, 1, 2, 3}, {1, 2, 5, 4}});
    for (const Mesh& mesh : {fins, turned}) {
        const Surface surface(mesh, 0.2f);
        const SmoothRegions regions = smoothRegions(surface.mesh(), surface.patches.cells, 0,
                                                    uint32_t(surface.patches.cells.size()));
        EXPECT_EQ(regions.nodeCount, mesh.cornerCount()) << mesh.name;
        EXPECT_TRUE(regions.edges.empty()) << mesh.name;
    }
}

TEST(Reconstruction, CornersOfDegenerateFacesAreZero) {
    const Surface surface(
        polygons("broken", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}},
                 {{0, 1, 2}, {3, 4, 5}}),
        0.2f);
    const std::vector<glm::vec3> found =
        surface.reconstruct([](auto, auto) { return glm::vec3(2); });
    for (size_t c = 0; c < 3; ++c) EXPECT_LT(glm::distance(found[c], glm::vec3(2)), 1e-4f);
    for (size_t c = 3; c < 6; ++c) EXPECT_EQ(found[c], glm::vec3(0));
}

TEST(Reconstruction, CoveredPatchesDoNotCount) {
    Surface surface(plane(6), 0.05f);
    std::vector<glm::vec3> field(surface.patches.sideCount(), glm::vec3(1));
    for (uint32_t p = 0; p < surface.patches.count(); ++p) {
        const glm::dvec3 at =
            glm::dvec3(surface.patches.point(p, {0.5f, 0.5f})) + surface.patches.centre;
        if (std::abs(at.x - 1) > 0.4 || std::abs(at.y - 0.5) > 0.2) continue;
        surface.exposed[2 * p] = 0;
        field[2 * p] = glm::vec3(0);
    }
    const std::vector<glm::vec3> found = surface.reconstruct(field, kRegularization);
    for (size_t c = 0; c < found.size(); ++c) {
        EXPECT_TRUE(std::isfinite(found[c].x));
        // The vertex in the middle is covered all around; nobody sees its value.
        const bool isSeen = glm::distance(surface.position(c), {1, 0.5f, 0}) > 0.1f;
        EXPECT_NEAR(isSeen ? found[c].x : 1, 1, 0.01) << "a dark contact leaks out";
    }
}

TEST(Reconstruction, NothingIsNegativeOrBrighterThanTheLight) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(0, 1);
    Surface surface(triangulated(plane(8)), 0.05f);
    std::vector<glm::vec3> steps(surface.patches.sideCount());
    for (glm::vec3& v : steps) v = glm::vec3(uniform(random) < 0.1f ? 10 : 0, uniform(random), 0);
    for (const glm::vec3& v : surface.reconstruct(steps, kRegularization)) {
        EXPECT_TRUE(v.x >= 0 && v.y >= 0);
        EXPECT_EQ(v.z, 0);
        EXPECT_LE(v.x, 20) << "overshoots by more than the step itself";
    }
}

TEST(Reconstruction, TheMeanOverTheSurfaceIsKept) {
    // Least squares without regularisation is orthogonal to constants, up to what clamping takes.
    const Surface surface(plane(6), 0.05f);
    auto light = [](glm::vec3 at, glm::vec3) {
        return glm::vec3(2 + std::sin(3 * at.x) * std::cos(5 * at.y));
    };
    double wanted = 0, found = 0;
    for (uint32_t p = 0; p < surface.patches.count(); ++p)
        wanted += double(surface.patches.area[p]) *
                  double(light(glm::vec3(glm::dvec3(surface.patches.point(p, {0.5f, 0.5f})) +
                                         surface.patches.centre),
                               {})
                             .x);
    const std::vector<glm::vec3> corners = surface.reconstruct(light, 0);
    for (size_t c = 0; c < corners.size(); ++c) found += double(corners[c].x) * (2.0 / 36) / 4;
    EXPECT_NEAR(found, wanted, 1e-3 * wanted);
}

}  // namespace
}  // namespace raybundle
