// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light of lamps without occluders, against closed forms.
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

TEST(PointLight, FallsWithTheSquareOfTheDistanceAndTheCosine) {
    Scene scene;
    placeReceiver(scene, {0, 0, 0});
    placeReceiver(scene, {3, 0, 0});
    placeReceiver(scene, {0, 1, 0}, {0, 0, 1}, {1, 0, 0});  // upright, facing +y
    scene.addLight(pointLight({0, 0, 2}, glm::dvec3(5)));
    const GatheredShot shot = gatherFinely(scene);
    EXPECT_NEAR(shot.front(0), 5.0 / 4, kExact * 5 / 4);
    const double d2 = 13, exact = 5 * 2 / std::sqrt(d2) / d2;
    EXPECT_NEAR(shot.front(1), exact, kExact * exact);
    EXPECT_EQ(shot.back(0), 0);
    EXPECT_EQ(shot.front(2), 0) << "the light is behind it";
    const double side = 5 * 1 / std::sqrt(5.0) / 5;
    EXPECT_NEAR(shot.back(2), side, kExact * side);
}

TEST(PointLight, APatchGetsTheMeanOverItsArea) {
    Scene scene;
    place(scene, rectangle("square", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), grey("", 0.5f));
    scene.addLight(pointLight({0.2, 0.1, 1}, glm::dvec3(1)));
    double mean = 0;
    constexpr int kSteps = 400;
    for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j) {
            const glm::dvec3 d(0.2 - (2 * (i + 0.5) / kSteps - 1),
                               0.1 - (2 * (j + 0.5) / kSteps - 1), 1);
            mean += 1 / std::pow(glm::dot(d, d), 1.5) / (kSteps * kSteps);
        }
    EXPECT_NEAR(gatherFinely(scene).front(), mean, kSampled * mean);
}

TEST(PointLight, ASphereOutsideGivesWhatAPointGives) {
    for (double radius : {0.1, 1.0, 1.9}) {
        Scene scene;
        placeReceiver(scene);
        placeReceiver(scene, {0.5f, 0, -1});
        Light light = pointLight({0, 0, 2}, glm::dvec3(3));
        light.radius = radius;
        light.pointShape = RB_POINT_SPHERE;
        scene.addLight(light);
        const GatheredShot shot = gatherFinely(scene);
        EXPECT_NEAR(shot.front(0), 3.0 / 4, kSampled * 3 / 4) << "radius " << radius;
        const double exact = 3 * 3 / std::pow(9.25, 1.5);
        EXPECT_NEAR(shot.front(1), exact, kSampled * exact) << "radius " << radius;
    }
}

TEST(PointLight, ADiskFacesItsReceiver) {
    Scene scene;
    placeReceiver(scene);
    Light light = pointLight({0, 0, 2}, glm::dvec3(3));
    light.radius = 1;
    light.pointShape = RB_POINT_DISK;
    scene.addLight(light);
    // Radiance I / (pi r^2) over a coaxial disk: the irradiance is I / (r^2 + h^2).
    EXPECT_NEAR(gatherFinely(scene).front(), 3.0 / 5, kSampled * 3 / 5);
}

TEST(SpotLight, TheConeCutsAndBlends) {
    Scene scene;
    const double angle = 1.0, blend = 0.5, height = 2;
    const double edge = std::cos(0.5 * angle), soft = (1 - edge) * blend;
    const double cosines[] = {0.9999, edge + 0.75 * soft, edge + 0.5 * soft, edge + 0.1 * soft,
                              edge - 0.01};
    for (double c : cosines) placeReceiver(scene, {float(height * std::tan(std::acos(c))), 0, 0});
    Light light = pointLight({0, 0, height}, glm::dvec3(1));
    light.hasCone = true;
    light.coneAngle = angle;
    light.coneBlend = blend;
    scene.addLight(light);
    const GatheredShot shot = gatherFinely(scene);
    for (uint32_t k = 0; k < 5; ++k) {
        const double t = std::clamp((cosines[k] - edge) / soft, 0.0, 1.0);
        const double exact = t * t * (3 - 2 * t) * std::pow(cosines[k], 3) / (height * height);
        // Across 2 mm the smoothstep changes by up to 0.0006 of the full light.
        EXPECT_NEAR(shot.front(k), exact, kSampled * exact + 2e-4) << "receiver " << k;
    }
    EXPECT_EQ(shot.front(4), 0);
}

