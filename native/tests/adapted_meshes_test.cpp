// SPDX-License-Identifier: GPL-3.0-or-later
//
// Meshes that follow the light: where they get vertices, how many, and what their light is.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>
#include <numeric>
#include <random>

#include "bake/bake.h"
#include "bake/interim.h"
#include "job/error.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

const glm::dvec3 kToSun = glm::normalize(glm::dvec3(0.6, 0.35, 1));
constexpr double kSun = 2;  // W/m^2 at normal incidence
constexpr float kHalf = 5;  // half the edge of the plane, m
const glm::vec3 kLow{-0.5f, -0.5f, 0}, kHigh{0.5f, 0.5f, 1};

// A black cube on a black plane under a sun: the light of the plane is known.
Scene cubeOnPlane(const glm::dmat4& turn = glm::dmat4(1.0), int cuts = 1, double sunAngle = 0) {
    Scene scene;
    place(scene,
          grid("plane", {-kHalf, -kHalf, 0}, {2 * kHalf, 0, 0}, {0, 2 * kHalf, 0}, cuts, cuts),
          grey("black", 0), turn);
    place(scene, box("cube", kLow, kHigh, false), grey("black", 0), turn);
    scene.addLight(sunLight(glm::dvec3(turn * glm::dvec4(kToSun, 0)), glm::dvec3(kSun), sunAngle));
    return scene;
}

// Returns the irradiance of the plane at a point, W/m^2: that of the sun unless the cube is in the
// way.
double irradianceAt(const glm::dvec3& p) {
    double from = 0, to = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
        const double a = (double(kLow[axis]) - p[axis]) / kToSun[axis],
                     b = (double(kHigh[axis]) - p[axis]) / kToSun[axis];
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
    }
    return from < to ? 0 : kSun * kToSun.z;
}

// Returns the RMS difference of the shown light of the plane from the truth, relative to the RMS of
// the truth, over the plane outside of the cube.
double surfaceError(const Mesh& mesh, const std::vector<glm::vec3>& light) {
    double squares = 0, all = 0;
    auto add = [&](const std::array<int32_t, 3>& corner) {
        std::array<glm::dvec3, 3> at;
        for (size_t k = 0; k < 3; ++k)
            at[k] = mesh.vertices[size_t(mesh.cornerVertices[size_t(corner[k])])];
        const double area = glm::length(glm::cross(at[1] - at[0], at[2] - at[0]));
        constexpr int kCuts = 12;
        for (int i = 0; i < kCuts; ++i)
            for (int j = 0; i + j < kCuts; ++j) {
                const double u = (i + 1.0 / 3) / kCuts, v = (j + 1.0 / 3) / kCuts;
                const glm::dvec3 p = (1 - u - v) * at[0] + u * at[1] + v * at[2];
                if (std::abs(p.x) < 0.5 && std::abs(p.y) < 0.5) continue;
                const double shown = kPi * ((1 - u - v) * double(light[size_t(corner[0])].x) +
                                            u * double(light[size_t(corner[1])].x) +
                                            v * double(light[size_t(corner[2])].x));
                squares += area * std::pow(shown - irradianceAt(p), 2);
                all += area * std::pow(irradianceAt(p), 2);
            }
    };
    for (size_t f = 0; f < mesh.faceCount(); ++f)
        for (int32_t c = mesh.faceOffsets[f] + 2; c < mesh.faceOffsets[f + 1]; ++c)
            add({mesh.faceOffsets[f], c - 1, c});
    return std::sqrt(squares / all);
}

Mesh adaptedMesh(const Bake& bake, const Scene& scene, int32_t instance) {
    return bake.adaptedMesh(instance).withAttributesOf(
        scene.meshes[size_t(scene.instances[size_t(instance)].mesh)]);
}

size_t vertexCount(const Bake& bake, const Scene& scene) {
    size_t count = 0;
    for (int32_t i = 0; i < int32_t(scene.instances.size()); ++i)
        count += bake.adaptedMesh(i).vertices.size();
    return count;
}

