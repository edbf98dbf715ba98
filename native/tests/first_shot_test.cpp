// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "first_shot/first_shot.h"
#include "lights/light_source.h"
#include "lights/mesh_outline.h"
#include "test_bakes.h"
#include "test_scenes.h"
#include "test_shots.h"
#include "visibility/visibility.h"

namespace raybundle {
namespace {

using namespace test;

// Adds a black surface far below all others, to enlarge the scene.
void placeGround(Scene& scene) {
    place(scene, rectangle("ground", {-20, -20, -5}, {40, 0, 0}, {0, 40, 0}), grey("", 0));
}

TEST(EmissiveMesh, ShinesFromTheSidesThatEmit) {
    for (float backEmission : {0.0f, 300.0f}) {
        Scene scene;
        placeReceiver(scene, {0, 0, 0});
        placeReceiver(scene, {0, 0, 2}, {0, 1, 0}, {1, 0, 0});  // above, facing down
        place(scene,
              rectangle("lamp", {-0.1f, -0.1f, 1}, {0, 0.2f, 0}, {0.2f, 0, 0}),  // front faces down
              grey("lamp", 0, 600, backEmission));
        placeGround(scene);
        const GatheredShot shot = gatherFinely(scene);
        const glm::dvec3 lamp[4] = {{-0.1, -0.1, 1}, {0.1, -0.1, 1}, {0.1, 0.1, 1}, {-0.1, 0.1, 1}};
        const double below = polygonIrradiance({0, 0, 0}, {0, 0, 1}, lamp, 4) / kPi;
        // Rays start 4e-6 of the ground's 28 m above the receiver, 0.1 mm in a metre, which gives
        // 2e-4 more light.
        EXPECT_NEAR(shot.front(0), 600 * below, 5e-4 * 600 * below);
        EXPECT_NEAR(shot.front(1), backEmission * below, 5e-4 * backEmission * below);
        const double power = 0.04 * (600.0 + backEmission);
        EXPECT_NEAR(shot.light.emitted.x, power, 1e-5 * power);
    }
}

TEST(EmissiveMesh, PowerToASquareFollowsTheFormFactor) {
    Scene scene;
    // One patch per face: patches of 0.1 m would be a hundred and sixty thousand on the ground.
    place(scene, grid("floor", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 10, 10), grey("", 0.5f));
    place(scene, rectangle("lamp", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}), grey("lamp", 0, 50));
    placeGround(scene);
    const GatheredShot shot = gatherFinely(scene);
    double power = 0;
    for (uint32_t p = 0; p < shot.patches.count(); ++p)
        if (shot.patches.parents[shot.patches.parentOf[p]].instance == 0)
            power += double(shot.patches.area[p]) * shot.light.irradiance[2 * p].x;
    const double exact = 50 * parallelRectangles(1, 1, 1);
    // The hundred patches of the floor are fully lit, so that closed forms at stratified points are
    // used.
    EXPECT_NEAR(power, exact, 1e-3 * exact);
}

TEST(EmissiveMesh, ManyFacesWithoutAClosedFormGiveTheSame) {
    Scene scene;
    place(scene, rectangle("floor", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0.5f));
    place(scene, grid("lamp", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}, 6, 6), grey("lamp", 0, 50));
    placeGround(scene);
    const GatheredShot shot = gatherFinely(scene);
    const double exact = 50 * parallelRectangles(1, 1, 1);
    EXPECT_NEAR(shot.front(), exact, kSampled * exact);
}

TEST(EmissiveMesh, TrianglesEmitUniformly) {
    // Triangles that fill a square and are too many for a closed form, over a receiver off the
    // centre.
    Scene scene;
    placeReceiver(scene, {0.9f, 0.1f, 0});
    std::vector<glm::vec3> v;
    std::vector<std::vector<int32_t>> faces;
    for (int k = 0; k < 18; ++k) {
        const int32_t first = int32_t(v.size());
        const float y = float(k) / 18, h = 1.0f / 18;
        v.insert(v.end(), {{0, y, 1}, {0, y + h, 1}, {1, y, 1}, {1, y + h, 1}});
        faces.insert(faces.end(),
                     {{first, first + 1, first + 2}, {first + 1, first + 3, first + 2}});
    }
    place(scene, polygons("lamp", v, faces), grey("lamp", 0, 50));
    placeGround(scene);
    const glm::dvec3 lamp[4] = {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    const double exact = 50 / kPi * polygonIrradiance({0.9, 0.1, 0}, {0, 0, 1}, lamp, 4);
    EXPECT_NEAR(gatherFinely(scene).front(), exact, kSampled * exact);
}

TEST(FirstShot, LeavesDimEmissionToTheBundles) {
    const GatheredShot shot = gatherFinely(closedCube(0.5f, 1), 0.25f);
    EXPECT_EQ(shot.light.emitted, glm::dvec3(0));
    for (size_t side = 0; side < shot.patches.sideCount(); ++side) {
        EXPECT_EQ(shot.light.emission[side], shot.patches.emission[side]);
        EXPECT_EQ(shot.light.irradiance[side], glm::vec3(0));
    }
}

// Half of the surfaces emit, but four of five lines miss the emitter.
TEST(FirstShot, GathersDimEmissionThatLinesSeldomMeet) {
    Scene scene;
    place(scene, rectangle("receiver", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0.8f));
    place(scene, grid("emitter", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}, 10, 10), grey("", 0, 1, 1));
    const ShotScene shots(scene, 0.05f);
    const FirstShot shot = shots.shoot(FirstShotKind::GATHER, 0);
    for (const glm::vec3& left : shot.emission) EXPECT_EQ(left, glm::vec3(0));
    // The light comes from a closed form, so that the error is that of the quadrature over the
    // patches.
    EXPECT_NEAR(meanLight(shots.patches, shot, 0).value, parallelRectangles(1, 1, 1), 1e-4);
}

