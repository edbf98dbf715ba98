// SPDX-License-Identifier: GPL-3.0-or-later
//
// Tests of the light that is shown before the patches are made, and of the whole faces on which it
// is sampled.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "bake/first_light.h"
#include "patches/whole_faces.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// Rounding in single precision.
constexpr float kExact = 1e-5f;
// So many squares along each edge of a grid that places share their light.
constexpr int kFine = 280;

// Adds a horizontal plate of 1 m^2 around the origin.
int32_t placePlate(Scene& scene, rb_role role = RB_ROLE_BAKE, rb_side side = RB_SIDE_FRONT) {
    return place(scene, grid("plate", {-0.5, -0.5, 0}, {1, 0, 0}, {0, 1, 0}, kFine, kFine),
                 grey("plate", 0.5f, 0.25f), glm::dmat4(1), role, side);
}

// Returns the first light at the corners of an instance, W/m^2. Empty if none is offered.
std::vector<glm::vec3> firstLight(const Scene& scene, int32_t instance = 0,
                                  rb_output output = RB_OUTPUT_DIRECT) {
    Interim interim;
    offerFirstLight(scene, Settings(), interim);
    if (interim.count() == 0) return {};
    std::vector<glm::vec3> light = interim.read(instance, output);
    for (glm::vec3& value : light) value *= float(kPi);
    return light;
}

TEST(FirstLight, IsExactWhereAllSamplesOfTheSourcesAreEqual) {
    // Suns light both sides, one of them in a light set, and the world lights the front.
    Scene scene;
    const int32_t front = placePlate(scene);
    const int32_t back = place(scene, grid("back", {2, 2, 0}, {1, 0, 0}, {0, 1, 0}, 3, 3),
                               grey("", 0.5f), glm::dmat4(1), RB_ROLE_BAKE, RB_SIDE_BACK);
    scene.addLight(sunLight({0, 3, 4}, glm::dvec3(10)));
    scene.addLight(sunLight({0, 0, -1}, glm::dvec3(2)));
    Light ofSet = sunLight({0, 0, 1}, glm::dvec3(1));
    ofSet.lightSet = scene.addLightSet("set");
    scene.addLight(ofSet);
    const float sky = 0.1f * float(kPi);
    scene.setWorld(glm::vec3(0.1f));
    for (const glm::vec3& light : firstLight(scene, front))
        ASSERT_NEAR(light.x, 9 + sky, 10 * kExact);
    for (const glm::vec3& light : firstLight(scene, back))
        ASSERT_NEAR(light.x, 2 + sky, 10 * kExact);
    for (const glm::vec3& light : firstLight(scene, front, RB_OUTPUT_INDIRECT))
        ASSERT_EQ(light.x, 0);
    for (const glm::vec3& light : firstLight(scene, front, RB_OUTPUT_COMBINED))
        ASSERT_NEAR(light.x, 0.25f + 0.5f * (9 + sky), 10 * kExact);
}

TEST(FirstLight, FollowsALampAndItsShadow) {
    Scene scene;
    const int32_t plate = placePlate(scene);
    place(scene, rectangle("blocker", {0, -2, 0.5f}, {2, 0, 0}, {0, 4, 0}), grey("", 0.5f),
          glm::dmat4(1), RB_ROLE_OCCLUDE);
    scene.addLight(pointLight({-0.1, 0, 1}, glm::dvec3(1)));
    const std::vector<glm::vec3> light = firstLight(scene, plate);
    const Mesh& mesh = scene.meshes[0];
    ASSERT_EQ(light.size(), mesh.cornerCount());
    for (size_t c = 0; c < light.size(); ++c) {
        const glm::vec3 at = mesh.vertices[size_t(mesh.cornerVertices[c])];
        // The light of a corner is that at most a few squares away.
        constexpr float kFar = 8.0f / kFine;
        if (std::abs(at.x - 0.1f) < kFar) continue;
        const float square = (at.x + 0.1f) * (at.x + 0.1f) + at.y * at.y + 1;
        const float exact = at.x > 0.1f ? 0 : 1 / (square * std::sqrt(square));
        // The light changes by at most 3 times its value per metre.
        ASSERT_NEAR(light[c].x, exact, 3 * kFar) << at.x << " " << at.y;
    }
}

TEST(FirstLight, ComesFromSurfacesThatEmit) {
    // A large plate at a small height over the plate: almost a half-space of emission.
    Scene scene;
    const int32_t plate = placePlate(scene);
    place(scene, rectangle("lamp", {-500, 500, 1}, {1000, 0, 0}, {0, -1000, 0}), grey("", 0, 7),
          glm::dmat4(1), RB_ROLE_OCCLUDE);
    double mean = 0;
    const std::vector<glm::vec3> light = firstLight(scene, plate);
    for (const glm::vec3& value : light) mean += double(value.x) / double(light.size());
    // One sample of the lamp at each of about 40000 places, whose deviation is below 1.
    EXPECT_NEAR(mean, 7, 7 * 0.02);
}

