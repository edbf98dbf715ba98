// SPDX-License-Identifier: GPL-3.0-or-later
//
// Spread of area lights, lights without shadows, and the visibility of instances.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bundles/directions.h"
#include "sampling/area_spread.h"
#include "test_bakes.h"
#include "test_scenes.h"
#include "test_shots.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

using namespace test;

const double kSpreads[] = {0.02, 0.3, 1.0, 2.0, 3.0, kPi};
constexpr FirstShotKind kShots[] = {FirstShotKind::GATHER, FirstShotKind::SHOOT,
                                    FirstShotKind::EXTENDED};

// Returns the integral of a function of the angle over the half space, weighted by the cosine and
// divided by pi.
template <class Function>
double overHalfSpace(double most, const Function& function) {
    constexpr int kSteps = 20000;
    double sum = 0;
    for (int k = 0; k < kSteps; ++k) {
        const double t = most * (k + 0.5) / kSteps;
        sum += 2 * std::sin(t) * std::cos(t) * function(t) * most / kSteps;
    }
    return sum;
}

TEST(AreaSpread, KeepsThePower) {
    for (double spread : kSpreads) {
        const AreaSpread s(spread);
        const double mean = overHalfSpace(
            0.5 * spread, [&](double t) { return double(s.factor(float(std::cos(t)))); });
        // The cosine in float is coarse for a narrow spread.
        EXPECT_NEAR(mean, 1, spread < 0.1 ? 3e-3 : 1e-4) << "spread " << spread;
        if (spread < 3) {
            EXPECT_EQ(s.factor(float(std::cos(0.51 * spread))), 0) << "spread " << spread;
        }
    }
}

TEST(AreaSpread, DrawsDirectionsByItsFactor) {
    const glm::vec3 normal = glm::normalize(glm::vec3(1, 2, -2));
    std::mt19937_64 random(1);
    constexpr int kDraws = 20000;
    for (double spread : kSpreads) {
        const AreaSpread s(spread);
        // Mean of the squared angle, relative to the square of the largest angle.
        auto square = [&](double t) { return std::pow(t / (0.5 * spread), 2); };
        const double exact = overHalfSpace(0.5 * spread, [&](double t) {
            return double(s.factor(float(std::cos(t)))) * square(t);
        });
        double first = 0, second = 0;
        glm::dvec3 mean(0.0);
        for (int k = 0; k < kDraws; ++k) {
            const glm::vec4 u = uniformPoint(random);
            const glm::dvec3 d(s.emit(normal, {u.x, u.y}));
            ASSERT_NEAR(glm::length(d), 1, 1e-5);
            const double t = std::asin(
                std::min(1.0, glm::length(glm::cross(glm::normalize(d), glm::dvec3(normal)))));
            first += square(t) / kDraws;
            second += square(t) * square(t) / kDraws;
            mean += d / double(kDraws);
        }
        const double error = std::sqrt((second - first * first) / kDraws);
        // The 0.3 % are for the cosine in float, as above.
        EXPECT_NEAR(first, exact, kSigmas * error + 0.003 * exact) << "spread " << spread;
        EXPECT_NEAR(glm::dot(glm::normalize(mean), glm::dvec3(normal)), 1, 1e-3);
    }
}

// Returns the irradiance at a point of the plane z = 0, facing up, from an area light with a
// spread, by direct summation.
double exactSpread(const Light& light, const glm::dvec3& point) {
    constexpr int kSteps = 1500;
    const AreaSpread s(light.spread);
    const glm::dvec3 n = glm::cross(light.axisU, light.axisV);
    const glm::dvec3 normal = glm::normalize(n);
    double sum = 0;
    for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j) {
            const double a = 2 * (i + 0.5) / kSteps - 1, b = 2 * (j + 0.5) / kSteps - 1;
            if (light.areaShape == RB_AREA_ELLIPSE && a * a + b * b > 1) continue;
            const glm::dvec3 d = light.position + a * light.axisU + b * light.axisV - point;
            const double r2 = glm::dot(d, d), r = std::sqrt(r2);
            const double cosine = -glm::dot(d, normal) / r;
            if (cosine <= 0 || d.z <= 0) continue;
            sum += double(s.factor(float(cosine))) * cosine * d.z / r / r2;
        }
    return light.strength.x * sum * 4 * glm::length(n) / (double(kSteps) * kSteps);
}