struct Measured {
    size_t vertices = 0;
    double error = 0;  // of the plane
};

Measured bakeCubeOnPlane(const Scene& scene, float target, bool adapts, bool findsLines = false) {
    Bake bake;
    bake.settings.targetError = target;
    bake.settings.adaptMeshes = adapts;
    bake.settings.discontinuityLines = findsLines;
    bake.run(scene);
    const Mesh plane = adapts ? adaptedMesh(bake, scene, 0) : scene.meshes[0];
    return {plane.vertices.size(), surfaceError(plane, cornerLight(bake, 0, RB_OUTPUT_LIGHTING))};
}

TEST(AdaptedMeshes, EvenLightNeedsNoVertices) {
    const Scene scene = closedCube(0.5f, 1);
    Bake bake;
    bake.settings.adaptMeshes = 1;
    bake.run(scene);
    const FinerMesh& mesh = bake.adaptedMesh(0);
    EXPECT_EQ(mesh.vertices.size(), scene.meshes[0].vertices.size());
    EXPECT_EQ(mesh.cornerVertices, scene.meshes[0].cornerVertices);
    EXPECT_TRUE(skips(reportOf(bake), SkippedWork::SECOND_PASS));
    Bake kept;
    kept.run(scene);
    EXPECT_LT(difference(cornerLight(bake, 0, RB_OUTPUT_LIGHTING),
                         cornerLight(kept, 0, RB_OUTPUT_LIGHTING)),
              1e-6);
    for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_LIGHTING))
        EXPECT_NEAR(double(light.x), 1 / kPi / (1 - 0.5), 1e-3);
}

// The truth is known. A grid with ten times the vertices has more error: its squares are larger
// than the triangles at the edge of the shadow.
TEST(AdaptedMeshes, AShadowNeedsVerticesAlongItsEdgeAlone) {
    const Scene scene = cubeOnPlane();
    const double kept = bakeCubeOnPlane(scene, 0.02f, false).error;
    EXPECT_GT(kept, 0.1);
    double before = kept;
    for (float target : {0.04f, 0.02f, 0.01f}) {
        const Measured adapted = bakeCubeOnPlane(scene, target, true);
        std::printf("[ figures  ] target %.3f: %zu vertices, error %.4f\n", double(target),
                    adapted.vertices, adapted.error);
        // The edge is harder than any function of linear pieces: its error is 1.1 to 1.6 targets.
        EXPECT_LT(adapted.error, 2 * double(target));
        EXPECT_LT(adapted.error, 0.8 * before);
        before = adapted.error;
        const int cuts = int(std::sqrt(10 * double(adapted.vertices)));
        EXPECT_GT(bakeCubeOnPlane(cubeOnPlane(glm::dmat4(1.0), cuts), target, false).error,
                  adapted.error);
    }
}

TEST(AdaptedMeshes, AreThoseOfTheTurnedScene) {
    const Measured straight = bakeCubeOnPlane(cubeOnPlane(), 0.02f, true);
    for (int k = 0; k < 6; ++k) {
        const glm::dmat4 turn =
            glm::translate(glm::rotate(glm::dmat4(1.0), 0.83 + k, glm::dvec3(0.3, 1, 0.5 + k)),
                           glm::dvec3(40, -70, 20));
        const Measured turned = bakeCubeOnPlane(cubeOnPlane(turn), 0.02f, true);
        // Of two edges of equal length, rounding decides which one is divided first.
        EXPECT_NEAR(double(turned.vertices), double(straight.vertices),
                    0.1 * double(straight.vertices))
            << k;
        EXPECT_NEAR(turned.error, straight.error, 0.15 * straight.error) << k;
    }
}

