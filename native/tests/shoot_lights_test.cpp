// SPDX-License-Identifier: GPL-3.0-or-later
//
// The first shot SHOOT: every kind of light against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "first_shot/shoot.h"
#include "test_scenes.h"
#include "test_shots.h"

namespace raybundle {
namespace {

using namespace test;

// A square of 2 m around the origin, facing up, under the given light.
Scene underLight(const Light& light) {
    Scene scene;
    place(scene, rectangle("square", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), grey("", 0.5f));
    scene.addLight(light);
    return scene;
}

double meanOverSquare(const std::function<double(const glm::dvec3&)>& irradiance) {
    constexpr int kSteps = 200;
    double mean = 0;
    for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j)
            mean += irradiance({2 * (i + 0.5) / kSteps - 1, 2 * (j + 0.5) / kSteps - 1, 0}) /
                    (kSteps * kSteps);
    return mean;
}

// Expects the mean light on the square to equal `exact`. The standard error must be below
// `smallest` times the exact value, so that the test is significant.
void expectMean(const Scene& scene, double exact, uint32_t side = 0, double smallest = 0.01) {
    const ShotScene room(scene);
    const FirstShot shot = room.shoot(FirstShotKind::SHOOT, 1 << 17);
    const Mean mean = meanLight(room.patches, shot, 0, side);
    EXPECT_NEAR(mean.value, exact, kSigmas * mean.error + 1e-5 * exact);
    EXPECT_LT(mean.error, smallest * exact);
}

const glm::dvec3 kLamp(0.2, 0.1, 1);

TEST(ShootPointLight, APointAndASphereGiveTheSame) {
    const double exact = meanOverSquare([](const glm::dvec3& p) {
        const glm::dvec3 d = kLamp - p;
        return d.z / std::pow(glm::dot(d, d), 1.5);
    });
    for (double radius : {0.0, 0.1, 0.9}) {
        Light light = pointLight(kLamp, glm::dvec3(1));
        light.radius = radius;
        light.pointShape = RB_POINT_SPHERE;
        expectMean(underLight(light), exact);
    }
}

TEST(ShootPointLight, ADiskFacesItsReceivers) {
    for (double radius : {0.1, 0.9}) {
        Light light = pointLight(kLamp, glm::dvec3(1));
        light.radius = radius;
        light.pointShape = RB_POINT_DISK;
        // If the disk is fully above the horizon, its light is that of its centre, smaller by d^2 /
        // (d^2 + r^2).
        expectMean(underLight(light), meanOverSquare([&](const glm::dvec3& p) {
                       const glm::dvec3 d = kLamp - p;
                       const double d2 = glm::dot(d, d);
                       return d.z / std::sqrt(d2) / (d2 + radius * radius);
                   }));
    }
}

TEST(ShootPointLight, ADiskBehindAnObstacleGivesWhatIsGathered) {
    // The obstacle is closer than the points at which the lines of many receivers pass the disk.
    Light light = pointLight({0, 0, 1}, glm::dvec3(1));
    light.radius = 0.4;
    light.pointShape = RB_POINT_DISK;
    Scene scene = underLight(light);
    place(scene, rectangle("obstacle", {-0.1f, -0.2f, 0.5f}, {0.4f, 0, 0}, {0, 0.4f, 0}),
          grey("", 0.5f));
    const ShotScene room(scene, 0.5f);
    const FirstShot shot = room.shoot(FirstShotKind::SHOOT, 1 << 18),
                    gathered = room.shoot(FirstShotKind::GATHER, 0, 0, 0.002f);
    for (uint32_t instance : {0u, 1u})
        for (uint32_t side : {0u, 1u}) {
            const Mean a = meanLight(room.patches, shot, instance, side);
            const Mean b = meanLight(room.patches, gathered, instance, side);
            EXPECT_NEAR(a.value, b.value, kSigmas * std::hypot(a.error, b.error))
                << instance << ", " << side;
        }
}

TEST(ShootSpotLight, TheConeCutsBlendsAndDims) {
    for (int kind = 0; kind < 4; ++kind) {
        Light light = pointLight(kLamp, glm::dvec3(1));
        light.hasCone = true;
        light.coneAngle = kind == 3 ? 3.5 : 1.2;
        light.coneBlend = kind == 0 ? 0 : 0.6;
        light.coneDims = kind >= 2;
        // The cone is tilted, and deformed to an ellipse.
        const glm::dvec3 axis = glm::normalize(glm::dvec3(0.3, 0.1, 1));
        const glm::dvec3 x = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), axis));
        light.worldToCone = glm::transpose(glm::dmat3(x, glm::cross(axis, x), axis));
        if (kind == 2)
            light.worldToCone = glm::dmat3(0.5, 0, 0, 0, 1.5, 0, 0, 0, 1) * light.worldToCone;
        const double edge = std::cos(0.5 * light.coneAngle), soft = (1 - edge) * light.coneBlend;
        const double exact = meanOverSquare([&](const glm::dvec3& p) {
            const glm::dvec3 d = kLamp - p;
            const double c = glm::normalize(light.worldToCone * d).z;
            const double t = soft > 0 ? std::clamp((c - edge) / soft, 0.0, 1.0) : double(c > edge);
            return t * t * (3 - 2 * t) * (light.coneDims ? std::max(0.0, c) : 1) * d.z /
                   std::pow(glm::dot(d, d), 1.5);
        });
        SCOPED_TRACE(kind);
        expectMean(underLight(light), exact);
    }
}

