// SPDX-License-Identifier: GPL-3.0-or-later
//
// The first shot EXTENDED: no power is lost or counted twice on the way to the bundles, and light
// that begins in one place is spread.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test_bakes.h"
#include "test_scenes.h"
#include "test_shots.h"

namespace raybundle {
namespace {

using namespace test;

// A room whose lamp shines upwards at the ceiling. Little of the room sees the lamp.
Scene lampToTheCeiling(float reflectance) {
    Scene scene = roomWithBoxes(reflectance);
    scene.addLight(areaLight({2, 1.6, 2.4}, {0.3, 0, 0}, {0, 0.3, 0}, {5, 4, 3}));
    return scene;
}

// The absorbed power of a bake, W, and its reflected power, by patch sides; channel 0.
struct Totals {
    double absorbed = 0, reflected = 0;
};
Totals totalsOf(const Bake& bake) {
    Totals totals;
    const Patches& patches = bake.patches();
    const Irradiance& light = bake.patchIrradiance();
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        const double power =
            double(patches.area[side / 2]) * double(light.direct[side].x + light.indirect[side].x);
        const double rho = double(patches.reflectance[side].x);
        totals.absorbed += (1 - rho) * power;
        totals.reflected += rho * power;
    }
    return totals;
}

// Returns the relative RMS difference of the light on the sides in two bakes of one scene, by area.
double distanceOf(const Bake& a, const Bake& b) {
    double squares = 0, signal = 0;
    for (size_t side = 0; side < a.patches().sideCount(); ++side) {
        auto total = [&](const Bake& bake) {
            const Irradiance& h = bake.patchIrradiance();
            return glm::dvec3(h.direct[side] + h.indirect[side]);
        };
        const double area = double(a.patches().area[side / 2]);
        const glm::dvec3 d = total(a) - total(b);
        squares += area * glm::dot(d, d);
        signal += area * glm::dot(total(b), total(b));
    }
    return std::sqrt(squares / signal);
}

TEST(LocalToGlobalRatio, GivesTheExamplesOfTheThesis) {
    // The examples of section 3.4, which are given with two decimals.
    EXPECT_NEAR(localToGlobalRatio(2.1, 0.577, 0.7, 0.073), 0.41, 0.005);
    EXPECT_NEAR(localToGlobalRatio(2.1, 0.577, 0.577, 1), 1.06, 0.005);
    EXPECT_NEAR(localToGlobalRatio(2.1, 0.577, 0.65, 0.67), 0.85, 0.005);
}

TEST(ExtendedFirstShot, LosesNoPowerInAClosedRoom) {
    for (float reflectance : {0.0f, 0.3f, 0.7f, 0.97f}) {
        const ShotScene room(lampToTheCeiling(reflectance), 0.5f);
        const FirstShot shot = room.shoot(FirstShotKind::EXTENDED, 20000);
        glm::dvec3 absorbed(0.0), left(0.0);
        for (size_t side = 0; side < room.patches.sideCount(); ++side) {
            const double area = double(room.patches.area[side / 2]);
            absorbed += area * (1 - double(reflectance)) *
                        glm::dvec3(shot.irradiance[side] + shot.indirect[side]);
            left += area * glm::dvec3(shot.unshot[side]);
        }
        const glm::dvec3 power = kPi * 0.36 * glm::dvec3(5, 4, 3);
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(absorbed[c] + left[c], power[c], 1e-5 * power[c]) << reflectance;
        EXPECT_NEAR(shot.escaped.x, 0, 1e-5 * power.x);
        // The light of the sources equals that of SHOOT with the same lines.
        EXPECT_EQ(shot.irradiance, room.shoot(FirstShotKind::SHOOT, 20000).irradiance);
    }
}

TEST(ExtendedFirstShot, SpreadsTheLightOfALampThatShinesAtTheCeiling) {
    const ShotScene room(lampToTheCeiling(0.6f), 0.25f);
    const Patches& patches = room.patches;
    const FirstShot shot = room.shoot(FirstShotKind::EXTENDED, 300000);
    double lit = 0, reached = 0, area = 0, brightest = 0, brightestBefore = 0;
    for (uint32_t side = 0; side < patches.sideCount(); side += 2) {
        const double a = double(patches.area[side / 2]);
        area += a;
        lit += shot.irradiance[side].x > 0 ? a : 0;
        reached += shot.unshot[side].x > 0 ? a : 0;
        brightest = std::max(brightest, double(shot.unshot[side].x));
        brightestBefore = std::max(brightestBefore, 0.6 * double(shot.irradiance[side].x));
    }
    // Everything but the corners below and behind the boxes.
    EXPECT_LT(lit, 0.5 * area);
    EXPECT_GT(reached, 0.9 * area);
    // No side keeps more than the threshold (eq. 3.2; only fronts are lit, and both sides reflect)
    // plus one line that arrived in the last round.
    const double power = kPi * 0.36 * 5;
    const double threshold = 0.6 * power / (patches.totalArea * 0.4);
    double smallest = INFINITY;
    for (float a : patches.area) smallest = std::min(smallest, double(a));
    EXPECT_GT(brightestBefore, 3 * threshold);
    EXPECT_LT(brightest, threshold + 0.6 * 12.0 / 5 * power / 300000 / smallest);
}

TEST(ExtendedFirstShot, TakesTheLinesOfTheThesisWithFixedBundles) {
    const ShotScene room(lampToTheCeiling(0.6f), 0.5f);
    const Patches& patches = room.patches;
    const double intersections =
        patches.totalArea / (2 * kPi * double(patches.radius) * double(patches.radius));
    const double wanted = localToGlobalRatio(intersections, 0.6, 0.6, 1) * 32 * 500;
    const FirstShot shot = room.shoot(FirstShotKind::EXTENDED, 0, 0, 0.02f, 500, 32);
    EXPECT_GE(double(shot.rays), wanted - 1);
    EXPECT_LT(double(shot.rays), 2.5 * wanted) << "with the rounds' lines";
}

TEST(ExtendedFirstShot, GivesTheLightOfThePlainBake) {
    for (float gap : {0.1f, 0.0f})
        for (bool up : {false, true}) {
            Scene scene = roomWithBoxes(0.6f, 0, gap);
            scene.addLight(areaLight({2, 1.6, up ? 2.3 : 2.6}, {0.3, 0, 0}, {0, up ? 0.3 : -0.3, 0},
                                     {5, 4, 3}));
            Bake plain, extended;
            setQuick(plain, 256);
            setQuick(extended, 256);
            plain.settings.contacts = 0;  // to have the same patches in both
            extended.settings.firstShot = FirstShotKind::EXTENDED;
            extended.settings.localRays = 1 << 18;
            plain.run(scene);
            extended.run(scene);
            const double stated = std::hypot(reportOf(plain)["estimated_error"].get<double>(),
                                             reportOf(extended)["estimated_error"].get<double>());
            // The stated error is accurate to some ten per cent: it has only two halves, and the
            // noise of lines follows from pooled counts.
            EXPECT_LT(distanceOf(extended, plain), 1.5 * stated) << up << ", gap " << gap;
            EXPECT_LT(stated, 0.06);
            const Totals a = totalsOf(plain), b = totalsOf(extended);
            EXPECT_NEAR(b.absorbed, a.absorbed, 0.005 * a.absorbed) << up << ", gap " << gap;
        }
}

TEST(ExtendedFirstShot, CountsNothingTwiceInAFurnaceWithAStrongLamp) {
    // All walls emit 0.5 W/m^2, which is left to the bundles, and a lamp emits as much power and
    // more. In a closed room of one reflectance the reflected light in all is rho / (1 - rho) times
    // the emitted light.
    Scene scene = roomWithBoxes(0.5f, 0.5f);
    const double watts = 4 * kPi * 20;
    scene.addLight(pointLight({2.2, 1.7, 2}, glm::dvec3(20)));
    Bake bake;
    setQuick(bake);
    bake.settings.firstShot = FirstShotKind::EXTENDED;
    bake.settings.localRays = 50000;
    bake.run(scene);
    double walls = 0;
    for (float area : bake.patches().area) walls += 0.5 * double(area);
    const Totals totals = totalsOf(bake);
    // The insides of the boxes and the outside of the room are dark.
    EXPECT_NEAR(totals.reflected, watts + walls, 2e-3 * (watts + walls));
    EXPECT_NEAR(totals.absorbed, watts + walls, 2e-3 * (watts + walls));
    EXPECT_LT(reportOf(bake)["energy"]["balance_error"].get<double>(), 2e-3);
}

TEST(ExtendedFirstShot, BalancesAnOpenScene) {
    for (FirstShotKind kind : {FirstShotKind::SHOOT, FirstShotKind::EXTENDED})
        for (bool isSun : {false, true}) {
            Scene scene;
            place(scene, rectangle("ground", {-3, -3, 0}, {6, 0, 0}, {0, 6, 0}), grey("", 0.7f));
            place(scene, box("house", {-0.5f, -0.5f, 0}, {0.5f, 0.5f, 1}, false), grey("", 0.8f));
            if (isSun)
                scene.addLight(sunLight({0.3, 0.4, 1}, {3, 2, 1}, 0.01));
            else
                scene.addLight(pointLight({1.2, 0.3, 1.5}, {3, 2, 1}));
            scene.worldRadiance = glm::vec3(0.02f);
            Bake bake;
            setQuick(bake);
            bake.settings.firstShot = kind;
            bake.settings.localRays = 1 << 17;
            bake.run(scene);
            const Json energy = reportOf(bake)["energy"];
            EXPECT_LT(energy["balance_error"].get<double>(), 0.01)
                << choiceName(kind) << ", sun " << isSun << ": " << energy;
            EXPECT_GT(energy["escaped"].get<double>(), 0.2 * energy["emitted"].get<double>());
        }
}

TEST(ExtendedFirstShot, OfABakeDoesNotDependOnTheNumberOfThreads) {
    std::vector<glm::vec3> results[2];
    for (int k = 0; k < 2; ++k) {
        Bake bake;
        setQuick(bake, 16);
        bake.settings.firstShot = FirstShotKind::EXTENDED;
        bake.settings.localRays = 20000;
        bake.settings.threads = k ? 2 : 1;
        bake.run(lampToTheCeiling(0.6f));
        results[k] = everything(bake);
    }
    EXPECT_LT(difference(results[0], results[1]), 1e-5);
}

TEST(ExtendedFirstShot, IsUnbiasedFromSeedToSeed) {
    // Few local lines, so that errors of the rounds would show. Each run is compared with a
    // gathered first shot and the same bundles.
    const Scene scene = lampToTheCeiling(0.6f);
    constexpr int kSeeds = 60;
    Bake bakes[2];
    std::vector<double> first, second, mean;
    for (int seed = 0; seed < kSeeds; ++seed) {
        for (int k = 0; k < 2; ++k) {
            Bake& bake = bakes[k];
            setQuick(bake);
            bake.settings.patchSize = 0.8f;
            bake.settings.contacts = 0;  // to have the same patches in both
            bake.settings.targetError = 0.005f;
            bake.settings.seed = seed;
            bake.settings.firstShot = k ? FirstShotKind::EXTENDED : FirstShotKind::GATHER;
            bake.settings.localRays = 4000;
            bake.run(scene);
        }
        first.resize(bakes[0].patches().sideCount());
        second.resize(first.size());
        mean.resize(first.size());
        for (size_t i = 0; i < first.size(); ++i) {
            double h[2];
            for (int k = 0; k < 2; ++k)
                h[k] = double(bakes[k].patchIrradiance().direct[i].x) +
                       double(bakes[k].patchIrradiance().indirect[i].x);
            first[i] += (h[1] - h[0]) / kSeeds;
            second[i] += (h[1] - h[0]) * (h[1] - h[0]) / kSeeds;
            mean[i] += h[0] / kSeeds;
        }
    }
    double chi = 0, sides = 0, bias = 0, light = 0;
    for (size_t i = 0; i < first.size(); ++i) {
        if (mean[i] == 0) continue;
        const double variance = (second[i] - first[i] * first[i]) / (kSeeds - 1);
        chi += first[i] * first[i] / variance;
        ++sides;
        const double area = double(bakes[0].patches().area[i / 2]);
        bias += area * first[i];
        light += area * mean[i];
    }
    // The expected value is 1. It may vary by a half, because sides share the noise of the light
    // that reaches all of them.
    EXPECT_LT(chi / sides, 1.5);
    EXPECT_LT(std::abs(bias), 2e-3 * light);
    RecordProperty("chi_square_per_side", std::to_string(chi / sides));
    RecordProperty("bias", std::to_string(bias / light));
}

}  // namespace
}  // namespace raybundle