// A hard shadow with straight edges needs no more than its corners. The error that is left is the
// area between its edges and the edges of triangles, which the search finds to a few thousandths of
// the length of a triangle.
TEST(AdaptedMeshes, AHardShadowNeedsItsCornersAlone) {
    const glm::dmat4 turn = glm::translate(
        glm::rotate(glm::dmat4(1.0), 0.83, glm::dvec3(0.3, 1, 0.5)), glm::dvec3(40, -70, 20));
    for (const glm::dmat4& turned : {glm::dmat4(1.0), turn})
        for (float target : {0.02f, 0.01f, 0.005f}) {
            const Measured lined = bakeCubeOnPlane(cubeOnPlane(turned), target, true, true);
            std::printf("[ figures  ] target %.3f: %zu vertices, error %.5f\n", double(target),
                        lined.vertices, lined.error);
            EXPECT_LT(lined.error, 0.2 * double(target));
            EXPECT_LE(lined.vertices, 40u);
        }
}

// Of a shadow with soft edges, of the size at which lines are in doubt, at most a tenth more
// vertices are used than without lines, and the error is that of the target. The truth is that of
// the hard shadow. The soft one differs from it by w/12 of the squared jump per length, if it is w
// wide: by about 0.6 % for an angle of 0.01, and by 1.8 % for 0.1.
TEST(AdaptedMeshes, SoftShadowsHaveLinesOnlyWhereTheySaveVertices) {
    for (double angle : {0.001, 0.01, 0.03, 0.1})
        for (float target : {0.04f, 0.02f}) {
            const Scene scene = cubeOnPlane(glm::dmat4(1.0), 1, angle);
            const Measured without = bakeCubeOnPlane(scene, target, true),
                           lined = bakeCubeOnPlane(scene, target, true, true);
            std::printf(
                "[ figures  ] angle %.3f, target %.3f: %zu vertices, error %.4f; without "
                "lines %zu, %.4f\n",
                angle, double(target), lined.vertices, lined.error, without.vertices,
                without.error);
            EXPECT_LE(double(lined.vertices), 1.1 * double(without.vertices));
            EXPECT_LT(lined.error, 1.3 * double(target));
        }
}

// No line is known beforehand: whatever the sun's direction, lines must not make the light worse.
TEST(AdaptedMeshes, LinesOfAnySunAreRight) {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> number(-1, 1);
    constexpr float kTarget = 0.02f;
    for (int trial = 0; trial < 12; ++trial) {
        Scene scene;
        place(scene, rectangle("plane", {-6, -6, 0}, {12, 0, 0}, {0, 12, 0}), grey("black", 0));
        for (int k = 0; k < 3; ++k) {
            const glm::vec3 low(3 * number(random), 3 * number(random), k == 0 ? 0.3f : 0.0f);
            const glm::vec3 size(0.2 + 0.8 * std::abs(number(random)),
                                 0.2 + 0.8 * std::abs(number(random)), 0.5 + number(random) / 3);
            place(scene, box("box", low, low + size, false), grey("black", 0),
                  glm::rotate(glm::dmat4(1.0), number(random), glm::dvec3(0, 0, 1)));
        }
        scene.addLight(sunLight(glm::normalize(glm::dvec3(number(random), number(random), 0.8)),
                                glm::dvec3(kSun)));
        std::array<size_t, 2> vertices{};
        for (int lines : {0, 1}) {
            Bake bake;
            bake.settings.targetError = kTarget;
            bake.settings.adaptMeshes = 1;
            bake.settings.discontinuityLines = lines;
            bake.run(scene);
            vertices[size_t(lines)] = bake.adaptedMesh(0).vertices.size();
            // What the mesh loses, as the bake of the mesh itself has measured it.
            const double error = reportOf(bake)["objects"][0]["error"]["mesh"];
            EXPECT_LT(error, 1.5 * double(kTarget)) << trial << ", lines " << lines;
        }
        EXPECT_LE(double(vertices[1]), 1.1 * double(vertices[0])) << trial;
        std::printf("[ figures  ] %d: %zu vertices, %zu without lines\n", trial, vertices[1],
                    vertices[0]);
    }
}

TEST(AdaptedMeshes, KeepTheLimitOfVerticesWithLines) {
    const Scene scene = cubeOnPlane();
    for (int most = 13; most < 40; ++most) {
        Bake bake;
        bake.settings.targetError = 0.005f;
        bake.settings.adaptMeshes = 1;
        bake.settings.maxVertices = most;
        bake.run(scene);
        EXPECT_LE(vertexCount(bake, scene), size_t(most));
    }
}