TEST(ShootSunLight, GivesItsIrradianceTimesTheCosine) {
    const glm::dvec3 direction = glm::normalize(glm::dvec3(0.3, 0.4, 1));
    for (double angle : {0.0, 0.1, 1.0})
        expectMean(underLight(sunLight(direction, glm::dvec3(2), angle)), 2 * direction.z);
}

TEST(ShootSunLight, AWideSunOnTheHorizonIsHalfSeen) {
    const double half = 0.3;
    const double exact =
        (half - 0.5 * std::sin(2 * half)) / (kPi * std::sin(half) * std::sin(half));
    for (uint32_t side : {0u, 1u})
        expectMean(underLight(sunLight({1, 0, 0}, glm::dvec3(1), 2 * half)), exact, side, 0.02);
}

TEST(ShootSunLight, CountsWhatArrivesOnly) {
    const ShotScene room(underLight(sunLight({0, 0, 1}, glm::dvec3(1))));
    const FirstShot shot = room.shoot(FirstShotKind::SHOOT, 1 << 16);
    EXPECT_EQ(shot.escaped, glm::dvec3(0));
    EXPECT_NEAR(shot.emitted.x, arriving(room.patches, shot).x, 1e-6 * shot.emitted.x);
}

TEST(ShootAreaLight, ARectangleFollowsTheFormFactor) {
    expectMean(underLight(areaLight({0, 0, 1}, {1, 0, 0}, {0, -1, 0}, glm::dvec3(7))),
               7 * kPi * parallelRectangles(2, 2, 1));
    const Scene behind = underLight(areaLight({0, 0, 1}, {1, 0, 0}, {0, 1, 0}, glm::dvec3(7)));
    const ShotScene room(behind);
    EXPECT_EQ(meanLight(room.patches, room.shoot(FirstShotKind::SHOOT, 1 << 14), 0).value, 0);
}

TEST(ShootAreaLight, AnEllipseGivesWhatIsGathered) {
    const ShotScene room(underLight(
        areaLight({0.3, 0, 0.8}, {0, 0.6, 0}, {0.4, 0, 0}, glm::dvec3(7), RB_AREA_ELLIPSE)));
    const Mean exact = meanLight(room.patches, room.shoot(FirstShotKind::GATHER, 0, 0, 0.0002f), 0);
    const Mean mean = meanLight(room.patches, room.shoot(FirstShotKind::SHOOT, 1 << 17), 0);
    // The gathered light has the error of at most 256 samples.
    EXPECT_NEAR(mean.value, exact.value, kSigmas * mean.error + 0.01 * exact.value);
}