TEST(AreaLight, WithASpreadGivesItsIntegral) {
    for (rb_area_shape shape : {RB_AREA_RECTANGLE, RB_AREA_ELLIPSE})
        for (double spread : {0.2, 1.0, 2.5})
            for (const glm::dvec3 tilt : {glm::dvec3(0, 0, 0), glm::dvec3(0.1, 0, 0.15)}) {
                if (kFewBakes && (tilt.x > 0 || spread == 1)) continue;
                Scene scene;
                place(scene, rectangle("ground", {-20, -20, -5}, {40, 0, 0}, {0, 40, 0}),
                      grey("", 0));
                const glm::vec3 points[] = {{0, 0, 0}, {0.3f, 0.1f, 0}, {0.6f, -0.2f, 0}};
                for (const glm::vec3& p : points)
                    place(scene,
                          grid("receiver", p - glm::vec3(0.001f, 0.001f, 0), {0.002f, 0, 0},
                               {0, 0.002f, 0}, 6, 6),
                          grey("", 0.5f));
                Light light = areaLight({0, 0, 1.5}, glm::dvec3(0.5, 0.1, 0) + tilt, {0.2, -0.4, 0},
                                        glm::dvec3(3), shape);
                light.spread = spread;
                scene.addLight(light);
                const ShotScene shot(scene, 10);
                const FirstShot gathered = shot.shoot(FirstShotKind::GATHER, 0, 0, 0.002f);
                for (uint32_t k = 0; k < 3; ++k) {
                    const double exact = exactSpread(light, glm::dvec3(points[k]));
                    // 16 to 256 stratified samples of a factor that ends in a kink, or at the rim
                    // of an ellipse, leave up to 5 % of noise, 1 % in the mean of 36 patches.
                    EXPECT_NEAR(meanLight(shot.patches, gathered, k + 1).value, exact,
                                0.02 * exact + 1e-3)
                        << "spread " << spread << ", shape " << shape << ", receiver " << k;
                }
            }
}

TEST(AreaLight, WithASpreadIsTheSameGatheredAndShot) {
    Scene scene = roomWithBoxes(0.5f);
    Light light = areaLight({2, 1.6, 2.6}, {0.3, 0, 0}, {0, -0.3, 0}, glm::dvec3(2));
    light.spread = 1.2;
    scene.addLight(light);
    const ShotScene room(scene, 0.5f);
    const FirstShot gathered = room.shoot(FirstShotKind::GATHER, 0, 0, 0.005f);
    const FirstShot shot = room.shoot(FirstShotKind::SHOOT, 1 << 18);
    const double power = kPi * 2 * 0.36;
    EXPECT_NEAR(arriving(room.patches, shot).x, power, 1e-4 * power);
    EXPECT_NEAR(arriving(room.patches, gathered).x, power, 0.005 * power);
    EXPECT_NEAR(gathered.emitted.x, power, 1e-4 * power);
    for (uint32_t instance = 0; instance < 3; ++instance) {
        const Mean mean = meanLight(room.patches, shot, instance);
        EXPECT_NEAR(meanLight(room.patches, gathered, instance).value, mean.value,
                    kSigmas * mean.error + 0.005 * mean.value)
            << "instance " << instance;
    }
}

// A ground under a lamp, with a roof between them that does not block some kinds of light.
struct Roofed {
    Scene scene;

    explicit Roofed(bool castsShadows, bool stopsDirect) {
        place(scene, rectangle("ground", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), grey("", 0.5f));
        place(scene, rectangle("roof", {-3, -3, 0.5f}, {6, 0, 0}, {0, 6, 0}), grey("", 0.5f));
        scene.instances[1].stopsDirect = stopsDirect;
        Light light = pointLight({0.2, 0.1, 1.5}, glm::dvec3(2));
        light.castsShadows = castsShadows;
        scene.addLight(light);
    }
};

