// SPDX-License-Identifier: GPL-3.0-or-later
//
// Scenes that cannot be baked as they are, limits, roles and the report.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "job/error.h"
#include "job/memory.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

TEST(BadScenes, WithoutLightTheResultIsBlackAndSaidSo) {
    Bake bake;
    bake.run(roomWithBoxes(0.5f));
    const Json report = reportOf(bake);
    EXPECT_TRUE(mentions(report["warnings"], "light")) << report["warnings"];
    EXPECT_EQ(report["bundles"], 0) << "nothing to exchange";
    for (const glm::vec3& v : everything(bake)) ASSERT_EQ(v, glm::vec3(0));
}

TEST(BadScenes, WithoutFacesThereIsAWarning) {
    Scene nothing, empty, degenerate;
    place(empty, polygons("hollow", {}, {}), grey("", 0.5f));
    place(degenerate, polygons("thread", {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}),
          grey("", 0.5f, 1));
    for (Scene* scene : {&nothing, &empty, &degenerate}) {
        scene->addLight(pointLight({0, 0, 1}, glm::dvec3(1)));
        scene->worldRadiance = glm::vec3(1);
        Bake bake;
        bake.run(*scene);
        EXPECT_TRUE(warns(reportOf(bake), WarningId::NO_FACES)) << reportOf(bake)["warnings"];
    }
    Bake bake;
    bake.run(degenerate);
    EXPECT_TRUE(warns(reportOf(bake), WarningId::DEGENERATE_FACES));
    EXPECT_TRUE(mentions(reportOf(bake)["warnings"], "thread"));
    for (const glm::vec3& v : cornerLight(bake, 0, RB_OUTPUT_COMBINED)) EXPECT_EQ(v, glm::vec3(0));
}

TEST(BadScenes, SmallThingsThatFewLinesMeetAreNamed) {
    Scene scene;
    place(scene, grid("plain", {-50, -50, 0}, {100, 0, 0}, {0, 100, 0}, 8, 8), grey("", 0.5f));
    place(scene, box("crate", {0, 0, 0.01f}, {0.1f, 0.1f, 0.1f}, false), grey("", 0.5f));
    scene.worldRadiance = glm::vec3(1);
    for (Solver solver : {Solver::LINE_REUSE, Solver::MULTIPATH, Solver::STOCHASTIC_ITERATION}) {
        Bake bake;
        setQuick(bake);
        bake.settings.patchSize = 0;
        bake.settings.solver = solver;
        bake.settings.directions = DirectionKind::RANDOM;
        bake.run(scene);
        const Json warnings = reportOf(bake)["warnings"];
        const bool hasWindows = bake.settings.solver == Solver::LINE_REUSE;
        EXPECT_EQ(mentions(warnings, "lines meet each patch of \\\"crate\\\""), !hasWindows)
            << warnings;
    }
}

TEST(BadScenes, AnObjectThatIsInsideOutIsNamed) {
    Scene scene;
    place(scene, box("shed", {-1, -1, -1}, {1, 1, 1}, false), grey("", 0.5f));
    scene.addLight(pointLight({0, 0, 0}, glm::dvec3(1)));
    Bake bake;
    setQuick(bake);
    bake.run(scene);
    const Json report = reportOf(bake);
    EXPECT_TRUE(mentions(report["warnings"], "shed")) << report["warnings"];
    EXPECT_TRUE(mentions(report["objects"], "no light")) << report["objects"];
}

TEST(BadScenes, ADegenerateFaceSpoilsNothing) {
    Scene scene;
    Mesh mesh = box("cube", glm::vec3(0), glm::vec3(1), true);
    for (int32_t v : {0, 1, 1, 0}) mesh.cornerVertices.push_back(v);
    mesh.faceOffsets.push_back(int32_t(mesh.cornerVertices.size()));
    place(scene, mesh, grey("", 0.5f, 1));
    Bake bake;
    setQuick(bake);
    bake.run(scene);
    EXPECT_TRUE(mentions(reportOf(bake)["warnings"], "cube"));
    const std::vector<glm::vec3> light = cornerLight(bake, 0, RB_OUTPUT_COMBINED);
    for (size_t c = 0; c < 24; ++c) EXPECT_NEAR(light[c].x * kPi, 2, 1e-3);
}

