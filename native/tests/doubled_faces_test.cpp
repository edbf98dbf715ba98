// SPDX-License-Identifier: GPL-3.0-or-later
//
// Faces that lie on other faces, and faces without area. The rest of the scene has the light of a
// scene without them, and they have the light of the faces that they lie on.
#include "patches/doubled_faces.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "bake/bake.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// Returns a mesh with each face twice. The vertices of the copies are moved by up to `off` metres.
Mesh twice(const Mesh& mesh, float off) {
    Mesh both = mesh;
    std::mt19937 random(3);
    std::uniform_real_distribution<float> shift(-off, off);
    const int32_t vertices = int32_t(mesh.vertices.size()), corners = mesh.faceOffsets.back();
    for (const glm::vec3& vertex : mesh.vertices)
        both.vertices.push_back(vertex + glm::vec3(shift(random), shift(random), shift(random)));
    for (int32_t vertex : mesh.cornerVertices) both.cornerVertices.push_back(vertices + vertex);
    for (size_t f = 1; f < mesh.faceOffsets.size(); ++f)
        both.faceOffsets.push_back(corners + mesh.faceOffsets[f]);
    both.faceMaterials.insert(both.faceMaterials.end(), mesh.faceMaterials.begin(),
                              mesh.faceMaterials.end());
    return both;
}

