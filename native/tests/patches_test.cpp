// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/patches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "job/error.h"
#include "patches/patch_size.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

Patches subdivided(Mesh mesh, float size, const glm::dmat4& transform = glm::dmat4(1)) {
    Scene scene;
    place(scene, std::move(mesh), grey("grey", 0.5f), transform);
    return subdivide(scene, size, kMany);
}

double patchArea(const Patches& patches) {
    double sum = 0;
    for (float area : patches.area) sum += area;
    return sum;
}

Parent parentWithGrid(bool isTriangle, int countA, int countB) {
    Parent parent;
    parent.origin = {0.1f, -0.2f, 0.3f};
    parent.a = {1.7f, 0.2f, 0.1f};
    parent.b = {0.3f, 1.1f, -0.4f};
    parent.isTriangle = isTriangle;
    parent.countA = uint16_t(countA);
    parent.countB = uint16_t(countB);
    return parent;
}

TEST(Patches, AreasOfQuadsTrianglesAndConcaveFacesAreConserved) {
    const Mesh mesh = polygons("shapes",
                               {{0, 0, 0},
                                {2, 0, 0},
                                {2, 3, 0},
                                {0, 3, 0},  // rectangle
                                {5, 0, 0},
                                {6, 0, 0},
                                {5, 2, 0},  // triangle
                                {0, 0, 1},
                                {3, 0, 1},
                                {3, 1, 1},
                                {1, 1, 1},
                                {1, 2, 1},
                                {0, 2, 1},  // L
                                {0, 0, 2},
                                {3, 0, 2},
                                {1, 1, 2},
                                {0, 3, 2}},  // arrow
                               {{0, 1, 2, 3}, {4, 5, 6}, {7, 8, 9, 10, 11, 12}, {13, 14, 15, 16}});
    const double exact = 6 + 1 + 4 + 3;
    for (float size : {10.0f, 0.5f, 0.07f}) {
        const Patches patches = subdivided(mesh, size);
        EXPECT_NEAR(patchArea(patches), exact, 1e-5 * exact) << "patch size " << size;
        EXPECT_NEAR(patches.totalArea, exact, 1e-5 * exact) << "patch size " << size;
    }
}

TEST(Patches, ANonPlanarQuadHasTheAreaOfItsTwoTriangles) {
    const std::vector<glm::vec3> v = {{0, 0, 0}, {1, 0, 0.3f}, {1, 1, 0}, {0, 1, 0.2f}};
    auto area = [&](int a, int b, int c) {
        return 0.5 * double(glm::length(
                         glm::cross(v[size_t(b)] - v[size_t(a)], v[size_t(c)] - v[size_t(a)])));
    };
    const double one = area(0, 1, 2) + area(0, 2, 3), other = area(0, 1, 3) + area(1, 2, 3);
    const double found = patchArea(subdivided(polygons("bent", v, {{0, 1, 2, 3}}), 0.1f));
    EXPECT_LT(std::min(std::abs(found - one), std::abs(found - other)), 1e-5);
}

TEST(Patches, ScaledAndMirroredInstancesKeepAreaAndFronts) {
    for (double mirror : {1.0, -1.0}) {
        const glm::dmat4 transform = glm::scale(
            glm::rotate(glm::dmat4(1), 0.7, glm::dvec3(1, 2, 3)), glm::dvec3(2 * mirror, 3, 0.5));
        const Patches patches =
            subdivided(box("box", {-1, -1, -1}, {1, 1, 1}, true), 0.3f, transform);
        const double exact = 2 * (4.0 * 6 + 4.0 * 1 + 6.0 * 1);
        EXPECT_NEAR(patchArea(patches), exact, 1e-5 * exact);
        for (uint32_t p = 0; p < patches.count(); ++p)
            ASSERT_LT(glm::dot(patches.normal(2 * p), patches.point(p, {0.3f, 0.3f})), 0)
                << "the front of an inward box looks to its centre, mirror " << mirror;
    }
}