TEST(Limits, MaxBundlesIsKeptAndSaidToBeTheReason) {
    for (int most : {2, 10, 33, 200}) {
        Bake bake;
        bake.settings.patchSize = 0.25f;
        bake.settings.targetError = 1e-5f;
        bake.settings.maxBundles = most;
        bake.run(litRoom());
        const Json report = reportOf(bake);
        EXPECT_LE(report["bundles"].get<int>(), most) << "also where it is below min_bundles";
        EXPECT_TRUE(warns(report, WarningId::MAX_BUNDLES)) << report["warnings"];
    }
}

TEST(Limits, MinBundlesIsKept) {
    for (int fewest : {2, 7, 300}) {
        Bake bake;
        bake.settings.patchSize = 0.25f;
        bake.settings.targetError = 10;
        bake.settings.minBundles = fewest;
        bake.run(litRoom());
        EXPECT_GE(reportOf(bake)["bundles"].get<int>(), fewest);
        EXPECT_LE(reportOf(bake)["bundles"].get<int>(), fewest + 1);
    }
}

// Beyond the memory limit bundles are used once and then discarded. The result is less precise than
// if they were kept, but converges to the same solution.
TEST(Limits, BeyondTheMemoryLimitBundlesStillHelp) {
    const Scene scene = litRoom(0.8f);
    auto bakeWith = [&](float megabytes, int bundleCount, int threads = 0) {
        auto bake = std::make_unique<Bake>();
        bake->settings.patchSize = 0.25f;
        bake->settings.memoryLimit = megabytes;
        bake->settings.minBundles = bake->settings.maxBundles = bundleCount;
        bake->settings.targetError = 1e-5f;
        bake->settings.threads = threads;
        bake->run(scene);
        return bake;
    };
    const auto reference = bakeWith(8192, 4096);
    const auto few = bakeWith(8192, 64), many = bakeWith(2, 1024);
    EXPECT_FALSE(warns(reportOf(*few), WarningId::MEMORY_LIMIT));
    EXPECT_TRUE(warns(reportOf(*many), WarningId::MEMORY_LIMIT));
    const double error = noise(everything(*many), everything(*reference));
    const double stated = reportOf(*many)["estimated_error"];
    EXPECT_LT(error, 0.5 * noise(everything(*few), everything(*reference)));
    // The stated error comes from a single pair of halves and scatters by a factor of 2.
    EXPECT_LT(error, 2 * stated);
    EXPECT_LT(stated, 0.02);
    EXPECT_LT(difference(everything(*bakeWith(2, 256, 1)), everything(*bakeWith(2, 256, 2))), 1e-5);
}

TEST(Limits, AFurnaceStaysExactBeyondTheMemoryLimit) {
    Bake bake;
    bake.settings.patchSize = 0.1f;
    bake.settings.memoryLimit = 2;
    bake.settings.minBundles = bake.settings.maxBundles = 512;
    bake.run(closedCube(0.7f, 0.3f));
    ASSERT_TRUE(warns(reportOf(bake), WarningId::MEMORY_LIMIT));
    for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_LIGHTING))
        EXPECT_NEAR(double(light.x) * 3.14159265, 1, 1e-3);
}

// The room with so many patches that a bake takes 1.3 GB. The memory is looked at every 20 ms, and
// a bake that is cancelled ends within about 0.1 s, in which it may fill some more, on a busy
// machine as much as the limit again.
TEST(Limits, ABakeThatReachesTheMemoryLimitEndsAndKeepsTheLastResult) {
    const Scene scene = litRoom();
    Bake bake;
    bake.settings.patchSize = 0.25f;
    bake.settings.minBundles = bake.settings.maxBundles = 16;
    bake.run(scene);
    const auto before = everything(bake);
    const size_t peak = peakResidentMemory(), now = residentMemory();
    bake.settings.memoryLimit = 300;
    bake.settings.patchSize = 0.01f;
    bake.settings.maxPatches = 2'000'000;
    try {
        bake.run(scene);
        FAIL() << "the bake took " << residentMemory() - now << " bytes";
    } catch (const Error& error) {
        EXPECT_EQ(error.code, RB_ERROR_OUT_OF_MEMORY);
        EXPECT_TRUE(mentions(Json(error.what()), "memory_limit allows (300 MB)")) << error.what();
    }
    EXPECT_LT(peakResidentMemory(), std::max(peak, now + 900'000'000));
    EXPECT_EQ(everything(bake), before);
    bake.settings.patchSize = 0.25f;
    bake.settings.maxPatches = 100'000;
    bake.run(scene);
    EXPECT_LT(difference(everything(bake), before), 1e-5);
}