TEST(FirstShot, PowerIsConservedInAClosedRoom) {
    for (bool isArea : {false, true}) {
        Scene scene = roomWithBoxes(0.5f);
        const Light light = isArea ? areaLight({2, 1.6, 2.79}, {0.4, 0, 0}, {0, -0.4, 0}, {1, 2, 3})
                                   : pointLight({2.2, 1.7, 2}, {1, 2, 3});
        scene.addLight(light);
        const GatheredShot shot = gatherFinely(scene, 0.1f);
        glm::dvec3 gathered(0.0);
        for (uint32_t side = 0; side < shot.patches.sideCount(); ++side)
            gathered +=
                double(shot.patches.area[side / 2]) * glm::dvec3(shot.light.irradiance[side]);
        const double exact = isArea ? kPi * 0.64 : 4 * kPi;
        EXPECT_NEAR(shot.light.emitted.x, exact, 1e-5 * exact);
        // Some thousand patches with independent errors of at most 1 %.
        EXPECT_NEAR(gathered.x, exact, 2e-3 * exact);
        EXPECT_NEAR(gathered.y, 2 * exact, 4e-3 * exact);
        EXPECT_NEAR(gathered.z, 3 * exact, 6e-3 * exact);
        EXPECT_NEAR(shot.light.escaped.x, 0, 1e-3 * exact);
    }
}

TEST(FirstShot, AClosedRoomKeepsTheSunOut) {
    Scene scene = roomWithBoxes(0.5f);
    scene.addLight(sunLight({0.3, 0.4, 1}, glm::dvec3(1), 0.05));
    const GatheredShot shot = gatherFinely(scene, 0.1f);
    for (uint32_t side = 0; side < shot.patches.sideCount(); side += 2)
        ASSERT_EQ(shot.light.irradiance[side], glm::vec3(0)) << "light leaks through an edge";
}

TEST(FirstShot, LightsWithoutStrengthOrSizeDoNoHarm) {
    Scene scene;
    placeReceiver(scene);
    scene.addLight(pointLight({0, 0, 1}, glm::dvec3(0)));
    scene.addLight(areaLight({0, 0, 1}, {1, 0, 0}, {2, 0, 0}, glm::dvec3(1)));
    scene.addLight(pointLight({0, 0, 0}, glm::dvec3(1)));  // at the position of the receiver
    const GatheredShot shot = gatherFinely(scene);
    EXPECT_TRUE(std::isfinite(shot.front()) && std::isfinite(shot.back()));
}

TEST(FirstShot, TheSameSeedGivesTheSameLight) {
    Scene scene = roomWithBoxes(0.5f);
    scene.addLight(areaLight({2, 1.6, 2.5}, {0.4, 0, 0}, {0, -0.4, 0}, glm::dvec3(1)));
    const GatheredShot one = gatherFinely(scene, 0.3f), two = gatherFinely(scene, 0.3f);
    for (size_t side = 0; side < one.patches.sideCount(); ++side)
        ASSERT_EQ(one.light.irradiance[side], two.light.irradiance[side]);
}

TEST(GatheredMesh, ALampAgainstTheCeilingLightsTheCeilingAroundIt) {
    // The top of the lamp lies on the ceiling and covers a part of it. Its four sides shine along
    // the ceiling.
    Scene scene;
    place(scene, rectangle("ceiling", {-2, 2, 0}, {4, 0, 0}, {0, -4, 0}), grey("", 0.5f));
    place(scene, box("lamp", {-0.33f, -0.33f, -0.2f}, {0.33f, 0.33f, 0}, false), grey("", 0, 30));
    const GatheredShot shot = gatherFinely(scene, 0.25f);
    const glm::dvec3 c[8] = {{-.33, -.33, -.2}, {.33, -.33, -.2}, {.33, .33, -.2}, {-.33, .33, -.2},
                             {-.33, -.33, 0},   {.33, -.33, 0},   {.33, .33, 0},   {-.33, .33, 0}};
    double found = 0, exact = 0;
    for (uint32_t k = 0; k < shot.patches.parents[0].patchCount(); ++k) {
        const double area = double(shot.patches.area[k]);
        found += area * double(shot.light.irradiance[2 * k].x);
        // Midpoint rule of Lambert's formula outside the lamp. No light arrives under the lamp.
        constexpr int kSteps = 16;
        double sum = 0;
        for (int i = 0; i < kSteps * kSteps; ++i) {
            const glm::vec2 uv((float(i % kSteps) + 0.5f) / kSteps,
                               (float(i / kSteps) + 0.5f) / kSteps);
            const glm::dvec3 at = glm::dvec3(shot.patches.point(k, uv)) + shot.patches.centre;
            if (std::abs(at.x) < 0.33 && std::abs(at.y) < 0.33) continue;
            for (int side = 0; side < 4; ++side) {
                const int next = (side + 1) % 4;
                const glm::dvec3 quad[4] = {c[side], c[next], c[4 + next], c[4 + side]};
                const glm::dvec3 outward = glm::cross(c[next] - c[side], glm::dvec3(0, 0, 1));
                if (glm::dot(at - c[side], outward) > 0)
                    sum += polygonIrradiance(at, {0, 0, -1}, quad, 4);
            }
        }
        exact += area * sum / (kSteps * kSteps) * 30 / kPi;
    }
    EXPECT_NEAR(found, exact, 0.01 * exact);
}

}  // namespace
}  // namespace raybundle