// Returns the mean irradiance on a rectangle, W/m^2. The lamp is at the origin, has an intensity of
// 1 W/sr and shines down.
double meanOnRectangle(const Light& lamp, const glm::dvec3& origin, const glm::dvec3& a,
                       const glm::dvec3& b) {
    constexpr int kSteps = 800;
    const glm::dvec3 normal = glm::normalize(glm::cross(a, b));
    const double edge = std::cos(0.5 * lamp.coneAngle), soft = (1 - edge) * lamp.coneBlend;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j) {
            const glm::dvec3 d = origin + (i + 0.5) / kSteps * a + (j + 0.5) / kSteps * b;
            const double distance = glm::length(d), above = -d.z / distance - edge;
            if (above <= 0) continue;
            const double t = soft > 0 ? std::min(1.0, above / soft) : 1;
            sum += t * t * (3 - 2 * t) * -glm::dot(d, normal) / (distance * distance * distance);
        }
    return sum / (double(kSteps) * kSteps);
}

// A patch gets the mean over its lit part, however much of the patch that is.
TEST(SpotLight, ItsRimMayCrossAPatch) {
    for (const double blend : {0.0, 0.01})
        for (const double angle : {1.2, double(kPi)})
            for (const double share : {0.11, 0.19, 0.33, 0.52, 0.7, 0.89}) {
                Light lamp = pointLight({0, 0, 0}, glm::dvec3(1));
                lamp.hasCone = true;
                lamp.coneAngle = angle;
                lamp.coneBlend = blend;
                // The rim meets a floor in a circle. That of the widest cone meets a wall at the
                // height of the lamp.
                const bool isWall = angle > 3;
                const float size = 0.4f, lit = size * float(share), rim = std::tan(0.6f);
                const glm::vec3 origin =
                    isWall ? glm::vec3(-0.1f, 1, -lit) : glm::vec3(rim - lit, -0.1f, -1);
                const glm::vec3 a = isWall ? glm::vec3(0.2f, 0, 0) : glm::vec3(size, 0, 0);
                const glm::vec3 b = isWall ? glm::vec3(0, 0, size) : glm::vec3(0, 0.2f, 0);
                Scene scene;
                place(scene, rectangle("", origin, a, b), grey("", 0.5f));
                scene.addLight(lamp);
                const double exact = meanOnRectangle(lamp, origin, a, b);
                // The error is that of the place of the rim, and does not shrink with the lit part.
                EXPECT_NEAR(gatherFinely(scene).front(), exact, 0.003 * exact / share)
                    << "angle " << angle << ", blend " << blend << ", share " << share;
            }
}

// All light of the lamp arrives within a patch: the intensity times the solid angle of the cone.
TEST(SpotLight, ANarrowConeMayLightASmallPartOfAPatch) {
    for (const double angle : {0.02, 0.1, 0.5})
        for (const double blend : {0.0, 0.5}) {
            Scene scene;
            place(scene, rectangle("floor", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), grey("", 0.5f));
            Light light = pointLight({0.3, 0.2, 1}, glm::dvec3(1));
            light.hasCone = true;
            light.coneAngle = angle;
            light.coneBlend = blend;
            scene.addLight(light);
            // Half of the light of the soft part is missing.
            const double exact = 2 * kPi * (1 - std::cos(0.5 * angle)) * (1 - 0.5 * blend) / 4;
            EXPECT_NEAR(gatherFinely(scene).front(), exact, 0.003 * exact)
                << "angle " << angle << ", blend " << blend;
        }
}

