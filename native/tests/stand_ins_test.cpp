// SPDX-License-Identifier: GPL-3.0-or-later
#include "first_shot/stand_ins.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// A ball of small faces without a result, close above a sunlit ground that has a result.
Scene ballOverGround(int subdivisions) {
    Scene scene;
    place(scene, icosphere("ball", 0.5f, subdivisions, false), grey("ball", 0.7f),
          glm::translate(glm::dmat4(1), {0, 0, 0.6}), RB_ROLE_OCCLUDE);
    place(scene, grid("ground", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 8, 8), grey("ground", 0.7f));
    scene.addLight(sunLight({1, 0.2, 0.6}, glm::dvec3(2), 0.05));
    return scene;
}

TEST(StandIns, AreNoneWhereAllIsShown) {
    const Patches patches = subdivide(ballOverGround(4), 0.2f, 10000);
    const StandIns standIns(patches, nullptr);
    ASSERT_EQ(standIns.gatherers().size(), patches.sideCount());
    for (uint32_t side = 0; side < patches.sideCount(); ++side) {
        EXPECT_EQ(standIns.gatherers()[side], side);
        EXPECT_EQ(standIns.numberOf(side), side);
        EXPECT_FALSE(standIns.isForOthers(side));
    }
}

TEST(StandIns, AreNearAndFaceAlike) {
    const Patches patches = subdivide(ballOverGround(5), 0.2f, 10000);
    const std::vector<bool> isShown = shownBut(patches, 0);
    const StandIns standIns(patches, &isShown);
    EXPECT_LT(standIns.gatherers().size(), patches.sideCount() / 3);
    for (uint32_t side = 0; side < patches.sideCount(); ++side) {
        const uint32_t number = standIns.numberOf(side), other = standIns.gatherers()[number];
        EXPECT_EQ(standIns.numberOf(other), number);
        if (other == side) continue;
        ASSERT_FALSE(isShown[side]);
        EXPECT_TRUE(standIns.isForOthers(number));
        EXPECT_EQ(other % 2, side % 2);
        EXPECT_EQ(patches.parentAt(other).surface, patches.parentAt(side).surface);
        EXPECT_GT(glm::dot(patches.normal(other), patches.normal(side)), 0.6f);
        EXPECT_LT(glm::distance(patches.point(other / 2, {0.5f, 0.5f}),
                                patches.point(side / 2, {0.5f, 0.5f})),
                  patches.islandAt(side).size);
    }
}

TEST(StandIns, LightWhatIsAroundAsAllWould) {
    auto light = [](int subdivisions, double& rays) {
        const Scene scene = ballOverGround(subdivisions);
        Bake bake;
        bake.settings.targetError = 0.005f;
        bake.settings.maxPatches = 4000;
        bake.run(scene);
        rays = reportOf(bake)["shadow_rays"].get<double>();
        EXPECT_EQ(skips(reportOf(bake), SkippedWork::STAND_INS), subdivisions > 4);
        return cornerLight(bake, 1, RB_OUTPUT_INDIRECT);
    };
    double rays = 0, manyRays = 0;
    // A ball of 1,280 faces, each of which gathers, and one of 20,480.
    const std::vector<glm::vec3> coarse = light(3, rays), fine = light(5, manyRays);
    // The noise of both is 0.5 % of all light. The coarse ball has 2 % less area.
    EXPECT_LT(noise(fine, coarse), 0.03);
    EXPECT_LT(manyRays, 2 * rays);
}

}  // namespace
}  // namespace raybundle