// A table under a lamp, above a floor.
Scene tableScene(const Mesh& table, const glm::dmat4& transform = glm::dmat4(1)) {
    Scene scene;
    place(scene, grid("floor", {-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, 12, 12), grey("", 0.5f));
    place(scene, table, grey("", 0.5f), transform);
    scene.lights.push_back(areaLight({0, 0, 3}, {0.3, 0, 0}, {0, -0.3, 0}, glm::dvec3(100)));
    return scene;
}
const Mesh kTable = grid("table", {-1, -1, 1}, {2, 0, 0}, {0, 2, 0}, 4, 4);

std::vector<glm::vec3> lightOf(const Scene& scene, int32_t instance, Bake* kept = nullptr) {
    Bake own;
    Bake& bake = kept ? *kept : own;
    bake.run(scene);
    return cornerLight(bake, instance, RB_OUTPUT_LIGHTING);
}

TEST(DoubledFaces, BothHaveTheLightOfOne) {
    const std::vector<glm::vec3> one = lightOf(tableScene(kTable), 1);
    for (float off : {0.0f, 1e-7f, 1e-6f}) {
        const std::vector<glm::vec3> both = lightOf(tableScene(twice(kTable, off)), 1);
        ASSERT_EQ(both.size(), 2 * one.size());
        for (size_t c = 0; c < both.size(); ++c)
            EXPECT_NEAR(both[c].x, one[c % one.size()].x, 1e-3f * one[c % one.size()].x)
                << off << ", corner " << c;
    }
}

// None of many copies is left dark, whichever of them stands for the others.
TEST(DoubledFaces, ManyCopiesHaveTheLightOfOne) {
    const std::vector<glm::vec3> one = lightOf(tableScene(kTable), 1);
    Scene scene = tableScene(twice(kTable, 1e-6f));
    const Mesh moved = twice(twice(kTable, 1e-6f), 1e-6f);
    place(scene, moved, grey("", 0.5f));
    Bake bake;
    lightOf(scene, 1, &bake);
    for (int32_t instance : {1, 2}) {
        const std::vector<glm::vec3> all = cornerLight(bake, instance, RB_OUTPUT_LIGHTING);
        for (size_t c = 0; c < all.size(); ++c)
            EXPECT_NEAR(all[c].x, one[c % one.size()].x, 1e-3f * one[c % one.size()].x)
                << instance << ", corner " << c;
    }
}

TEST(DoubledFaces, AnObjectOnAnotherHasItsLightAlsoTurnedAndMirrored) {
    const std::vector<glm::vec3> one = lightOf(tableScene(kTable), 1);
    // A quarter turn and a mirror image, which take the same place with other corners.
    for (const glm::dmat4& turn : {glm::rotate(glm::dmat4(1), kPi / 2, glm::dvec3(0, 0, 1)),
                                   glm::scale(glm::dmat4(1), glm::dvec3(-1, 1, 1))}) {
        Scene scene = tableScene(kTable);
        place(scene, kTable, grey("", 0.5f), turn);
        const std::vector<glm::vec3> other = lightOf(scene, 2);
        for (size_t c = 0; c < other.size(); ++c) {
            const glm::dvec3 at(turn * glm::dvec4(kTable.vertices[kTable.cornerVertices[c]], 1));
            float nearest = 1e9f, light = 0;
            for (size_t k = 0; k < one.size(); ++k) {
                const glm::vec3 place = kTable.vertices[kTable.cornerVertices[k]];
                const float distance = glm::distance(place, glm::vec3(at));
                if (distance < nearest) {
                    nearest = distance;
                    light = one[k].x;
                }
            }
            EXPECT_NEAR(other[c].x, light, 1e-3f * light) << c;
        }
    }
}

TEST(DoubledFaces, FacesThatLookTheOtherWayHaveLightOfTheirOwn) {
    Scene scene = tableScene(kTable);
    place(scene, grid("under", {-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, 4, 4), grey("", 0.5f));
    Bake bake;
    const std::vector<glm::vec3> above = lightOf(scene, 1, &bake);
    const std::vector<glm::vec3> below = cornerLight(bake, 2, RB_OUTPUT_LIGHTING);
    for (size_t c = 0; c < below.size(); ++c) EXPECT_LT(below[c].x, 0.5f * above[c].x);
}

TEST(DoubledFaces, WhatIsBakedStandsForWhatIsNotAndEmissionForNothingElse) {
    Scene scene;
    place(scene, kTable, grey("", 0.5f), glm::dmat4(1), RB_ROLE_OCCLUDE);
    place(scene, kTable, grey("", 0.5f));
    Patches patches = subdivide(scene, 0.5f, kMany);
    EXPECT_EQ(patches.parents.size(), 16u);
    EXPECT_EQ(patches.parents.front().instance, 1u);

    place(scene, kTable, grey("", 0.5f, 1.0f));
    patches = subdivide(scene, 0.5f, kMany);
    EXPECT_EQ(patches.parents.size(), 32u) << "a lamp on a table shines";
    EXPECT_EQ(patches.warnings.size(), 1u);
}

TEST(DoubledFaces, ABakeThatGoesOnWithTheLastOneFindsThemAnew) {
    Scene scene = tableScene(kTable);
    place(scene, kTable, grey("", 0.5f));
    Bake bake;
    lightOf(scene, 1, &bake);
    scene.instances[1].role = RB_ROLE_OCCLUDE;
    const std::vector<glm::vec3> again = lightOf(scene, 2, &bake), fresh = lightOf(scene, 2);
    for (size_t c = 0; c < fresh.size(); ++c) EXPECT_EQ(again[c], fresh[c]);
}

// A face without area along a border. The light shown at its vertices is the mean of their other
// corners.
TEST(DoubledFaces, FacesWithoutAreaDoNotDarkenTheirVertices) {
    std::vector<std::vector<int32_t>> faces{{0, 1, 2, 3}};
    const std::vector<glm::vec3> vertices{
        {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}, {0, -1, 1}};
    Bake bake;
    lightOf(tableScene(polygons("table", vertices, faces)), 1, &bake);
    const std::vector<glm::vec3> expected = bake.instanceLight(1).perVertex(RB_OUTPUT_LIGHTING);
    faces.push_back({0, 4, 1});
    lightOf(tableScene(polygons("table", vertices, faces)), 1, &bake);
    const std::vector<glm::vec3> light = bake.instanceLight(1).perVertex(RB_OUTPUT_LIGHTING);
    for (size_t v = 0; v < 4; ++v)
        EXPECT_NEAR(light[v].x, expected[v].x, 1e-3f * expected[v].x) << v;
}

}  // namespace
}  // namespace raybundle