TEST(SpotLight, DimsWithTheCosineWhereItIsAskedTo) {
    Scene scene;
    placeReceiver(scene, {2, 0, 0});
    Light light = pointLight({0, 0, 2}, glm::dvec3(1));
    light.hasCone = true;
    light.coneAngle = 3;
    light.coneDims = true;
    scene.addLight(light);
    const double exact = std::pow(std::cos(0.25 * kPi), 4) / 4;
    EXPECT_NEAR(gatherFinely(scene).front(), exact, kSampled * exact);
}

TEST(SunLight, GivesItsIrradianceTimesTheCosine) {
    for (double angle : {0.0, 0.1}) {
        Scene scene;
        placeReceiver(scene);
        place(scene, rectangle("slope", {5, 0, 0}, {1, 0, 1}, {0, 1, 0}), grey("", 0.5f));
        scene.addLight(sunLight({0.3, 0.4, 2}, {2, 3, 4}, angle));
        const GatheredShot shot = gatherFinely(scene);
        const glm::dvec3 d = glm::normalize(glm::dvec3(0.3, 0.4, 2));
        const double slope = glm::dot(d, glm::normalize(glm::dvec3(-1, 0, 1)));
        EXPECT_NEAR(shot.front(0), 2 * d.z, 1e-5);
        EXPECT_NEAR(shot.front(1), 2 * slope, 1e-5);
        EXPECT_NEAR(shot.light.irradiance[0].z, 4 * d.z, 1e-5);
        EXPECT_EQ(shot.back(0), 0);
    }
}

TEST(SunLight, AWideSunOnTheHorizonIsHalfSeen) {
    Scene scene;
    placeReceiver(scene);
    const double half = 0.3;
    scene.addLight(sunLight({1, 0, 0}, glm::dvec3(1), 2 * half));
    // The radiance is 1 / (pi sin^2 half). It is integrated over the upper half of the disk with
    // the factor sin^2(theta) sin(phi).
    const double exact =
        (half - 0.5 * std::sin(2 * half)) / (kPi * std::sin(half) * std::sin(half));
    const GatheredShot shot = gatherFinely(scene);
    EXPECT_NEAR(shot.front(), exact, 2 * kSampled * exact) << "half of the samples see nothing";
    EXPECT_NEAR(shot.back(), exact, 2 * kSampled * exact);
}

TEST(AreaLight, ARectangleHasLambertsClosedForm) {
    Scene scene;
    placeReceiver(scene);
    placeReceiver(scene, {1.5f, 0.7f, 0});
    // Upright, partly facing the light.
    placeReceiver(scene, {1.5f, 0, 1}, {0, 0, 1}, {0, 1, 0});
    scene.addLight(areaLight({0, 0, 1.2}, {0.5, 0, 0}, {0, -0.8, 0}, glm::dvec3(7)));
    const GatheredShot shot = gatherFinely(scene);
    const glm::dvec3 lamp[4] = {
        {-0.5, 0.8, 1.2}, {0.5, 0.8, 1.2}, {0.5, -0.8, 1.2}, {-0.5, -0.8, 1.2}};
    const double below = 7 * polygonIrradiance({0, 0, 0}, {0, 0, 1}, lamp, 4);
    const double beside = 7 * polygonIrradiance({1.5, 0.7, 0}, {0, 0, 1}, lamp, 4);
    const double upright = 7 * polygonIrradiance({1.5, 0, 1}, {-1, 0, 0}, lamp, 4);
    EXPECT_NEAR(shot.front(0), below, kExact * below);
    EXPECT_NEAR(shot.front(1), beside, kExact * beside);
    // At 0.2 m below the lamp's plane the size of 2 mm matters more.
    EXPECT_NEAR(shot.front(2), upright, 10 * kExact * upright);
}