TEST(Patches, PatchAtFindsThePatchOfEveryPoint) {
    for (bool isTriangle : {true, false})
        for (int countA : {1, 2, 3, 5, 7, 10, 31, 64, 100, 333, 1021, 4095, 4096}) {
            const int countB = isTriangle ? countA : 1 + countA / 3;
            const Parent parent = parentWithGrid(isTriangle, countA, countB);
            const uint32_t step = 1 + parent.patchCount() / 100000;
            for (uint32_t k = 0; k < parent.patchCount(); k += step)
                for (glm::vec2 uv : kInside) {
                    const glm::vec2 st = parent.pointOn(k, uv);
                    ASSERT_EQ(parent.patchAt(st.x, st.y), k) << countA << " x " << countB;
                }
        }
}

TEST(Patches, PatchAtClampsToTheParent) {
    for (bool isTriangle : {true, false}) {
        const Parent parent = parentWithGrid(isTriangle, 10, 10);
        for (float s : {-1e-6f, -3.0f, 0.0f, 0.5f, 1.0f, 1.000001f, 4.0f})
            for (float t : {-1e-6f, -3.0f, 0.0f, 0.5f, 1.0f, 1.000001f, 4.0f})
                EXPECT_LT(parent.patchAt(s, t), parent.patchCount());
    }
}

TEST(Patches, PatchAtFindsThePatchOfAPointInTheWorld) {
    // A skewed sliver, a long strip and a plain triangle: parents on which float coordinates are
    // inaccurate.
    const Mesh mesh = polygons("hard",
                               {{0, 0, 0},
                                {1, 0, 0},
                                {1.9f, 0.2f, 0},
                                {0.9f, 0.2f, 0},
                                {0, 0, 1},
                                {300, 0, 1},
                                {300, 0.7f, 1},
                                {0, 0.7f, 1},
                                {0, 0, 2},
                                {7, 1, 2},
                                {2, 5, 3}},
                               {{0, 1, 2, 3}, {4, 5, 6, 7}, {8, 9, 10}});
    const Patches patches = subdivided(mesh, 0.11f);
    for (uint32_t p = 0; p < patches.count(); ++p)
        for (glm::vec2 uv : kInside)
            ASSERT_EQ(patches.patchAt(patches.parentOf[p], patches.point(p, uv)), p);
}

TEST(Patches, PatchesOfAParentHaveEqualArea) {
    for (bool isTriangle : {true, false})
        for (int count : {1, 3, 10, 100}) {
            const Parent parent = parentWithGrid(isTriangle, count, count);
            const double wanted = double(parent.area()) / parent.patchCount();
            for (uint32_t k = 0; k < parent.patchCount(); ++k) {
                const glm::vec3 p = parent.position(parent.pointOn(k, {0, 0}));
                const glm::vec3 q = parent.position(parent.pointOn(k, {1, 0}));
                const glm::vec3 r = parent.position(parent.pointOn(k, {0, 1}));
                const double area =
                    glm::length(glm::cross(q - p, r - p)) * (isTriangle ? 0.5 : 1.0);
                ASSERT_NEAR(area, wanted, 1e-3 * wanted);
            }
        }
}

TEST(Patches, MaxPatchesIsAnUpperBound) {
    Scene scene = roomWithBoxes(0.5f);
    const double exact = subdivide(scene, 10, kMany).totalArea;
    for (size_t most : {size_t(100), size_t(1000), size_t(20000)}) {
        const Patches patches = subdivide(scene, 0.01f, most);
        EXPECT_LE(patches.count(), most);
        EXPECT_GT(patches.count(), most / 3) << "coarser than it needs to be";
        EXPECT_NEAR(patchArea(patches), exact, 1e-5 * exact);
    }
    const Patches fewest = subdivide(scene, 0.01f, 1);
    EXPECT_EQ(fewest.count(), fewest.parents.size()) << "a parent keeps one patch";
}

