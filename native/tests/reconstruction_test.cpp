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

constexpr float kRegularization = 0.02f;  // stronger than the default

// A subdivided mesh. The light of each patch is a function of its centroid in world space.
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

    // Returns the value at each corner, reconstructed from light(centroid, normal) on every front.
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
        const LeastSquaresFit fit = leastSquares(
            {patches, exposed}, {range, regions, RB_SIDE_FRONT}, regularization, {&field});
        std::vector<glm::vec3> corners;
        EXPECT_TRUE(fit.isSolved);
        for (uint32_t node : regions.nodeOf) corners.push_back(fit.fields[0][node]);
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

// Returns the grid with every quad divided in two, with diagonals in both directions.
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

double areaOf(const Cell& cell) {
    return double(glm::length(glm::cross(cell.a, cell.b))) * (cell.isTriangle() ? 0.5 : 1.0);
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
        // The light is linear in space, but the facets are flat and off by their sagitta, 0.02.
        ASSERT_NEAR(found[c].x, 2 + smooth.position(c).z, 0.04);
    }
    // Without shading normals facets are flat-shaded, and their corners are independent.
    ball.cornerNormals.clear();
    const Surface flat(ball, 0.05f);
    const SmoothRegions regions =
        smoothRegions(flat.mesh(), flat.patches.cells, 0, uint32_t(flat.patches.cells.size()));
    EXPECT_EQ(regions.nodeCount, flat.mesh().cornerCount());
}

TEST(Reconstruction, ASharpEdgeAmongSmoothOnesSplitsItsVerticesOnly) {
    // A roof over a ridge along x. The edge is smooth at the end where the normals agree, and sharp
    // where they do not.
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
    // Three fins at one edge that look coplanar, and two faces with opposite winding.
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
        // The vertex in the centre is covered all around, and its value is not visible.
        const bool isSeen = glm::distance(surface.position(c), {1, 0.5f, 0}) > 0.1f;
        EXPECT_NEAR(isSeen ? found[c].x : 1, 1, 0.01) << "a dark contact leaks out";
    }
}

// Returns the integral over all patches of the light interpolated between the corners, W.
glm::dvec3 integral(const Surface& surface, const std::vector<glm::vec3>& corners) {
    glm::dvec3 sum(0.0);
    for (uint32_t p = 0; p < surface.patches.count(); ++p) {
        const Parent& parent = surface.patches.parents[surface.patches.parentOf[p]];
        const Cell& cell = surface.patches.cells[parent.cell];
        const glm::vec2 uv = parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
        const std::array<float, 4> weights = cell.weights(surface.patches.point(p, uv));
        for (int k = 0; k < (cell.isTriangle() ? 3 : 4); ++k)
            sum += double(surface.patches.area[p] * weights[size_t(k)]) *
                   glm::dvec3(corners[size_t(cell.corner[size_t(k)])]);
    }
    return sum;
}

glm::dvec3 integral(const Surface& surface, const std::function<glm::vec3(uint32_t)>& ofPatch) {
    glm::dvec3 sum(0.0);
    for (uint32_t p = 0; p < surface.patches.count(); ++p)
        sum += double(surface.patches.area[p]) * glm::dvec3(ofPatch(p));
    return sum;
}

// Light like that of a lamp close to a wall: a single bright patch, or some bright faces, among
// dark ones; beside even and random light.
std::vector<glm::vec3> hotSpots(const Surface& surface) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<glm::vec3> field(surface.patches.sideCount(), glm::vec3(0));
    for (uint32_t p = 0; p < surface.patches.count(); ++p)
        field[2 * p] = {p == surface.patches.count() / 3 ? 1000 : 0.1f,
                        uniform(random) < 0.1f ? 10 : 0, 5 + uniform(random)};
    return field;
}

std::vector<Surface> surfacesOfAllKinds() {
    Mesh ball = icosphere("ball", 1, 2, false);
    for (int32_t v : ball.cornerVertices)
        ball.cornerNormals.push_back(glm::normalize(ball.vertices[size_t(v)]));
    std::vector<Surface> surfaces;
    for (const Mesh& mesh : {plane(1), plane(6), plane(12), triangulated(plane(8)), ball})
        for (float patchSize : {0.05f, 0.5f}) surfaces.emplace_back(mesh, patchSize);
    return surfaces;
}