TEST(ShootAreaLight, InTheCeilingNothingHitsTheCeiling) {
    Scene scene;
    place(scene, box("room", {0, 0, 0}, {4, 3, 3}, true), grey("", 0.5f));
    scene.addLight(areaLight({2, 1.5, 3}, {0.5, 0, 0}, {0, -0.5, 0}, glm::dvec3(1)));
    const ShotScene room(scene);
    const FirstShot shot = room.shoot(FirstShotKind::SHOOT, 1 << 16);
    for (uint32_t side = 0; side < room.patches.sideCount(); ++side)
        if (side % 2 == 1 || room.patches.normal(side).z < -0.9f) {
            EXPECT_EQ(shot.irradiance[side], glm::vec3(0)) << "side " << side;
        }
}

TEST(ShootEmissiveMesh, ShinesFromTheSidesThatEmit) {
    // The lamp is half-way between two squares. A large ground keeps the mean exitance low.
    for (float backEmission : {0.0f, 500.0f}) {
        Scene scene;
        place(scene, rectangle("below", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0.5f));
        place(scene, rectangle("above", {0, 0, 2}, {0, 1, 0}, {1, 0, 0}), grey("", 0.5f));
        place(scene, rectangle("lamp", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}),
              grey("lamp", 0, 800, backEmission));
        place(scene, rectangle("ground", {-20, -20, -5}, {40, 0, 0}, {0, 40, 0}), grey("", 0));
        const ShotScene room(scene);
        const FirstShot shot = room.shoot(FirstShotKind::SHOOT, 1 << 17);
        const double f = parallelRectangles(1, 1, 1);
        const Mean below = meanLight(room.patches, shot, 0),
                   above = meanLight(room.patches, shot, 1);
        EXPECT_NEAR(below.value, 800 * f, kSigmas * below.error);
        EXPECT_NEAR(above.value, double(backEmission) * f, kSigmas * above.error);
        EXPECT_EQ(meanLight(room.patches, shot, 2, 0).value, 0) << "the lamp meets itself";
        const double power = 800.0 + double(backEmission);
        EXPECT_NEAR(shot.emitted.x, power, 1e-5 * power);
        EXPECT_NEAR(shot.emitted.x - shot.escaped.x, arriving(room.patches, shot).x, 1e-5 * power);
    }
}

TEST(ShootEmissiveMesh, ALampThatLiesAgainstTheCeilingKeepsOutOfIt) {
    Scene scene = roomWithBoxes(0.5f);
    place(scene, box("lamp", {1.5f, 1, 2.75f}, {2.5f, 2, 2.8f}, false), grey("lamp", 0, 60));
    const ShotScene room(scene, 0.25f);
    const FirstShot shot = room.shoot(FirstShotKind::SHOOT, 1 << 18),
                    gathered = room.shoot(FirstShotKind::GATHER, 0);
    // The light of the covered top is lost. The light of the other five faces arrives, except on
    // lines that start at an edge of the lamp and meet its inside.
    const double power = 60 * (1 + 4 * 0.05);
    EXPECT_NEAR(shot.emitted.x, power, 0.01 * power);
    EXPECT_NEAR(arriving(room.patches, shot).x, shot.emitted.x, 1e-5 * power);
    EXPECT_LT(meanLight(room.patches, shot, 3, 0).value * 2.2, 1e-4 * power);
    double down[2] = {0, 0};
    for (uint32_t side = 0; side < room.patches.sideCount(); side += 2) {
        const glm::vec3 at =
            room.patches.point(side / 2, {0.5f, 0.5f}) + glm::vec3(room.patches.centre);
        if (room.patches.normal(side).z > 0.9f && at.z < 0.01f) {
            down[0] += double(room.patches.area[side / 2] * shot.irradiance[side].x);
            down[1] += double(room.patches.area[side / 2] * gathered.irradiance[side].x);
        }
        if (room.patches.normal(side).z < -0.9f && at.z > 2.79f && std::abs(at.x - 2) < 0.3f &&
            std::abs(at.y - 1.5f) < 0.3f) {
            EXPECT_EQ(shot.irradiance[side], glm::vec3(0)) << "the covered ceiling";
        }
    }
    // A fifth of 2^18 lines arrives there, which leaves 0.4 % of noise.
    EXPECT_NEAR(down[0], down[1], 0.02 * down[1]) << "on the floor";
}

}  // namespace
}  // namespace raybundle