TEST(AdaptedMeshes, KeepTheLimitOfVertices) {
    const Scene scene = cubeOnPlane();
    for (int most : {40, 41, 42, 43, 99, 100, 150, 151}) {
        Bake bake;
        bake.settings.targetError = 0.005f;
        bake.settings.adaptMeshes = 1;
        bake.settings.discontinuityLines = 0;
        bake.settings.maxVertices = most;
        bake.run(scene);
        EXPECT_LE(vertexCount(bake, scene), size_t(most));
        EXPECT_GT(vertexCount(bake, scene), size_t(most) / 2);
        EXPECT_TRUE(warns(reportOf(bake), WarningId::MAX_VERTICES));
    }
    Bake bake;
    bake.settings.adaptMeshes = 1;
    bake.settings.maxVertices = 5;  // the meshes have 12
    bake.run(scene);
    EXPECT_EQ(vertexCount(bake, scene), 12u);
    EXPECT_TRUE(warns(reportOf(bake), WarningId::MAX_VERTICES));
}

TEST(AdaptedMeshes, AreCountedBeforeOneDecides) {
    const Scene scene = cubeOnPlane();
    Bake bake;
    bake.settings.countAdaptive = 1;
    bake.run(scene);
    const Json before = reportOf(bake);
    const size_t counted = before["adaptive_vertices"];
    EXPECT_EQ(cornerLight(bake, 0, RB_OUTPUT_LIGHTING).size(), 4u);
    bake.settings.adaptMeshes = 1;
    bake.run(scene);
    EXPECT_EQ(vertexCount(bake, scene), counted);
    const Json after = reportOf(bake);
    EXPECT_EQ(size_t(after["adaptive_vertices"]), counted);
    for (int32_t i = 0; i < int32_t(scene.instances.size()); ++i)
        for (const Json& report : {before, after})
            EXPECT_EQ(size_t(report["objects"][size_t(i)]["adaptive_vertices"]),
                      bake.adaptedMesh(i).vertices.size());
}

// Bakes with tiles of 0.5 m, in clusters or face by face.
std::unique_ptr<Bake> bakeDensePlane(const Scene& scene, bool adapts, bool skipsClusters = true) {
    auto bake = std::make_unique<Bake>();
    bake->settings.patchSize = 0.5f;
    bake->settings.adaptMeshes = adapts;
    bake->settings.skipClusters = skipsClusters;
    bake->run(scene);
    return bake;
}

// Compares the adapted plane with that of a bake face by face, where light is known on each face.
// Both choose triangles by shadow rays to points, which are others where meshes differ.
void expectAsFaceByFace(const Bake& adapted, const Scene& scene) {
    const auto faceByFace = bakeDensePlane(scene, true, false);
    auto error = [&](const Bake& bake) {
        return surfaceError(adaptedMesh(bake, scene, 0), cornerLight(bake, 0, RB_OUTPUT_LIGHTING));
    };
    EXPECT_LT(error(adapted), 1.2 * error(*faceByFace));
    EXPECT_LT(double(vertexCount(adapted, scene)), 1.1 * double(vertexCount(*faceByFace, scene)));
    std::printf("[ figures  ] %zu and %zu vertices, error %.4f and %.4f\n",
                vertexCount(adapted, scene), vertexCount(*faceByFace, scene), error(adapted),
                error(*faceByFace));
}