TEST(Reconstruction, NothingLeavesTheRangeOfTheLightAround) {
    for (const Surface& surface : surfacesOfAllKinds()) {
        const std::vector<glm::vec3> field = hotSpots(surface);
        for (const glm::vec3& v : surface.reconstruct(field, kRegularization)) {
            ASSERT_TRUE(v.x >= 0 && v.y >= 0 && v.z >= 4.4f) << "at " << surface.mesh().name;
            ASSERT_TRUE(v.x <= 1200.1f && v.y <= 12.1f && v.z <= 6.6f) << surface.mesh().name;
        }
    }
}

TEST(Reconstruction, TheMeanIsKeptWhateverTheLight) {
    for (const Surface& surface : surfacesOfAllKinds())
        for (float regularization : {0.0f, kRegularization, 1.0f}) {
            const std::vector<glm::vec3> field = hotSpots(surface);
            const glm::dvec3 wanted = integral(surface, [&](uint32_t p) { return field[2 * p]; }),
                             found = integral(surface, surface.reconstruct(field, regularization));
            for (int c = 0; c < 3; ++c)
                ASSERT_NEAR(found[c], wanted[c], 1e-4 * wanted[c])
                    << surface.mesh().name << ", channel " << c << ", " << surface.patches.count()
                    << " patches, regularization " << regularization;
        }
}

TEST(Reconstruction, FacesWithoutHeightChangeNothing) {
    // A grid of 12 x 12 whose odd columns are divided in two, with thin triangles that fill the
    // T-junctions. The light equals that with triangles of a height of 1e-2 of the edge, within a
    // tenth of its step, because the faces beside them are divided in another way.
    auto floorOf = [](float ratio) {
        Mesh mesh = floorWithSlivers(12, ratio);
        mesh.cornerNormals.assign(mesh.cornerVertices.size(), glm::vec3(0, 0, 1));
        return Surface(mesh, 0.3f);
    };
    auto light = [](glm::vec3 at, glm::vec3) {
        return glm::vec3(glm::distance(at, {6, 6, 0}) < 2 ? 0.3f : 1.3f);
    };
    auto onQuads = [](const Surface& surface, const std::vector<glm::vec3>& corners) {
        std::vector<float> values;
        for (const Cell& cell : surface.patches.cells)
            if (areaOf(cell) > 0.9)
                for (int k = 0; k < (cell.isTriangle() ? 3 : 4); ++k)
                    values.push_back(corners[size_t(cell.corner[size_t(k)])].x);
        return values;
    };
    const Surface fine = floorOf(1e-2f);
    const std::vector<float> wanted = onQuads(fine, fine.reconstruct(light));
    for (float ratio : {1e-3f, 1e-4f, 1e-5f, 1e-6f}) {
        const Surface surface = floorOf(ratio);
        const std::vector<float> found = onQuads(surface, surface.reconstruct(light));
        ASSERT_EQ(found.size(), wanted.size());
        for (size_t k = 0; k < found.size(); ++k)
            ASSERT_NEAR(found[k], wanted[k], 0.1) << "ratio " << ratio;
    }
}

// Exposure is measured by lines, and the light at corners must change continuously with it. Bounds
// from patches that are half covered, or nearly open, used to appear and disappear. Beside light of
// 1 to 2 W/m^2 a row of patches is dark or brighter; its exposed share grows by a hundredth per
// step.
TEST(Reconstruction, CornersFollowExposure) {
    for (const float rowLight : {0.0f, 3.0f}) {
        Surface surface(grid("floor", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 2, 2), 0.125f);
        auto cornersAt = [&](float share) {
            std::vector<glm::vec3> field(surface.patches.sideCount());
            for (uint32_t p = 0; p < surface.patches.count(); ++p) {
                const glm::vec3 at(glm::dvec3(surface.patches.point(p, {0.5f, 0.5f})) +
                                   surface.patches.centre);
                const bool isInRow = at.y > 0.5f && at.y < 0.75f;
                field[2 * p] = glm::vec3(isInRow ? rowLight : 1 + at.x);
                surface.exposed[2 * p] = isInRow ? share : at.y > 0.75f ? 0.0f : 1.0f;
            }
            return surface.reconstruct(field, kRegularization);
        };
        float most = 0;
        std::vector<glm::vec3> before = cornersAt(0.05f);
        for (int k = 6; k <= 100; ++k) {
            const std::vector<glm::vec3> now = cornersAt(0.01f * float(k));
            for (size_t c = 0; c < now.size(); ++c)
                most = std::max(most, std::abs(now[c].x - before[c].x));
            before = now;
        }
        // Measured 0.16. It was 0.47 and 0.38 when half-covered patches were ignored.
        EXPECT_LT(most, 0.25f) << "row of " << rowLight;
    }
}

}  // namespace
}  // namespace raybundle
