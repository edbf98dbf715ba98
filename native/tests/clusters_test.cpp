// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/clusters.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <set>

#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// The room with two boxes, and a ball of small faces that only occludes. The ball emits as much as
// the room.
Scene roomWithBall(int subdivisions, float reflectance, float emission = 0, float gloss = 0) {
    Scene scene = roomWithBoxes(reflectance, emission);
    Material paint = grey("ball", reflectance, emission, emission);
    if (gloss > 0) {
        paint.sides[0].scattering.glossOffset = glm::vec3(gloss);
        paint.sides[0].scattering.glossRoughness = 0.3f;
    }
    place(scene, icosphere("ball", 0.4f, subdivisions, false), paint,
          glm::translate(glm::dmat4(1), {3.1, 2.3, 1.9}), RB_ROLE_OCCLUDE);
    return scene;
}

TEST(Clusters, AreNoneWhereAllIsShown) {
    const Patches patches = subdivide(roomWithBall(5, 0.5f), 0.4f, kMany);
    const Clusters clusters(patches, std::vector<bool>(patches.sideCount(), true));
    EXPECT_TRUE(clusters.isNone());
    EXPECT_EQ(&clusters.patches(), &patches);
    EXPECT_EQ(clusters.sideOf(7), 7u);
    EXPECT_EQ(clusters.memberCount(), 0u);
    // There are none either if the faces are as large as tiles.
    const Patches coarse = subdivide(roomWithBall(1, 0.5f), 0.4f, kMany);
    EXPECT_TRUE(Clusters(coarse, shownBut(coarse, 3)).isNone());
}

TEST(Clusters, AreOfNearPatchesThatFaceAlike) {
    const Patches patches = subdivide(roomWithBall(5, 0.5f), 0.4f, kMany);
    const Clusters clusters(patches, shownBut(patches, 3));
    ASSERT_FALSE(clusters.isNone());
    const Patches& joined = clusters.patches();
    EXPECT_LT(joined.count(), patches.count() / 5);
    std::vector<double> area(joined.count(), 0);
    std::vector<int> members(joined.count(), 0);
    for (uint32_t side = 0; side < patches.sideCount(); ++side) {
        const uint32_t own = clusters.sideOf(side);
        ASSERT_LT(own, joined.sideCount());
        EXPECT_EQ(own % 2, side % 2);
        EXPECT_EQ(joined.parentAt(own).instance, patches.parentAt(side).instance);
        EXPECT_GT(glm::dot(joined.normal(own), patches.normal(side)), 0.6f);
        EXPECT_LT(glm::distance(joined.point(own / 2, {0.3f, 0.3f}),
                                patches.point(side / 2, {0.3f, 0.3f})),
                  patches.islandAt(side).size);
        // A ray finds the patch that it meets from its parent, so the patches of the clusters must
        // be consistent with the parents.
        const Parent& parent = joined.parents[patches.parentOf[side / 2]];
        EXPECT_EQ(
            parent.firstPatch + side / 2 - patches.parents[patches.parentOf[side / 2]].firstPatch,
            own / 2);
        if (side % 2) continue;
        area[own / 2] += double(patches.area[side / 2]);
        ++members[own / 2];
    }
    size_t inClusters = 0;
    for (uint32_t k = 0; k < joined.count(); ++k) {
        EXPECT_NEAR(double(joined.area[k]), area[k], 1e-5 * area[k]);
        if (members[k] > 1) inClusters += size_t(members[k]);
        std::set<uint32_t> seen;
        for (uint32_t i = 0; i < uint32_t(members[k]); ++i) {
            const uint32_t side = clusters.memberOf(2 * k + 1, i);
            EXPECT_EQ(clusters.sideOf(side), 2 * k + 1);
            seen.insert(side);
        }
        EXPECT_EQ(seen.size(), size_t(members[k]));
    }
    EXPECT_EQ(clusters.memberCount(), inClusters);
}

// The sphere is cut by the same cells however fine its faces are. Without remnants, cells that only
// a few fine faces reach into have no clusters of their own.
TEST(Clusters, HaveNoRemnants) {
    size_t counts[2];
    for (int k : {0, 1}) {
        const Patches patches = subdivide(roomWithBall(5 + k, 0.5f), 0.4f, kMany);
        const Clusters clusters(patches, shownBut(patches, 3));
        const Patches& joined = clusters.patches();
        counts[k] = 0;
        for (uint32_t c = 0; c < joined.count(); ++c) {
            if (joined.parentAt(2 * c).instance != 3) continue;
            ++counts[k];
            // The share of a cell below which clusters are joined with others, and the area of the
            // cells, which are half as wide as tiles.
            EXPECT_GT(joined.area[c], 0.25f * 0.2f * 0.2f) << k;
        }
    }
    EXPECT_NEAR(double(counts[1]), double(counts[0]), 0.1 * double(counts[0]));
}

