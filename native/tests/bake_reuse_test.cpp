// SPDX-License-Identifier: GPL-3.0-or-later
//
// A bake that runs again: relighting, cancelling, the last result.
#include <gtest/gtest.h>

#include <array>
#include <glm/gtc/matrix_transform.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bake/bake.h"
#include "bake/error.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

TEST(Relighting, GivesWhatAFreshBakeGives) {
    const Scene before = litRoom();
    Scene after = roomWithBoxes(0.3f);
    after.addLight(pointLight({1, 1, 2}, {1, 5, 2}));
    after.worldRadiance = glm::vec3(0.1f);
    Bake again, fresh;
    setQuick(again);
    setQuick(fresh);
    again.run(before);
    EXPECT_FALSE(mentions(reportOf(again)["skipped"], "unchanged"));
    again.run(after);
    EXPECT_TRUE(mentions(reportOf(again)["skipped"], "unchanged"));
    fresh.run(after);
    EXPECT_LT(difference(everything(again), everything(fresh)), 1e-5);
}

TEST(Relighting, ShootsAgainOnlyWhereLightsChanged) {
    // Without emission, whose being a source depends on reflectances.
    auto room = [](float reflectance, double power) {
        Scene scene = roomWithBoxes(reflectance);
        scene.addLight(pointLight({1, 1, 2}, glm::dvec3(power)));
        return scene;
    };
    Bake again;
    setQuick(again);
    auto skips = [&](const Scene& scene) {
        again.run(scene);
        Bake fresh;
        setQuick(fresh);
        fresh.run(scene);
        EXPECT_LT(difference(everything(again), everything(fresh)), 1e-5);
        return mentions(reportOf(again)["skipped"], "lights unchanged");
    };
    EXPECT_FALSE(skips(room(0.6f, 1)));
    EXPECT_TRUE(skips(room(0.3f, 1)));
    EXPECT_FALSE(skips(room(0.3f, 2)));
    again.settings.targetError = 0.5f;
    EXPECT_FALSE(mentions((again.run(room(0.3f, 2)), reportOf(again)["skipped"]), "lights unch"));
}

TEST(Relighting, TheSameSceneNeedsNoMoreBundles) {
    // However many looks at the noise its first bake took.
    for (float target : {0.03f, 0.02f, 0.014f, 0.01f}) {
        Bake bake;
        bake.settings.minBundles = 8;
        bake.settings.targetError = target;
        bake.run(litRoom());
        const Json first = reportOf(bake);
        bake.run(litRoom());
        const Json second = reportOf(bake);
        EXPECT_EQ(second["bundles"], first["bundles"]) << target;
        // Solved from elsewhere, to a hundredth of the target or so.
        EXPECT_NEAR(second["estimated_error"], first["estimated_error"], 0.01 * target) << target;
    }
}

TEST(Relighting, SeesChangedGeometryAndSettings) {
    const Scene scene = litRoom();
    Bake bake;
    setQuick(bake);
    auto reuses = [&](const Scene& next) {
        bake.run(next);
        return mentions(reportOf(bake)["skipped"], "unchanged");
    };
    EXPECT_FALSE(reuses(scene));
    EXPECT_TRUE(reuses(scene));
    Scene moved = scene;
    moved.instances[1].transform =
        glm::translate(moved.instances[1].transform, glm::dvec3(0, 0, 1e-3));
    EXPECT_FALSE(reuses(moved));
    EXPECT_TRUE(reuses(moved));
    moved.meshes[2].vertices[3].x += 1e-5f;
    EXPECT_FALSE(reuses(moved));
    bake.settings.seed = 9;
    EXPECT_FALSE(reuses(moved));
    bake.settings.patchSize = 0.2f;
    EXPECT_FALSE(reuses(moved));
    bake.settings.linesPerBundle = 5000;
    EXPECT_FALSE(reuses(moved));
    bake.settings.directions = "RANDOM";
    EXPECT_FALSE(reuses(moved));
    bake.settings.threads = 1;
    EXPECT_TRUE(reuses(moved));
}

struct CancelAt {
    rb_stage stage;
    double fraction;
    int calls = 0;
    bool isOn = true;
};

bool cancelAt(void* user, rb_stage stage, double fraction) {
    CancelAt& at = *static_cast<CancelAt*>(user);
    ++at.calls;
    return !(at.isOn && stage == at.stage && fraction >= at.fraction);
}

TEST(Cancel, AnyStageCanBeCancelledAndRunAgain) {
    const Scene scene = litRoom();
    const std::vector<glm::vec3> wanted = bakeQuick(scene);
    for (rb_stage stage : {RB_STAGE_PATCHES, RB_STAGE_FIRST_SHOT, RB_STAGE_BUNDLES, RB_STAGE_SOLVE,
                           RB_STAGE_RECONSTRUCTION})
        for (double fraction : {0.0, 0.4, 1.0}) {
            CancelAt at{stage, fraction};
            Bake bake;
            setQuick(bake);
            bake.progress = Progress(cancelAt, &at);
            try {
                bake.run(scene);
                ADD_FAILURE() << "stage " << stage << " at " << fraction << " was not cancelled";
            } catch (const Error& error) {
                EXPECT_EQ(error.code, RB_ERROR_CANCELLED);
            }
            EXPECT_FALSE(bake.hasRun());
            EXPECT_THROW(cornerLight(bake, 0, RB_OUTPUT_COMBINED), Error);
            at.isOn = false;
            bake.run(scene);
            EXPECT_LT(difference(everything(bake), wanted), 1e-5)
                << "stage " << stage << " at " << fraction;
        }
}

TEST(Cancel, TheLastResultIsKept) {
    const Scene scene = litRoom();
    Bake bake;
    setQuick(bake);
    bake.run(scene);
    const std::vector<glm::vec3> wanted = everything(bake);
    const std::string json = bake.reportJson();
    CancelAt at{RB_STAGE_BUNDLES, 0.5};
    bake.progress = Progress(cancelAt, &at);
    bake.settings.seed = 3;
    EXPECT_THROW(bake.run(scene), Error);
    EXPECT_EQ(difference(everything(bake), wanted), 0);
    EXPECT_EQ(bake.reportJson(), json);
}

TEST(Cancel, StagesComeInOrderAndEnd) {
    struct Seen {
        std::vector<std::pair<rb_stage, double>> calls;
    } seen;
    Bake bake;
    bake.settings.patchSize = 0.25f;
    bake.progress = Progress(
        [](void* user, rb_stage stage, double fraction) {
            static_cast<Seen*>(user)->calls.emplace_back(stage, fraction);
            return true;
        },
        &seen);
    bake.run(litRoom());
    std::array<bool, 5> begun{}, ended{};
    for (const auto& [stage, fraction] : seen.calls) {
        EXPECT_TRUE(fraction >= 0 && fraction <= 1);
        begun[size_t(stage)] = true;
        ended[size_t(stage)] = ended[size_t(stage)] || fraction == 1;
        for (size_t earlier = 0; earlier < size_t(stage); ++earlier)
            EXPECT_TRUE(begun[earlier]) << "stage " << stage << " before stage " << earlier;
    }
    for (size_t stage = 0; stage < 5; ++stage) EXPECT_TRUE(ended[stage]) << "stage " << stage;
}

}  // namespace
}  // namespace raybundle
