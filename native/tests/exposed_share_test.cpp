// SPDX-License-Identifier: GPL-3.0-or-later
//
// The exposed part of a side that is partly covered has the light of the surface beside it.
#include "visibility/exposed_share.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <string>

#include "bake/bake.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// Black legs that stand on a floor with patches of 25 cm. Each leg covers most of a patch and is
// too narrow to cut it.
constexpr int kLegs = 4;
constexpr float kWidth = 0.2f;

glm::dmat4 placeOfLeg(int i, int j) {
    const glm::dvec3 middle(0.625 + 0.75 * i, 0.625 + 0.75 * j, 0);
    return glm::rotate(glm::translate(glm::dmat4(1), middle), 0.1 * (4 * i + j),
                       glm::dvec3(0, 0, 1));
}

Scene floorWithLegs(float reflectance) {
    Scene scene;
    place(scene, grid("floor", {0, 0, 0}, {3.5f, 0, 0}, {0, 3.5f, 0}, 14, 14),
          grey("floor", reflectance));
    for (int i = 0; i < kLegs; ++i)
        for (int j = 0; j < kLegs; ++j)
            place(scene,
                  box("leg", {-kWidth / 2, -kWidth / 2, 0}, {kWidth / 2, kWidth / 2, 0.5f}, false),
                  grey("leg", 0), placeOfLeg(i, j));
    return scene;
}

struct CoveredInPart : testing::TestWithParam<std::tuple<Solver, float>> {};

TEST_P(CoveredInPart, HasTheLightThatItHasBeside) {
    const auto [solver, reflectance] = GetParam();
    Scene scene = floorWithLegs(reflectance);
    scene.addLight(sunLight({0, 0, 1}, glm::dvec3(kPi)));
    Bake bake;
    bake.settings.solver = solver;
    if (solver != Solver::LINE_REUSE) bake.settings.directions = DirectionKind::RANDOM;
    bake.settings.patchSize = 0.25f;
    bake.settings.minBundles = bake.settings.maxBundles = 64;
    bake.run(scene);
    double most = 0;
    for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_LIGHTING))
        most = std::max(most, std::abs(double(light.x) - 1));
    // 256 points determine the share of half a side within about 1 %. By the lines of these bundles
    // alone the light was up to 15 % off.
    EXPECT_LT(most, 0.03);
}

INSTANTIATE_TEST_SUITE_P(Solvers, CoveredInPart,
                         testing::Combine(testing::Values(Solver::LINE_REUSE, Solver::MULTIPATH,
                                                          Solver::RANDOM_WALK),
                                          testing::Values(0.0f, 0.5f)));

}  // namespace
}  // namespace raybundle