TEST(Clusters, AreCoarsenedToTheNumberAllowed) {
    const Patches patches = subdivide(roomWithBall(5, 0.5f), 0.4f, kMany);
    const std::vector<bool> isShown = shownBut(patches, 3);
    const size_t ofRoom = patches.count() - 20 * 1024;
    const size_t usual = Clusters(patches, isShown).patches().count() - ofRoom;
    for (const size_t share : {1, 2, 4}) {
        const Clusters clusters(patches, isShown, ofRoom + usual / share);
        EXPECT_LE(clusters.patches().count(), ofRoom + usual / share);
        EXPECT_GT(clusters.patches().count(), ofRoom + usual / share / 5);
        EXPECT_EQ(clusters.coarseness() > 1, share > 1);
        double area = 0;
        for (const float own : clusters.patches().area) area += double(own);
        EXPECT_NEAR(area, patches.totalArea, 1e-4 * patches.totalArea);
    }
    // What cannot be kept ends with the coarsest clusters.
    EXPECT_GT(Clusters(patches, isShown, 1).patches().count(), ofRoom);
}

TEST(Clusters, HaveTheMeansOfTheirPatches) {
    const Patches patches = subdivide(roomWithBall(5, 0.5f), 0.4f, kMany);
    const Clusters clusters(patches, shownBut(patches, 3));
    std::vector<float> values(patches.sideCount());
    double sum = 0, sumOfMeans = 0;
    for (uint32_t side = 0; side < values.size(); ++side) {
        values[side] = patches.normal(side).x + 2;
        sum += double(values[side] * patches.area[side / 2]);
    }
    const std::vector<float> means = clusters.mean(values), spread = clusters.spread(means);
    for (uint32_t side = 0; side < means.size(); ++side)
        sumOfMeans += double(means[side] * clusters.patches().area[side / 2]);
    EXPECT_NEAR(sumOfMeans, sum, 1e-5 * sum);
    ASSERT_EQ(spread.size(), values.size());
    for (uint32_t side = 0; side < spread.size(); ++side)
        EXPECT_EQ(spread[side], means[clusters.sideOf(side)]);
    EXPECT_TRUE(clusters.mean(std::vector<float>()).empty());
}

// The work depends on the light of the ball, not on the number of its faces.
TEST(Clusters, AreAsManyHoweverManyFacesThereAre) {
    double patches[2], rays[2], bundles[2];
    for (int k : {0, 1}) {
        Scene scene = roomWithBall((kFewBakes ? 4 : 5) + k, 0.5f);
        scene.addLight(pointLight({1, 1, 2}, glm::dvec3(5)));
        Bake bake;
        bake.settings.patchSize = 0.3f;
        bake.run(scene);
        const Json report = reportOf(bake);
        EXPECT_TRUE(skips(report, SkippedWork::CLUSTERED_PATCHES));
        patches[k] = report["patches"];
        rays[k] = report["shadow_rays"];
        bundles[k] = report["bundles"];
    }
    EXPECT_LT(patches[1], 1.2 * patches[0]);
    EXPECT_LT(rays[1], 1.2 * rays[0]);
    EXPECT_LT(bundles[1], 1.5 * bundles[0]);
}

void expectFurnace(const Bake& bake) {
    for (int32_t instance = 0; instance < 3; ++instance)
        for (const glm::vec3& light : cornerLight(bake, instance, RB_OUTPUT_LIGHTING))
            EXPECT_NEAR(double(light.x) * kPi, 1, 1e-4) << instance;
}

TEST(Clusters, LeaveAFurnaceExact) {
    Bake bake;
    bake.run(roomWithBall(5, 0.5f, 0.5f));
    ASSERT_TRUE(skips(reportOf(bake), SkippedWork::CLUSTERED_PATCHES));
    expectFurnace(bake);
    // Some of the ball's clusters and most of the room's patches meet few lines, and gather with
    // local rays.
    bake.settings.minBundles = bake.settings.maxBundles = 2;
    bake.run(roomWithBall(5, 0.5f, 0.5f));
    expectFurnace(bake);
}

// A coarse shot before cuts samples the stand-ins alone, and the first shot goes on from it.
TEST(Clusters, LightTheRoomAlsoAfterCuts) {
    if (kFewBakes) return;
    Scene scene = roomWithBall(4, 0.6f);
    scene.addLight(pointLight({2.2, 1.2, 2.2}, glm::dvec3(5)));
    std::vector<glm::vec3> light[2];
    double stated[2];
    for (int on : {0, 1}) {
        Bake bake;
        bake.settings.targetError = 0.01f;
        bake.settings.refine = true;
        bake.settings.skipClusters = on;
        bake.run(scene);
        const Json report = reportOf(bake);
        EXPECT_EQ(skips(report, SkippedWork::CLUSTERED_PATCHES), on == 1);
        EXPECT_FALSE(report["refined"].empty());
        light[on] = everything(bake);
        stated[on] = report["error"]["noise"];
    }
    // The noise of both bakes, which have the same directions. 0.4 times as much was measured.
    EXPECT_LT(noise(light[1], light[0]), std::hypot(stated[0], stated[1]));
}