// If a ground of one face were one patch, the shadow of a dense object on it would be lost.
TEST(Patches, SmallFacesLeavePatchesToALargeOne) {
    Scene scene;
    place(scene, grid("prop", {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, 50, 50), grey("grey", 0.5f));
    place(scene, grid("ground", {-8, -8, 0}, {16, 0, 0}, {0, 16, 0}, 1, 1), grey("grey", 0.5f));
    for (size_t most : {size_t(800), size_t(2400), size_t(2600)}) {
        const Patches patches = subdivide(scene, 0.1f, most);
        const size_t ofGround = patches.count() - 2500;
        EXPECT_LE(ofGround, most / 8);
        EXPECT_GT(ofGround, most / 20);
    }
}

TEST(Patches, ElongatedTrianglesAreBisected) {
    const float size = 0.5f;
    const Patches patches =
        subdivided(polygons("sliver", {{0, 0, 0}, {100, 0, 0}, {50, 1, 0}}, {{0, 1, 2}}), size);
    EXPECT_NEAR(patchArea(patches), 50, 1e-4 * 50);
    EXPECT_LT(patches.count(), 2000u) << "a grid of slivers would have 10000";
    for (const Parent& parent : patches.parents) {
        const float longest = std::max(
            {glm::length(parent.a), glm::length(parent.b), glm::length(parent.b - parent.a)});
        const float height = 2 * parent.area() / longest;
        EXPECT_TRUE(longest <= 4.01f * height || longest <= 2.01f * size);
    }
}

TEST(Patches, DegenerateFacesAreLeftOutAndTheirObjectIsNamed) {
    const Mesh mesh =
        polygons("broken", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {3, 0, 0}, {1, 0, 0}},
                 {{0, 1, 2}, {0, 1, 3}, {0, 3, 4, 1}, {1, 5, 2}});
    const Patches patches = subdivided(mesh, 0.3f);
    EXPECT_EQ(patches.degenerateFaces, 3u);
    EXPECT_NEAR(patchArea(patches), 0.5, 1e-6);
    ASSERT_EQ(patches.warnings.size(), 1u);
    EXPECT_NE(patches.warnings[0].text.find("broken"), std::string::npos)
        << patches.warnings[0].text;
    EXPECT_NE(patches.warnings[0].text.find('3'), std::string::npos) << patches.warnings[0].text;
}

