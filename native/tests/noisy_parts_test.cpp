// SPDX-License-Identifier: GPL-3.0-or-later
//
// Noise of what is shown: the noise of each object, relative to its own light.
#include "stated_error/noisy_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

constexpr int kSmallThings = 4;

// A room with a lamp behind a screen that keeps the light from one half of the room, with small
// boxes in both halves.
Scene roomOfSmallThings() {
    Scene scene;
    place(scene, box("room", glm::vec3(0), glm::vec3(4, 2, 2), true), grey("walls", 0.6f));
    place(scene, box("screen", {2, 0, 0}, {2.1f, 2, 1.4f}, false), grey("screen", 0.6f));
    for (int k = 0; k < kSmallThings; ++k) {
        const glm::vec3 low(0.6f + 0.9f * float(k), 0.7f, 0.3f);
        place(scene, box("thing", low, low + glm::vec3(0.1f, 0.12f, 0.07f), false),
              grey("thing", 0.6f));
    }
    scene.addLight(areaLight({1, 1, 1.9}, {0.2, 0, 0}, {0, -0.2, 0}, glm::dvec3(10)));
    return scene;
}

// Returns the RMS difference of the light at the corners of an object, relative to the light there.
// Corners with less than a twentieth of the mean light are left out.
double differenceOf(int32_t instance, const Bake& bake, const Bake& reference) {
    const std::vector<glm::vec3> found = cornerLight(bake, instance, RB_OUTPUT_LIGHTING);
    const std::vector<glm::vec3> right = cornerLight(reference, instance, RB_OUTPUT_LIGHTING);
    float mean = 0;
    const std::vector<glm::vec3> ofRoom = cornerLight(reference, 0, RB_OUTPUT_LIGHTING);
    for (const glm::vec3& light : ofRoom) mean += light.x / float(ofRoom.size());
    double squares = 0;
    for (size_t c = 0; c < found.size(); ++c)
        squares +=
            std::pow(double((found[c].x - right[c].x) / std::max(right[c].x, 0.05f * mean)), 2);
    return std::sqrt(squares / double(found.size()));
}

size_t sidesWithRays(const Bake& bake) {
    return skippedCount(reportOf(bake), SkippedWork::RAYED_SIDES);
}

TEST(NoisyParts, SmallAndDarkThingsAreAsCleanAsWalls) {
    const Scene scene = roomOfSmallThings();
    Bake reference;
    reference.settings.minBundles = reference.settings.maxBundles = 16384;
    reference.settings.targetError = 0.002f;
    reference.settings.seed = 1000;
    reference.run(scene);
    Bake bake;
    bake.run(scene);
    EXPECT_GT(sidesWithRays(bake), 0u);
    const int bundles = reportOf(bake)["bundles"];
    EXPECT_LT(bundles, 4096);
    // As many bundles, but without extra rays.
    Bake lines;
    lines.settings.minBundles = lines.settings.maxBundles = bundles;
    lines.run(scene);
    EXPECT_EQ(sidesWithRays(lines), 0u);
    double most = 0, mostOfLines = 0;
    for (int32_t instance = 2; instance < 2 + kSmallThings; ++instance) {
        most = std::max(most, differenceOf(instance, bake, reference));
        mostOfLines = std::max(mostOfLines, differenceOf(instance, lines, reference));
    }
    // Twice the target: the noise of a part is known within a third, and the noise at a box's 24
    // corners differs by as much from bake to bake.
    EXPECT_LT(most, 2 * 0.02);
    // Dark objects gain most: half of their noise, measured with seeds 0 to 4.
    EXPECT_LT(most, 0.75 * mostOfLines);
}

// A bed under an even sky. Most of its faces see only sky and have no noise. The noise at the
// corners of those between mattress and frame, where a fit continues the slopes of what little is
// exposed, says nothing about them.
TEST(NoisyParts, NearlyCoveredFacesMakeNoOthersNoisy) {
    Scene scene;
    place(scene, box("mattress", {0, 0, 0.3f}, {2, 1, 0.5f}, false), grey("grey", 0.7f));
    place(scene, box("frame", {-0.05f, -0.05f, 0}, {2.05f, 1.05f, 0.28f}, false),
          grey("grey", 0.7f));
    place(scene, box("head", {-0.1f, -0.05f, 0}, {-0.005f, 1.05f, 0.9f}, false),
          grey("grey", 0.7f));
    scene.worldRadiance = glm::dvec3(1);
    constexpr int kSeeds = 4;
    int bundles = 0;
    for (int seed = 0; seed < kSeeds; ++seed) {
        Bake bake;
        bake.settings.seed = seed;
        bake.run(scene);
        bundles += int(reportOf(bake)["bundles"]) / kSeeds;
    }
    // Measured 154; it was 939 when each object had one ratio of measured to predicted
    // noise. The number varies by half from seed to seed.
    EXPECT_LT(bundles, 400);
}