// With the light of a lamp, gloss that depends on the direction, lines beyond the memory limit, and
// light sets.
TEST(Clusters, LightTheRoomAsSinglePatchesDo) {
    for (const float gloss : {0.0f, 0.3f})
        for (const float megabytes : {8192.0f, 1.0f}) {
            Scene scene = roomWithBall(4, 0.6f, 0, gloss);
            scene.lightSets = {"lamp"};
            Light lamp = pointLight({2.2, 1.2, 2.2}, glm::dvec3(5));
            lamp.lightSet = 0;
            scene.addLight(lamp);
            scene.addLight(pointLight({1, 1, 2}, glm::dvec3(1)));
            std::vector<glm::vec3> light[2];
            double balance[2], stated[2];
            for (int on : {0, 1}) {
                Bake bake;
                bake.settings.minBundles = bake.settings.maxBundles = 192;
                bake.settings.targetError = 0.005f;
                bake.settings.memoryLimit = megabytes;
                bake.settings.skipClusters = on;
                bake.run(scene);
                const Json report = reportOf(bake);
                EXPECT_EQ(skips(report, SkippedWork::CLUSTERED_PATCHES), on == 1);
                EXPECT_EQ(warns(report, WarningId::MEMORY_LIMIT), megabytes < 2);
                light[on] = everything(bake);
                stated[on] = report["estimated_error"];
                balance[on] = report["energy"]["balance_error"];
                // Energy is balanced exactly only while the lines are kept.
                EXPECT_LT(std::abs(balance[on]), megabytes < 2 ? 4e-3 : 1e-3) << on << gloss;
            }
            EXPECT_LT(noise(light[1], light[0]), 2 * std::hypot(stated[0], stated[1]))
                << gloss << " " << megabytes;
        }
}

TEST(Clusters, AreFoundAnewWhereTheirLightIsToBeShown) {
    const int level = kFewBakes ? 3 : 4;
    Scene hidden = roomWithBall(level, 0.5f), shown = hidden;
    for (Scene* scene : {&hidden, &shown}) scene->addLight(pointLight({1, 1, 2}, glm::dvec3(5)));
    shown.instances[3].role = RB_ROLE_BAKE;
    Bake again, fresh;
    setQuick(again);
    setQuick(fresh);
    // With the final gather, the nodes of a dense surface gather what is shown, and its patches may
    // stay in clusters.
    again.settings.finalGather = fresh.settings.finalGather = 0;
    again.run(hidden);
    EXPECT_TRUE(skips(reportOf(again), SkippedWork::CLUSTERED_PATCHES));
    again.run(shown);
    EXPECT_FALSE(skips(reportOf(again), SkippedWork::CLUSTERED_PATCHES));
    fresh.run(shown);
    EXPECT_LT(difference(everything(again), everything(fresh)), 1e-5);
    EXPECT_LT(difference(cornerLight(again, 3, RB_OUTPUT_LIGHTING),
                         cornerLight(fresh, 3, RB_OUTPUT_LIGHTING)),
              1e-5);
    // Another paint does not change the clusters.
    Scene painted = roomWithBall(level, 0.3f);
    painted.addLight(pointLight({1, 1, 2}, glm::dvec3(5)));
    again.run(hidden);
    again.run(painted);
    EXPECT_TRUE(skips(reportOf(again), SkippedWork::UNCHANGED_GEOMETRY));
    fresh.run(painted);
    EXPECT_LT(difference(everything(again), everything(fresh)), 1e-5);
}

// Each cluster of backs, whose fronts are shown, has a side that gathers for all. A cluster has one
// material, so if faces get another material, other sides must gather.
TEST(Clusters, OfOtherMaterialsGatherAnew) {
    Scene before = roomWithBall(kFewBakes ? 3 : 4, 0.5f, 0, 0.3f);
    before.instances[3].role = RB_ROLE_BAKE;
    before.addLight(pointLight({1, 1, 2}, glm::dvec3(5)));
    before.addMaterial(grey("other", 0.5f));
    Scene after = before;
    std::vector<int32_t>& paint = after.meshes[size_t(after.instances[3].mesh)].faceMaterials;
    for (size_t face = 0; face < paint.size(); face += 3)
        paint[face] = int32_t(after.materials.size()) - 1;
    Bake again, fresh;
    setQuick(again);
    setQuick(fresh);
    again.settings.finalGather = fresh.settings.finalGather = 0;  // the light of patches is shown
    again.run(before);
    again.run(after);
    EXPECT_TRUE(skips(reportOf(again), SkippedWork::UNCHANGED_GEOMETRY));
    fresh.run(after);
    EXPECT_LT(difference(everything(again), everything(fresh)), 1e-5);
    // A bake without clusters does not use what a bake with clusters has kept.
    Bake single;
    setQuick(single);
    single.settings.finalGather = 0;
    again.settings.skipClusters = single.settings.skipClusters = 0;
    again.run(after);
    single.run(after);
    EXPECT_LT(difference(everything(again), everything(single)), 1e-5);
}

}  // namespace
}  // namespace raybundle