TEST(FirstLight, IsNotOfferedWhereItIsOfNoUse) {
    Scene dark;
    placePlate(dark);
    dark.addLight(sunLight({0, 0, -1}, glm::dvec3(1)));
    EXPECT_TRUE(firstLight(dark).empty()) << "black";
    Scene far;
    placePlate(far);
    far.addLight(sunLight({0, 0, 1}, glm::dvec3(1)));
    far.instances[0].transform = glm::translate(glm::dmat4(1), {2e12, 0, 0});
    EXPECT_TRUE(firstLight(far).empty()) << "the bake refuses the scene";
}

TEST(FirstLight, IsThatOfCornersWithAResult) {
    Scene scene;
    const int32_t plate = placePlate(scene);
    scene.addLight(sunLight({0, 0, 1}, glm::dvec3(1)));
    const int32_t corners[] = {0, 1, 2, 3};
    scene.setResultCorners(plate, corners, 4);
    const std::vector<glm::vec3> light = firstLight(scene, plate);
    ASSERT_EQ(light.size(), scene.meshes[0].cornerCount());
    for (size_t c = 0; c < 4; ++c) EXPECT_NEAR(light[c].x, 1, kExact);
    EXPECT_EQ(light.back().x, 0);
}

TEST(FirstLight, DoesNotDependOnWhereTheSceneIs) {
    const glm::dmat4 turn = glm::rotate(glm::translate(glm::dmat4(1), {30, -20, 5}), 0.7,
                                        glm::normalize(glm::dvec3(1, 2, 3)));
    std::vector<glm::vec3> light[2];
    for (int k = 0; k < 2; ++k) {
        const glm::dmat4 move = k ? turn : glm::dmat4(1);
        Scene scene;
        placePlate(scene);
        place(scene, box("box", {0.1f, 0.1f, 0.1f}, {0.3f, 0.3f, 0.3f}, false), grey("", 0.5f));
        for (Instance& instance : scene.instances) instance.transform = move;
        scene.addLight(sunLight(glm::dmat3(move) * glm::dvec3(1, 1, 3), glm::dvec3(1)));
        light[k] = firstLight(scene);
    }
    ASSERT_EQ(light[0].size(), light[1].size());
    size_t different = 0;
    for (size_t c = 0; c < light[0].size(); ++c)
        different += std::abs(light[0][c].x - light[1][c].x) > 10 * kExact;
    // Rounding decides only within the border of the shadow, which is about 1 m long.
    EXPECT_LT(different, size_t(4 * kFine));
}

TEST(WholeFaces, HaveTheAreaAndTheSidesOfTheFaces) {
    // Concave faces of four and of eight corners, and a triangle.
    Scene scene;
    const Mesh mesh = polygons("mesh",
                               {{0, 0, 0},
                                {2, 0, 0},
                                {0.5f, 0.5f, 0},
                                {0, 2, 0},
                                {4, 0, 0},
                                {7, 0, 0},
                                {7, 3, 0},
                                {6, 3, 0},
                                {6, 1, 0},
                                {5, 1, 0},
                                {5, 3, 0},
                                {4, 3, 0}},
                               {{0, 1, 2, 3}, {4, 5, 6, 7, 8, 9, 10, 11}, {0, 5, 6}});
    const double area = 1 + 7 + 10.5;
    place(scene, mesh, grey("", 0.5f));
    place(scene, mesh, grey("", 0.5f), glm::scale(glm::dmat4(1), {1, 1, -1}));
    place(scene, mesh, grey("", 0.5f), glm::scale(glm::dmat4(1), {1, -1, 1}));
    const Patches patches = wholeFaces(scene);
    ASSERT_EQ(patches.count(), 3 * triangleCount(mesh));
    ASSERT_EQ(triangleCount(mesh), 2u + 6u + 1u);
    EXPECT_NEAR(patches.totalArea, 3 * area, 1e-5);
    for (uint32_t p = 0; p < patches.count(); ++p) {
        const Parent& parent = patches.parents[p];
        EXPECT_EQ(parent.instance, p / triangleCount(mesh));
        EXPECT_NEAR(parent.normal.z, parent.instance == 1 ? -1 : 1, kExact) << p;
        EXPECT_EQ(patches.cells[p].face, parent.face);
        for (int k = 0; k < 3; ++k)
            EXPECT_EQ(
                glm::vec3(patches.centre) + patches.cells[p].position(k),
                glm::vec3(scene.instances[parent.instance].transform *
                          glm::dvec4(
                              mesh.vertices[size_t(
                                  mesh.cornerVertices[size_t(patches.cells[p].corner[size_t(k)])])],
                              1)));
    }
}

TEST(WholeFaces, BearFacesWithoutArea) {
    Scene scene;
    place(scene,
          polygons("mesh", {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}},
                   {{0, 1, 2}, {0, 0, 0}, {0, 2, 3}}),
          grey("", 0.5f, 1));
    const Patches patches = wholeFaces(scene);
    ASSERT_EQ(patches.count(), 3u);
    for (uint32_t p = 0; p < 3; ++p) {
        EXPECT_GT(patches.area[p], 0);
        EXPECT_NEAR(glm::length(patches.normal(2 * p)), 1, kExact);
    }
    EXPECT_EQ(wholeFaces(Scene()).count(), 0u);
}

}  // namespace
}  // namespace raybundle
