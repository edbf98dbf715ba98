// SPDX-License-Identifier: GPL-3.0-or-later
//
// Every stochastic method is right in the mean over many seeds: in a cube with an exact solution,
// and in a room with two boxes against line reuse with many bundles.
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <string>
#include <vector>

#include "test_bakes.h"
#include "test_scenes.h"
#include "test_transports.h"

namespace raybundle {
namespace {

using namespace test;

// The tolerances follow from the measured errors.
constexpr int kBakes = kFewBakes ? 20 : 200;

struct Method {
    std::string name;
    std::vector<std::pair<std::string, std::string>> choices;
    // Enough bundles for a start-up bias of O(1 / bundles) to be below the error of the mean.
    int bundles = 128;
    int linesPerBundle = 0;
};

// Prints the name in the message of a failing test.
void PrintTo(const Method& method, std::ostream* out) { *out << method.name; }

const Method kMethods[] = {
    {"Multipath", {{"solver", "MULTIPATH"}}},
    {"MultipathSingleLines", {{"solver", "MULTIPATH"}}, 4096, 1},
    {"MultipathAdaptive", {{"solver", "MULTIPATH"}, {"directions", "ADAPTIVE"}}, 512},
    {"MultipathPlane", {{"solver", "MULTIPATH"}, {"projector", "PLANE"}}, 512},
    {"MultipathPlanes", {{"solver", "MULTIPATH"}, {"projector", "PLANES"}}, 512},
    {"MultipathShoot", {{"solver", "MULTIPATH"}, {"first_shot", "SHOOT"}}},
    {"MultipathExtended", {{"solver", "MULTIPATH"}, {"first_shot", "EXTENDED"}}},
    {"StochasticIteration", {{"solver", "STOCHASTIC_ITERATION"}}},
    {"StochasticIterationSingleRays", {{"solver", "STOCHASTIC_ITERATION"}}, 8192, 1},
    {"RandomWalkCollision", {{"solver", "RANDOM_WALK"}}, 16, 200},
    {"RandomWalkSurvival", {{"solver", "RANDOM_WALK"}, {"estimator", "SURVIVAL"}}, 16, 200},
    {"RandomWalkAbsorption", {{"solver", "RANDOM_WALK"}, {"estimator", "ABSORPTION"}}, 16, 200},
};

void setMethod(Bake& bake, const Method& method, float patchSize, int seed) {
    bake.settings.directions = DirectionKind::RANDOM;
    for (const auto& [name, value] : method.choices) bake.settings.set(name, value);
    bake.settings.patchSize = patchSize;
    bake.settings.linesPerBundle = method.linesPerBundle;
    bake.settings.minBundles = bake.settings.maxBundles = method.bundles;
    // Target of the direct light. The differences of GATHER from seed to seed are far below the
    // noise of the bundles. A target of 1e-4 would take four fifths of the time.
    bake.settings.targetError = 5e-3f;
    bake.settings.localRays = 4000;
    bake.settings.threads = 1;  // the seeds run in parallel
    bake.settings.seed = seed;
}

// Returns the mean irradiance of groups of front sides, first channel, W/m^2.
template <class GroupOf>
std::vector<double> groupMeans(const Bake& bake, size_t groups, const GroupOf& groupOf) {
    std::vector<double> light(groups, 0), area(groups, 0);
    const Patches& patches = bake.patches();
    const Irradiance& h = bake.patchIrradiance();
    for (uint32_t i = 0; i < patches.sideCount(); i += 2) {
        const size_t g = groupOf(patches, i);
        light[g] += double(patches.area[i / 2]) * double(h.direct[i].x + h.indirect[i].x);
        area[g] += double(patches.area[i / 2]);
    }
    for (size_t g = 0; g < groups; ++g) light[g] /= area[g];
    return light;
}

// Returns the means over the seeds of the mean irradiance of groups of sides, first channel, W/m^2.
template <class GroupOf>
std::vector<Statistics> meansOverSeeds(const Scene& scene, const Method& method, float patchSize,
                                       size_t groups, const GroupOf& groupOf) {
    std::vector<std::vector<double>> light(kBakes);
    tbb::parallel_for(0, kBakes, [&](int seed) {
        Bake bake;
        setMethod(bake, method, patchSize, seed);
        bake.run(scene);
        light[size_t(seed)] = groupMeans(bake, groups, groupOf);
    });
    std::vector<Statistics> means(groups);
    for (const std::vector<double>& ofSeed : light)
        for (size_t g = 0; g < groups; ++g) means[g].add(ofSeed[g]);
    return means;
}

class Unbiased : public testing::TestWithParam<Method> {};

// The tolerance is three standard errors. Of a hundred such means one exceeds it by chance in every
// fourth series; the seeds are fixed.
TEST_P(Unbiased, InACube) {
    // One patch per face. The lowest face emits 1 W/m^2.
    Scene scene = closedCube(0.5f);
    scene.mesh(0).faceMaterials[0] = scene.addMaterial(grey("lit", 0.5f, 1));
    const auto means = meansOverSeeds(
        scene, GetParam(), 10, 3,
        [](const Patches& patches, uint32_t i) { return size_t(cubeFace(patches, i / 2)); });
    for (size_t face = 0; face < 3; ++face) {
        const double exact = (kCubeExitance[face] - (face == 0 ? 1 : 0)) / 0.5;
        // The direct light of the emitting face comes from a quadrature of its closed form,
        // accurate to 0.05 %.
        EXPECT_NEAR(means[face].mean(), exact, 3 * means[face].standardError() + 5e-4 * exact)
            << "face " << face;
    }
}

TEST_P(Unbiased, InARoomWithTwoBoxes) {
    const Scene scene = litRoom(0.6f);
    const size_t objects = scene.instances.size();
    auto objectOf = [](const Patches& patches, uint32_t i) {
        return size_t(patches.parents[patches.parentOf[i / 2]].instance);
    };
    static const std::vector<double> exact = [&] {
        Bake bake;
        setMethod(bake, {"", {{"directions", "LOW_DISCREPANCY"}}, 16384}, 0.8f, 999);
        bake.settings.targetError = 1e-4f;
        bake.settings.contacts = 0;  // to have the same patches for all methods
        bake.run(scene);
        return groupMeans(bake, objects, objectOf);
    }();
    const auto means = meansOverSeeds(scene, GetParam(), 0.8f, objects, objectOf);
    // The reference has 0.1 % of noise, its direct light 0.2 %.
    for (size_t k = 0; k < objects; ++k)
        EXPECT_NEAR(means[k].mean(), exact[k], 3 * means[k].standardError() + 2e-3 * exact[k])
            << scene.instances[k].name;
}

INSTANTIATE_TEST_SUITE_P(Methods, Unbiased, testing::ValuesIn(kMethods),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace raybundle