// The faces exchange light in clusters, which know nothing of the edge of the shadow within them.
TEST(AdaptedMeshes, DenseSurfacesGetVerticesAtTheEdgesOfShadowsToo) {
    const Scene scene = cubeOnPlane(glm::dmat4(1.0), 100);
    const auto kept = bakeDensePlane(scene, false), adapted = bakeDensePlane(scene, true);
    EXPECT_LT(size_t(reportOf(*kept)["patches"]), 3000u);
    const double before = surfaceError(scene.meshes[0], cornerLight(*kept, 0, RB_OUTPUT_LIGHTING));
    const double stated = reportOf(*kept)["objects"][0]["error"]["mesh"];
    std::printf("[ figures  ] error %.4f, stated %.4f\n", before, stated);
    EXPECT_GT(before, 0.02);
    // Edges along diagonals of the faces are ramps over two faces, and count less.
    EXPECT_GT(stated, 0.5 * before);
    EXPECT_LT(stated, 1.5 * before);
    EXPECT_LT(
        surfaceError(adaptedMesh(*adapted, scene, 0), cornerLight(*adapted, 0, RB_OUTPUT_LIGHTING)),
        0.02);
    expectAsFaceByFace(*adapted, scene);
    Bake counting;
    counting.settings.patchSize = 0.5f;
    counting.settings.countAdaptive = 1;
    counting.run(scene);
    EXPECT_EQ(size_t(reportOf(counting)["adaptive_vertices"]), vertexCount(*adapted, scene));
}

// The plane as one mesh, one half of which is dense and the other a single face.
TEST(AdaptedMeshes, DenseSurfacesAndLargeFacesAdaptInOneMesh) {
    for (const float denseFrom : {-kHalf, 0.0f}) {
        Scene scene = cubeOnPlane();
        Mesh& plane = scene.meshes[0];
        const int32_t material = plane.faceMaterials.front();
        plane = grid("plane", {denseFrom, -kHalf, 0}, {kHalf, 0, 0}, {0, 2 * kHalf, 0}, 50, 100);
        const Mesh rest = rectangle("rest", {denseFrom < 0 ? 0 : -kHalf, -kHalf, 0}, {kHalf, 0, 0},
                                    {0, 2 * kHalf, 0});
        for (const int32_t v : rest.cornerVertices)
            plane.cornerVertices.push_back(v + int32_t(plane.vertices.size()));
        plane.vertices.insert(plane.vertices.end(), rest.vertices.begin(), rest.vertices.end());
        plane.faceOffsets.push_back(int32_t(plane.cornerVertices.size()));
        plane.faceMaterials.assign(plane.faceCount(), material);
        EXPECT_LT(size_t(reportOf(*bakeDensePlane(scene, false))["patches"]), 3000u);
        expectAsFaceByFace(*bakeDensePlane(scene, true), scene);
    }
}

TEST(AdaptedMeshes, DenseSurfacesKeepMeshesThatShowTheirLight) {
    Scene scene = closedCube(0.5f, 1);
    place(scene, icosphere("ball", 0.3f, 4, false), grey("ball", 0.5f),
          glm::translate(glm::dmat4(1), {0.5, 0.45, 0.55}));
    Bake bake;
    bake.settings.patchSize = 0.1f;
    bake.settings.adaptMeshes = 1;
    bake.run(scene);
    EXPECT_LT(size_t(reportOf(bake)["patches"]), 3000u);
    EXPECT_EQ(bake.adaptedMesh(1).vertices.size(), scene.meshes[1].vertices.size());
}

TEST(AdaptedMeshes, EveryObjectOfAMeshGetsItsOwn) {
    Scene scene;
    const Mesh plane = rectangle("plane", {-2, -2, 0}, {4, 0, 0}, {0, 4, 0});
    place(scene, plane, grey("grey", 0.3f));
    scene.addInstance({"other", 0, glm::translate(glm::dmat4(1.0), glm::dvec3(10, 0, 0))});
    place(scene, box("cube", {-0.5f, -0.5f, 0.5f}, {0.5f, 0.5f, 1}, false), grey("grey", 0.3f));
    scene.addLight(sunLight(kToSun, glm::dvec3(kSun)));
    Bake bake;
    setQuick(bake);
    bake.settings.adaptMeshes = 1;
    bake.settings.discontinuityLines = 0;
    bake.run(scene);
    EXPECT_GT(bake.adaptedMesh(0).vertices.size(), 50u);
    EXPECT_EQ(bake.adaptedMesh(1).vertices.size(), 4u);
}