TEST(NoisyParts, StatedNoiseIsThatWithRays) {
    const Scene scene = roomOfSmallThings();
    Bake one, two;
    two.settings.seed = 1;
    for (Bake* bake : {&one, &two}) bake->run(scene);
    std::vector<glm::vec3> a, b;
    for (int32_t instance = 0; instance < int32_t(scene.instances.size()); ++instance)
        for (const auto& [bake, all] : {std::pair{&one, &a}, std::pair{&two, &b}}) {
            const auto own = cornerLight(*bake, instance, RB_OUTPUT_LIGHTING);
            all->insert(all->end(), own.begin(), own.end());
        }
    const double found = noise(a, b) / std::sqrt(2.0);
    const double stated = std::hypot(reportOf(one)["error"]["noise"].get<double>(),
                                     reportOf(two)["error"]["noise"].get<double>()) /
                          std::sqrt(2.0);
    // One pair of bakes, whose bundles have correlated errors on whole walls. All corners have
    // equal weight here.
    EXPECT_LT(found, 2.5 * stated);
    EXPECT_GT(found, stated / 2.5);
}

TEST(NoisyParts, StatedNoiseOfAnObjectIsThatAtItsCorners) {
    const Scene scene = roomOfSmallThings();
    constexpr int kSeeds = 8;
    const size_t objects = scene.instances.size();
    std::vector<std::vector<std::vector<glm::vec3>>> light(kSeeds);  // per seed and object
    std::vector<std::vector<double>> stated(kSeeds);
    for (int seed = 0; seed < kSeeds; ++seed) {
        Bake bake;
        bake.settings.seed = seed + 1;
        bake.run(scene);
        for (size_t i = 0; i < objects; ++i) {
            light[seed].push_back(cornerLight(bake, int32_t(i), RB_OUTPUT_LIGHTING));
            stated[seed].push_back(reportOf(bake)["objects"][i]["error"]["noise"]);
        }
    }
    int covered = 0;
    double allStated = 0, allFound = 0;
    for (size_t i = 0; i < objects; ++i) {
        std::vector<glm::vec3> mean(light[0][i].size(), glm::vec3(0));
        for (const auto& ofSeed : light)
            for (size_t c = 0; c < mean.size(); ++c) mean[c] += ofSeed[i][c] / float(kSeeds);
        for (int seed = 0; seed < kSeeds; ++seed) {
            const double found = noise(mean, light[seed][i]) / std::sqrt(1 - 1.0 / kSeeds);
            covered += found < 1.25 * stated[seed][i];
            allStated += stated[seed][i];
            allFound += found;
        }
    }
    // native/bench/calibration requires 0.95 of all objects. Here each object has one face per
    // side, for which the halves give few samples, and all of these are low in one bake of eight:
    // measured 43 of 48.
    EXPECT_GE(covered, int(0.9 * kSeeds * double(objects)));
    // The noise at corners of few faces is stated on the safe side (measured: 2.1 times the true
    // noise).
    EXPECT_LT(allStated, 2.5 * allFound);
}

TEST(NoisyParts, RaysFollowFromTheLightAlone) {
    // The same light needs the same rays, whatever was baked before.
    Scene scene = roomOfSmallThings();
    Bake fresh, again;
    again.run(scene);
    scene.lights[0].strength *= 2.0;
    again.run(scene);
    fresh.run(scene);
    EXPECT_GT(sidesWithRays(fresh), 0u);
    // The halves are solved to their tolerance from the solution of the bake before, so that a side
    // may cast two rays of some hundred more or less.
    EXPECT_LT(difference(everything(again), everything(fresh)), 1e-3);
}

}  // namespace
}  // namespace raybundle