TEST(Limits, ASmallBakeNeedsNoMoreMemoryThanEachMayTake) {
    Bake bake;
    bake.settings.memoryLimit = 1e-3f;
    bake.settings.minBundles = bake.settings.maxBundles = 64;
    bake.run(litRoom());
    EXPECT_TRUE(warns(reportOf(bake), WarningId::MEMORY_LIMIT));
}

TEST(Limits, TheMemoryLimitIsThreeQuartersOfTheComputers) {
    const MemoryLimit limit(0), set(5000);
    EXPECT_EQ(limit.whole, size_t(0.75 * double(computersMemory())));
    EXPECT_EQ(limit.exchanges, limit.whole / 2);
    EXPECT_TRUE(mentions(Json(limit.reached().what()), "three quarters")) << limit.reached().what();
    EXPECT_EQ(set.whole, 5'000'000'000u);
    EXPECT_EQ(set.exchanges, 2'500'000'000u);
    EXPECT_GT(residentMemory(), 1'000'000u);
    EXPECT_LE(residentMemory(), peakResidentMemory() + 1'000'000);
    EXPECT_LT(peakResidentMemory(), computersMemory());
}

// A bake holds its patches and lines between two runs. The next run of it counts them, and one of
// another bake does not.
TEST(Limits, AMemoryUseCountsWhatItsRunsKeep) {
    MemoryUse kept, other;
    kept.begin();
    std::vector<char> filled(100'000'000, 1);
    EXPECT_GT(kept.bytes(), 90'000'000u);
    kept.end();
    kept.begin();
    other.begin();
    EXPECT_GT(kept.bytes(), 90'000'000u);
    EXPECT_LT(other.bytes(), 50'000'000u);
    EXPECT_EQ(filled[50'000'000], 1);
}

TEST(Roles, AnOccluderBlocksAndHasNoResult) {
    Scene scene;
    place(scene, rectangle("floor", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), grey("", 0.5f));
    place(scene, rectangle("screen", {-3, -3, 1}, {6, 0, 0}, {0, 6, 0}), grey("", 0), glm::dmat4(1),
          RB_ROLE_OCCLUDE);
    scene.addLight(pointLight({0, 0, 2}, glm::dvec3(1)));
    Bake bake;
    setQuick(bake);
    bake.run(scene);
    for (const glm::vec3& v : cornerLight(bake, 0, RB_OUTPUT_LIGHTING)) EXPECT_EQ(v, glm::vec3(0));
    try {
        cornerLight(bake, 1, RB_OUTPUT_LIGHTING);
        ADD_FAILURE() << "an occluder has a result";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("screen"), std::string::npos) << error.what();
    }
    EXPECT_EQ(reportOf(bake)["objects"][1]["status"], "occluder");
}

TEST(BakeReport, HasItsFixedKeys) {
    Bake bake;
    setQuick(bake);
    bake.run(litRoom());
    const Json report = reportOf(bake);
    for (const char* key :
         {"seconds", "patches", "bundles", "lines", "exchanges", "estimated_error", "energy",
          "peak_memory_bytes", "objects", "warnings", "warning_ids", "skipped"})
        EXPECT_TRUE(report.contains(key)) << key;
    for (const char* key : {"total", "patches", "first_shot", "bundles", "solve", "reconstruction"})
        EXPECT_GE(report["seconds"][key].get<double>(), 0) << key;
    for (const char* key : {"emitted", "absorbed", "escaped", "balance_error"})
        EXPECT_TRUE(report["energy"].contains(key)) << key;
    EXPECT_EQ(report["bundles"], 64);
    EXPECT_EQ(report["objects"].size(), 3u);
    EXPECT_EQ(report["objects"][2]["name"], "high box");
    EXPECT_EQ(report["objects"][2]["corners"], 24);
}

}  // namespace
}  // namespace raybundle