TEST(DirectLight, PassesWhatDoesNotStopIt) {
    Scene open = Roofed(true, true).scene;
    open.instances.pop_back();
    const ShotScene lit(open, 0.25f), covered(Roofed(true, true).scene, 0.25f);
    const double ground =
        meanLight(lit.patches, lit.shoot(FirstShotKind::GATHER, 0, 0, 0.003f), 0).value;
    const FirstShot shadow = covered.shoot(FirstShotKind::GATHER, 0, 0, 0.003f);
    const double roof = meanLight(covered.patches, shadow, 1).value;
    ASSERT_GT(ground, 0.3);
    EXPECT_EQ(meanLight(covered.patches, shadow, 0).value, 0);
    for (bool castsShadows : {false, true}) {
        const Scene scene = Roofed(castsShadows, !castsShadows).scene;
        const Patches patches = subdivide(scene, 0.25f, 10000);
        const Visibility direct(patches, Blockers::STOPPING_DIRECT), exchange(patches);
        const DirectLight light(scene, patches, direct, 0);
        Settings settings;
        settings.localRays = 1 << 16;
        for (FirstShotKind kind : kShots) {
            const FirstShot shot =
                firstShot(kind, {light, patches, direct, settings, Progress(), 100, &exchange});
            const Mean onGround = meanLight(patches, shot, 0), onRoof = meanLight(patches, shot, 1);
            // At most 1 % of noise if the light is shot, half of it if gathered.
            EXPECT_NEAR(onGround.value, ground, kSigmas * onGround.error + 0.005 * ground)
                << choiceName(kind);
            EXPECT_NEAR(onRoof.value, roof, kSigmas * onRoof.error + 0.005 * roof)
                << choiceName(kind);
            EXPECT_EQ(meanLight(patches, shot, 0, 1).value, 0) << choiceName(kind) << ": the back";
            // Light that arrives unstopped counts as emitted; all remaining light escapes.
            const double arrived = arriving(patches, shot).x;
            EXPECT_NEAR(shot.emitted.x, arrived + shot.escaped.x, 0.03 * arrived)
                << choiceName(kind);
        }
    }
}

// A closed furnace with a box in it.
Scene furnaceWithBox(float reflectance, bool stopsDirect, bool exchanges) {
    Scene scene;
    place(scene, box("furnace", {0, 0, 0}, {2, 2, 2}, true), grey("", 0.5f, 1));
    place(scene, box("inside", {0.7f, 0.6f, 0.8f}, {1.2f, 1.3f, 1.4f}, false),
          grey("", reflectance));
    scene.instances[1].stopsDirect = stopsDirect;
    scene.instances[1].exchanges = exchanges;
    return scene;
}

TEST(Exchange, PassesAnInstanceThatTakesNoPart) {
    Bake bake;
    setQuick(bake);
    bake.run(furnaceWithBox(0, true, false));
    // A black box that took part would darken the furnace.
    for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_COMBINED))
        EXPECT_NEAR(light.x * kPi, 2, 1e-4);
    // All surfaces around the box have the same exitance, so the box gets the same light from all
    // sides.
    for (const glm::vec3& light : cornerLight(bake, 1, RB_OUTPUT_LIGHTING))
        EXPECT_NEAR(light.x * kPi, 2, 1e-3);
    EXPECT_LT(double(reportOf(bake)["energy"]["balance_error"]), 1e-3);

    bake.run(furnaceWithBox(0, true, true));
    EXPECT_LT(cornerLight(bake, 0, RB_OUTPUT_COMBINED)[0].x * kPi, 1.99)
        << "the lines of before were used";
}

TEST(Exchange, StopsDirectLightOnlyIfItIsToldTo) {
    // A lamp above a floor. The roof between them is absent either for direct light or for the
    // exchange.
    Bake bake;
    setQuick(bake, 256);
    for (bool stopsDirect : {false, true}) {
        Scene scene = Roofed(true, stopsDirect).scene;
        scene.instances[1].exchanges = !stopsDirect;
        scene.worldRadiance = glm::vec3(0.1f);
        bake.run(scene);
        double direct = 0;
        for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_DIRECT))
            direct += double(light.x) / 4;
        // The world shines in if the roof takes no part in the exchange, the lamp if the roof does
        // not stop direct light.
        if (stopsDirect)
            EXPECT_NEAR(direct, 0.1, 1e-3);
        else
            EXPECT_GT(direct, 0.12);
        for (const glm::vec3& light : cornerLight(bake, 1, RB_OUTPUT_DIRECT))
            EXPECT_GT(light.x, 0.1f) << "it receives both";
        EXPECT_LT(double(reportOf(bake)["energy"]["balance_error"]), 0.02);
    }
}

TEST(Exchange, SaysWhereItIsNotExact) {
    Bake bake;
    setQuick(bake, 16);
    bake.settings.solver = Solver::RANDOM_WALK;
    bake.settings.directions = DirectionKind::RANDOM;
    bake.run(furnaceWithBox(0.5f, true, false));
    EXPECT_TRUE(mentions(reportOf(bake)["warnings"], "inside"));
    EXPECT_TRUE(mentions(reportOf(bake)["warnings"], "LINE_REUSE"));
    // The furnace itself is right. The tolerance of 20 % is more than the noise of these few walks.
    for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_COMBINED))
        EXPECT_NEAR(light.x * kPi, 2, 0.4);
}

}  // namespace
}  // namespace raybundle