// A lamp is about as large as it is near. Few samples reach its rim, which gives little of its
// light.
TEST(AreaLight, ALargeOneNearByShinesFromWhereItIs) {
    constexpr int kCells = 60, kSteps = 40;
    constexpr double kWidth = 3, kHeight = 0.98, kLamp = 1.5;
    Scene scene;
    scene.addLight(
        areaLight({0.2, 0.1, kHeight}, {kLamp / 2, 0, 0}, {0, -kLamp / 2, 0}, glm::dvec3(7)));
    Material rough = grey("", 0.5f);
    rough.sides[0].scattering.diffuseModel = RB_DIFFUSE_OREN_NAYAR;
    place(scene,
          grid("floor", {-kWidth / 2, -kWidth / 2, 0}, {kWidth, 0, 0}, {0, kWidth, 0}, kCells,
               kCells),
          rough);
    const GatheredShot shot = gatherFinely(scene);
    // Means over all light of 1 - c and of its square, from `angles` and from `directions`.
    glm::dvec2 expected(0.0), angles(0.0), directions(0.0);
    for (uint32_t p = 0; p < shot.patches.count(); ++p) {
        const glm::dvec3 point(shot.patches.point(p, glm::vec2(0.5f)));
        double all = 0;
        glm::dvec2 terms(0.0);
        for (int i = 0; i < kSteps; ++i)
            for (int j = 0; j < kSteps; ++j) {
                const glm::dvec3 way =
                    glm::dvec3(0.2 + kLamp * ((i + 0.5) / kSteps - 0.5),
                               0.1 + kLamp * ((j + 0.5) / kSteps - 0.5), kHeight) -
                    point;
                const double c = way.z / glm::length(way), e = c * c / glm::dot(way, way);
                all += e;
                terms += e * glm::dvec2(1 - c, (1 - c) * (1 - c));
            }
        const FirstShot& light = shot.light;
        const double here = double(light.irradiance[2 * p].x);
        expected += here / all * terms;
        angles += here * glm::dvec2(light.angles[2 * p].x, light.angles[2 * p].y);
        const Incoming& incoming = light.incoming[2 * p];
        for (size_t k = 0; k < Incoming::kCount; ++k) {
            const double rest = 1 - double(incoming.direction(k).z);
            directions +=
                here * double(incoming.weight) / Incoming::kCount * glm::dvec2(rest, rest * rest);
        }
    }
    // Without correction both would be 4 and 6 % too grazing. Of the error of `angles` 1.2 and 1.5
    // % remain, because the corrected bias falls only with the square of the number of samples.
    // `directions` have noise alone.
    for (int k = 0; k < 2; ++k) {
        EXPECT_NEAR(angles[k] / expected[k], 1, 0.02) << k;
        EXPECT_NEAR(directions[k] / expected[k], 1, 0.02) << k;
    }
}

TEST(AreaLight, AnEllipseUnderItsCentreHasAClosedForm) {
    Scene scene;
    placeReceiver(scene);
    const double r = 0.6, h = 1.1;
    scene.addLight(areaLight({0, 0, h}, {0, r, 0}, {r, 0, 0}, glm::dvec3(7), RB_AREA_ELLIPSE));
    const double exact = 7 * kPi * r * r / (r * r + h * h);
    EXPECT_NEAR(gatherFinely(scene).front(), exact, kSampled * exact);
}

TEST(AreaLight, ShinesToItsFrontOnly) {
    for (rb_area_shape shape : {RB_AREA_RECTANGLE, RB_AREA_ELLIPSE}) {
        Scene scene;
        placeReceiver(scene);
        scene.addLight(areaLight({0, 0, 1}, {1, 0, 0}, {0, 1, 0}, glm::dvec3(7), shape));
        EXPECT_EQ(gatherFinely(scene).front(), 0);
    }
}

}  // namespace
}  // namespace raybundle