TEST(Patches, CoordinatesThatAreNotFiniteAreRejectedByName) {
    for (float bad : {NAN, INFINITY, -INFINITY}) {
        Scene scene;
        Mesh mesh = rectangle("crooked", {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
        mesh.vertices[2].y = bad;
        try {
            scene.addMesh(std::move(mesh));
            ADD_FAILURE() << "accepted " << bad;
        } catch (const Error& error) {
            EXPECT_EQ(error.code, RB_ERROR_INVALID_ARGUMENT);
            EXPECT_NE(std::string(error.what()).find("crooked"), std::string::npos) << error.what();
        }
        EXPECT_TRUE(scene.meshes.empty());
    }
}

TEST(Patches, AScenesDistanceFromTheOriginDoesNotMatter) {
    const Mesh mesh = box("far", {0, 0, 0}, {1, 1, 1}, true);
    const Patches near = subdivided(mesh, 0.1f);
    const Patches far =
        subdivided(mesh, 0.1f, glm::translate(glm::dmat4(1), glm::dvec3(1e5, -1e5, 2e5 + 0.3)));
    ASSERT_EQ(near.count(), far.count());
    for (uint32_t p = 0; p < near.count(); ++p) {
        ASSERT_NEAR(far.area[p], near.area[p], 1e-6f * near.area[p]);
        ASSERT_LT(glm::distance(far.point(p, {0.5f, 0.5f}), near.point(p, {0.5f, 0.5f})), 1e-5f);
    }
}

TEST(PatchSize, TinyGroupsInAVastSceneGetTheirOwn) {
    auto cube = [](const glm::dvec3& at, double edge) {
        Surface surface;
        surface.extent.add(at);
        surface.extent.add(at + edge);
        surface.area = 6 * edge * edge;
        surface.faces = 6;
        return surface;
    };
    // A plain, a house with a chair in it, another house 200 m away, and a separate tree of 3 m.
    std::vector<Surface> objects(1);
    objects[0].extent.add({-500, -500, 0});
    objects[0].extent.add({500, 500, 0});
    objects[0].area = 1e6;
    objects[0].faces = 100000;
    for (const Surface& surface :
         {cube({0, 0, 0}, 8), cube({2, 2, 0}, 1), cube({200, 0, 0}, 8), cube({0, 300, 0}, 3)}) {
        objects.push_back(surface);
        objects.back().object = uint32_t(objects.size());
    }
    const std::vector<double> sizes = automaticPatchSizes(objects).size;
    auto alone = [&](size_t k) { return objects[k].extent.diagonal() / 64; };
    const double plain = alone(0), house = alone(1);
    EXPECT_NEAR(sizes[0], plain, 1e-3 * plain);
    EXPECT_GE(sizes[1], house);
    EXPECT_LT(sizes[1], 2 * house);
    EXPECT_EQ(sizes[2], sizes[1]) << "a chair that is no more than tiny in its house";
    EXPECT_EQ(sizes[3], sizes[1]);
    EXPECT_NEAR(sizes[4], alone(4), 1e-9);
}

TEST(PatchSize, ObjectsOfASceneOfTheirSizeHaveOneSize) {
    std::vector<Surface> objects(3);
    objects[0].extent.add({0, 0, 0});
    objects[0].extent.add({6, 5, 3});
    objects[1].extent.add({1, 1, 0});
    objects[1].extent.add({2, 2, 1});
    objects[2].extent.add({4, 1, 0});
    objects[2].extent.add({4.4, 1.4, 0.5});
    for (uint32_t k = 0; k < 3; ++k) objects[k].object = k;
    const double wanted = objects[0].extent.diagonal() / 64;
    for (double size : automaticPatchSizes(objects).size) EXPECT_EQ(size, wanted);
}

TEST(Reflectance, AnImageOfACheckerAveragesExactly) {
    constexpr int kPixels = 8;
    Image image{"checker", kPixels, kPixels, RB_IMAGE_REPEAT, {}};
    for (int y = 0; y < kPixels; ++y)
        for (int x = 0; x < kPixels; ++x) image.pixels.emplace_back((x + y) % 2 ? 0.8f : 0.2f);
    for (float size : {1.0f, 0.5f}) {
        Scene scene;
        Material material = grey("checker", 0.0f);
        material.sides[1].reflectance.constant = glm::vec3(0.1f);
        const int32_t checker = scene.addImage(image);
        for (MaterialSide& side : material.sides) {
            side.reflectance.image = checker;
            side.reflectance.imageWeight = {1, 0.5f, 0};
        }
        Mesh mesh = rectangle("plane", {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
        mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        place(scene, mesh, material);
        const Patches patches = subdivide(scene, size, kMany);
        for (uint32_t p = 0; p < patches.count(); ++p) {
            EXPECT_LT(glm::distance(patches.reflectance[2 * p], {0.5f, 0.25f, 0}), 1e-5f);
            EXPECT_LT(glm::distance(patches.reflectance[2 * p + 1], {0.6f, 0.35f, 0.1f}), 1e-5f);
        }
    }
}

TEST(Reflectance, ALinearRampOfCornerColoursIsExactOnQuads) {
    Scene scene;
    Material material = grey("ramp", 0.0f);
    material.sides[0].reflectance.cornerColorWeight = glm::vec3(1);
    Mesh mesh = rectangle("plane", {0, 0, 0}, {2, 0, 0}, {0, 1, 0});
    for (int32_t v : mesh.cornerVertices)
        mesh.cornerColors.push_back(0.1f + 0.3f * mesh.vertices[size_t(v)] + glm::vec3(0, 0, 0.2f));
    place(scene, mesh, material);
    const Patches patches = subdivide(scene, 0.13f, kMany);
    for (uint32_t p = 0; p < patches.count(); ++p) {
        const glm::vec3 at = patches.point(p, {0.5f, 0.5f}) + glm::vec3(patches.centre);
        ASSERT_LT(
            glm::distance(patches.reflectance[2 * p], 0.1f + 0.3f * at + glm::vec3(0, 0, 0.2f)),
            1e-5f);
    }
}

TEST(Reflectance, ALinearRampOfCornerColoursIsExactOnTriangles) {
    Scene scene;
    Material material = grey("ramp", 0.0f);
    material.sides[0].reflectance.cornerColorWeight = glm::vec3(1);
    Mesh mesh = polygons("triangle", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
    mesh.cornerColors = {{0, 0, 0.9f}, {0.9f, 0, 0}, {0, 0.9f, 0}};
    place(scene, mesh, material);
    const Patches patches = subdivide(scene, 10, kMany);
    ASSERT_EQ(patches.count(), 1u);
    EXPECT_LT(glm::distance(patches.reflectance[0], glm::vec3(0.3f)), 1e-5f)
        << "the mean of a linear colour is that at the centroid";
}

TEST(Subdivide, PiecesThatRoundingKeepsAsLongAreNotCutForEver) {
    // Pairs of triangles a few tens of rounding steps long, 1 km apart. Floats there are 6e-5 m
    // apart. Each pair is its own scene, since several pairs would intersect and be cut for this
    // reason too.
    std::mt19937 random(1);
    std::uniform_real_distribution<float> at(0, 4e-3f), thin(0, 2e-4f);
    size_t parents = 0, count = 0;
    for (int32_t k = 0; k < 2000; k += 2) {
        std::vector<glm::vec3> vertices;
        for (const float side : {-500.0f, 500.0f}) {
            const glm::vec3 far(side, 500, 500);
            const glm::vec3 from(at(random), at(random), at(random)),
                to(at(random), at(random), at(random));
            const glm::vec3 aside(thin(random), thin(random), thin(random));
            for (const glm::vec3& v : {from, to, 0.5f * (from + to) + aside})
                vertices.push_back(far + v);
        }
        Scene scene;
        place(scene, polygons("pair", vertices, {{0, 1, 2}, {3, 4, 5}}), grey("", 0.5f));
        const Patches patches = subdivide(scene, 3e-5f, 8000000);
        parents += patches.parents.size();
        count += patches.vertices.size();
    }
    EXPECT_GT(parents, 1000u);
    // A triangle of 100 rounding steps has at most some hundred pieces.
    EXPECT_LT(parents, 200'000u);
    EXPECT_LT(count, 200'000u);
}

TEST(Subdivide, CutsNoFurtherThanNumbersReach) {
    // 6e8 m from the centre neighbouring floats are 64 m apart. An edge of a few such steps cannot
    // be halved down to a patch of 1 m.
    const float far = 6e8f, step = 256;
    for (const float length : {8.0f, 40.0f, 80.0f}) {
        const Mesh mesh = polygons("far",
                                   {{far, far, 0},
                                    {far + length * step, far, 0},
                                    {far + length * step, far + step, 0},
                                    {far + length * step / 2, far + step, 0},
                                    {-far, -far, 0}},
                                   {{0, 1, 2}, {0, 1, 3}});
        const Patches patches = subdivided(mesh, 1);
        EXPECT_NEAR(patchArea(patches), length * step * step, 0.2 * length * step * step);
        for (float area : patches.area) EXPECT_GE(area, 0);
    }
}

TEST(Subdivide, ANeedleIsCutIntoAsManyPiecesAsItIsLong) {
    // Needles 100 m long and 1 mm wide: with the short edge first, second and last, and with a
    // blunt corner.
    const std::vector<std::vector<glm::vec3>> needles = {
        {{0, 0, 0}, {0, 1e-3f, 0}, {-100, 0, 0}},
        {{-100, 0, 0}, {0, 0, 0}, {0, 1e-3f, 0}},
        {{0, 1e-3f, 0}, {-100, 0, 0}, {0, 0, 0}},
        {{0, 0, 0}, {100, 0, 0}, {30, 1e-3f, 0}},
    };
    for (const std::vector<glm::vec3>& needle : needles) {
        Scene scene;
        place(scene, polygons("needle", needle, {{0, 1, 2}}), grey("", 0.5f));
        const Patches patches = subdivide(scene, 0.1f, 1000000);
        EXPECT_GE(patches.count(), 500u);
        EXPECT_LE(patches.count(), 4000u);
        double area = 0;
        for (const Parent& parent : patches.parents) {
            area += double(parent.area());
            EXPECT_GT(glm::dot(glm::cross(parent.a, parent.b), parent.normal), 0);
            EXPECT_LE(std::max(glm::length(parent.a), glm::length(parent.b)),
                      0.201f * float(parent.countA));
        }
        EXPECT_NEAR(area, 0.05, 1e-5);
    }
}

}  // namespace
}  // namespace raybundle