TEST(AdaptedMeshes, LightOfSetsSumsToTheLight) {
    Scene scene = roomWithBoxes(0.5f);
    scene.addLight(pointLight({1, 1, 2}, glm::dvec3(3)));
    scene.addLight(areaLight({3, 2.5, 2.6}, {0.3, 0, 0}, {0, -0.2, 0}, glm::dvec3(4)));
    scene.lights[0].lightSet = scene.addLightSet("one");
    scene.lights[1].lightSet = scene.addLightSet("two");
    Bake bake;
    setQuick(bake);
    bake.settings.adaptMeshes = 1;
    bake.run(scene);
    const std::vector<glm::vec3> all = cornerLight(bake, 0, RB_OUTPUT_LIGHTING);
    ASSERT_EQ(all.size(), bake.adaptedMesh(0).cornerVertices.size());
    std::vector<glm::vec3> sum = bake.setLight(0, 0).perCorner(RB_OUTPUT_LIGHTING);
    const std::vector<glm::vec3> two = bake.setLight(1, 0).perCorner(RB_OUTPUT_LIGHTING);
    for (size_t c = 0; c < sum.size(); ++c) sum[c] += two[c];
    EXPECT_LT(difference(sum, all), 1e-5);
}

TEST(AdaptedMeshes, DoNotDependOnThreads) {
    std::array<std::vector<glm::vec3>, 2> light;
    for (int threads : {1, 2}) {
        Bake bake;
        setQuick(bake);
        bake.settings.adaptMeshes = 1;
        bake.settings.threads = threads;
        bake.run(litRoom());
        light[size_t(threads - 1)] = everything(bake);
    }
    ASSERT_EQ(light[0].size(), light[1].size());
    EXPECT_LT(difference(light[0], light[1]), 1e-5);
}

// The solve of a second bake starts from the first one, and its light differs by a hundredth of the
// noise. A triangle whose error is at the limit may then be divided or not.
TEST(AdaptedMeshes, OfASecondBakeAreThoseOfAFreshOne) {
    const Scene before = litRoom();
    Scene after = litRoom();
    after.lights[0].position = {1, 1, 2.6};
    Bake again, fresh;
    for (Bake* bake : {&again, &fresh}) {
        setQuick(*bake);
        bake->settings.adaptMeshes = 1;
    }
    again.run(before);
    again.run(after);
    fresh.run(after);
    for (int32_t i = 0; i < 3; ++i) {
        const double count = double(fresh.adaptedMesh(i).vertices.size());
        EXPECT_NEAR(double(again.adaptedMesh(i).vertices.size()), count, 0.05 * count);
    }
    EXPECT_NEAR(indirectPower(again), indirectPower(fresh), 2e-3 * indirectPower(fresh));
    // Without adaptation, the light is that of the meshes as they are.
    again.settings.adaptMeshes = fresh.settings.adaptMeshes = 0;
    Bake kept;
    setQuick(kept);
    again.run(after);
    kept.run(after);
    EXPECT_LT(difference(everything(again), everything(kept)), 1e-5);
    EXPECT_THROW(again.adaptedMesh(0), Error);
}

TEST(AdaptedMeshes, InterimLightIsAtTheCornersOfTheSources) {
    const Scene scene = cubeOnPlane();
    Bake bake;
    Interim interim;
    bake.interim = &interim;
    bake.settings.adaptMeshes = 1;
    struct Reader {
        Interim& interim;
        int32_t seen = 0;
        std::vector<size_t> sizes{};
    } reader{interim};
    bake.progress = Progress(
        [](void* user, rb_stage, double) {
            auto& self = *static_cast<Reader*>(user);
            if (self.interim.count() > self.seen) {
                self.seen = self.interim.count();
                self.sizes.push_back(self.interim.read(0, RB_OUTPUT_LIGHTING).size());
            }
            return true;
        },
        &reader);
    bake.run(scene);
    EXPECT_GT(bake.adaptedMesh(0).cornerVertices.size(), 4u);
    EXPECT_GE(reader.sizes.size(), 2u);
    for (size_t size : reader.sizes) EXPECT_EQ(size, 4u);
}

}  // namespace
}  // namespace raybundle
