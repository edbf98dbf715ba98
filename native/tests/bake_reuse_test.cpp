// SPDX-License-Identifier: GPL-3.0-or-later
//
// A bake that runs again: relighting, cancelling, the last result.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bake/bake.h"
#include "job/error.h"
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
    EXPECT_FALSE(skips(reportOf(again), SkippedWork::UNCHANGED_GEOMETRY));
    again.run(after);
    EXPECT_TRUE(skips(reportOf(again), SkippedWork::UNCHANGED_GEOMETRY));
    fresh.run(after);
    EXPECT_LT(difference(everything(again), everything(fresh)), 1e-5);
}

TEST(Relighting, ShootsAgainOnlyWhereLightsChanged) {
    // Without emission, because reflectances decide whether emission becomes a source.
    auto room = [](float reflectance, double power) {
        Scene scene = roomWithBoxes(reflectance);
        scene.addLight(pointLight({1, 1, 2}, glm::dvec3(power)));
        return scene;
    };
    Bake again;
    setQuick(again);
    auto keepsShot = [&](const Scene& scene) {
        again.run(scene);
        Bake fresh;
        setQuick(fresh);
        fresh.run(scene);
        EXPECT_LT(difference(everything(again), everything(fresh)), 1e-5);
        return skips(reportOf(again), SkippedWork::UNCHANGED_LIGHTS);
    };
    EXPECT_FALSE(keepsShot(room(0.6f, 1)));
    EXPECT_TRUE(keepsShot(room(0.3f, 1)));
    EXPECT_FALSE(keepsShot(room(0.3f, 2)));
    again.settings.targetError = 0.5f;
    again.run(room(0.3f, 2));
    EXPECT_FALSE(skips(reportOf(again), SkippedWork::UNCHANGED_LIGHTS));
}

// Three lamps, one of them a mesh, behind and above the boxes.
Scene roomOfThree(const glm::dvec3& first, const glm::dvec3& second, float third) {
    Scene scene = roomWithBoxes(0.5f);
    scene.addLight(pointLight({0.5, 0.5, 2}, first));
    scene.addLight(areaLight({3, 2.5, 2.6}, {0.3, 0, 0}, {0, -0.2, 0}, second));
    place(scene, rectangle("lamp", {1.5f, 1.4f, 2.75f}, {0, 0.5f, 0}, {0.6f, 0, 0}),
          grey("lamp", 0.5f, third));
    return scene;
}

TEST(Relighting, ScalesWhatEachLightBrought) {
    struct Case {
        glm::dvec3 first, second;
        float third;
        bool isScaled;
    };
    // Colours change, a lamp goes out and comes back, and a lamp that becomes dominant is gathered
    // again.
    const Case cases[] = {
        {{1, 1, 1}, {8, 8, 8}, 60, false},    {{1, 0.3, 0.1}, {8, 8, 8}, 60, true},
        {{0.6, 0.6, 1}, {9, 5, 8}, 80, true}, {{0, 0, 0}, {8, 8, 8}, 60, true},
        {{1, 1, 1}, {8, 8, 8}, 70, true},     {{50, 20, 20}, {8, 8, 8}, 60, false}};
    Bake again;
    setQuick(again);
    for (const Case& c : cases) {
        const Scene scene = roomOfThree(c.first, c.second, c.third);
        again.run(scene);
        const Json report = reportOf(again);
        EXPECT_EQ(skips(report, SkippedWork::SCALED_LIGHTS), c.isScaled) << c.first.x;
        Bake fresh;
        setQuick(fresh);
        fresh.run(scene);
        if (c.isScaled) {
            EXPECT_LT(int(report["shadow_rays"]), int(reportOf(fresh)["shadow_rays"]) / 4);
        }
        const double stated = reportOf(fresh)["estimated_error"];
        // Both bakes have the noise that they state. They share the noise of the lines.
        EXPECT_LT(noise(everything(again), everything(fresh)), stated) << c.first.x;
        EXPECT_NEAR(report["estimated_error"], stated, 0.2 * stated);
        const Json energy = reportOf(fresh)["energy"];
        EXPECT_NEAR(report["energy"]["emitted"], energy["emitted"],
                    1e-3 * double(energy["emitted"]));
    }
}

TEST(Relighting, ADraftHasTheLightOfItsBundles) {
    // The residual of the solves of a draft is at most 0.002, relative to its light. Solutions are
    // not linear in the lines, so that their mean differs from the solution with all lines by a
    // part of their noise, which is small against the noise of the result.
    Bake whole, draft;
    for (Bake* bake : {&whole, &draft}) {
        setQuick(*bake);
        bake->settings.minBundles = bake->settings.maxBundles = 64;
        bake->settings.targetError = 0.3f;
    }
    draft.settings.draft = 1;
    whole.run(litRoom());
    draft.run(litRoom());
    EXPECT_EQ(reportOf(draft)["bundles"], 64);
    EXPECT_GT(difference(everything(draft), everything(whole)), 1e-5);
    EXPECT_LT(std::abs(double(reportOf(draft)["energy"]["balance_error"])), 0.01);
    const double stated = reportOf(whole)["estimated_error"];
    EXPECT_LT(noise(everything(draft), everything(whole)), 0.3 * stated);
    EXPECT_NEAR(reportOf(draft)["estimated_error"], stated, 0.05 * stated);
}

TEST(Relighting, OneLightIsExactlyScaled) {
    auto room = [](const glm::dvec3& colour) {
        Scene scene = roomWithBoxes(0.5f);
        scene.addLight(pointLight({1, 1, 2}, colour));
        return scene;
    };
    Bake again, fresh;
    setQuick(again);
    setQuick(fresh);
    again.run(room({1, 0.8, 0.6}));
    again.run(room({0.2, 3, 1}));
    fresh.run(room({0.2, 3, 1}));
    EXPECT_TRUE(skips(reportOf(again), SkippedWork::SCALED_LIGHTS));
    EXPECT_EQ(reportOf(again)["shadow_rays"], 0);
    EXPECT_LT(difference(everything(again), everything(fresh)), 1e-5);
}

// Four lamps, the last of which is at `x` (m), or absent if `x` is not finite.
Scene roomOfFour(double x) {
    Scene scene = roomOfThree({1, 1, 1}, {8, 8, 8}, 60);
    if (std::isfinite(x)) scene.addLight(pointLight({x, 1, 1.5}, {0.5, 0.4, 0.3}));
    return scene;
}

TEST(Relighting, GathersOnlyTheLampThatMoved) {
    Bake again;
    setQuick(again);
    again.run(roomOfFour(1));
    // The lamp moves step by step, goes and comes back. All other lamps stay.
    for (double x : {1.1, 1.2, 2.5, double(INFINITY), 1.0, 0.4}) {
        const Scene scene = roomOfFour(x);
        again.run(scene);
        const Json report = reportOf(again);
        const bool isAsKept = !std::isfinite(x) || x == 1;
        EXPECT_EQ(skips(report, SkippedWork::KEPT_LIGHTS), !isAsKept) << x;
        EXPECT_EQ(skips(report, SkippedWork::SCALED_LIGHTS), isAsKept) << x;
        Bake fresh;
        setQuick(fresh);
        fresh.run(scene);
        EXPECT_LT(int(report["shadow_rays"]), int(reportOf(fresh)["shadow_rays"]) / 2) << x;
        const double stated = reportOf(fresh)["estimated_error"];
        // Both bakes have the noise that they state. They share the noise of the lines.
        EXPECT_LT(noise(everything(again), everything(fresh)), stated) << x;
        EXPECT_NEAR(report["estimated_error"], stated, 0.2 * stated) << x;
        const Json energy = reportOf(fresh)["energy"];
        EXPECT_NEAR(report["energy"]["emitted"], energy["emitted"],
                    1e-3 * double(energy["emitted"]));
    }
}

TEST(Relighting, TheSameSceneNeedsNoMoreBundles) {
    // The number of bundles is independent of how many looks at the noise the first bake took.
    for (float target : {0.03f, 0.02f, 0.014f, 0.01f}) {
        Bake bake;
        bake.settings.minBundles = 8;
        bake.settings.targetError = target;
        bake.run(litRoom());
        const Json first = reportOf(bake);
        const std::vector<glm::vec3> light = everything(bake);
        bake.run(litRoom());
        const Json second = reportOf(bake);
        EXPECT_EQ(second["bundles"], first["bundles"]) << target;
        // Equal to the last bit: a second bake for another output matches the first.
        EXPECT_EQ(everything(bake), light) << target;
        // The solve starts from another solution, which changes the error by about a hundredth of
        // the target.
        EXPECT_NEAR(second["estimated_error"], first["estimated_error"], 0.01 * target) << target;
    }
}

TEST(Relighting, SeesChangedGeometryAndSettings) {
    const Scene scene = litRoom();
    Bake bake;
    setQuick(bake);
    auto reuses = [&](const Scene& next) {
        bake.run(next);
        return skips(reportOf(bake), SkippedWork::UNCHANGED_GEOMETRY);
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
    bake.settings.directions = DirectionKind::RANDOM;
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

// Cancels at one call and measures the processor time that the process has spent since then, in
// seconds of all its threads.
struct CancelAndCount {
    int call = 0, calls = 0;  // index of the call, from 0; calls so far
    double at = NAN;
    rb_stage stage = RB_STAGE_PATCHES;

    static double computed() {
        timespec time;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
        return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
    }
    static bool tell(void* user, rb_stage stage, double) {
        CancelAndCount& own = *static_cast<CancelAndCount*>(user);
        if (own.calls++ != own.call) return true;
        own.stage = stage;
        own.at = computed();
        return false;
    }
};

// Terrain of 6400 faces, or of RAYBUNDLE_CANCEL_FACES. The progress function is called every 20 ms
// and when a stage reports, so that a cancel may come at any point.
TEST(Cancel, ComesAnywhereAndSoon) {
    Scene scene;
    scene.worldRadiance = glm::vec3(0.5f);
    const char* const faces = std::getenv("RAYBUNDLE_CANCEL_FACES");
    const int edge = faces ? int(std::sqrt(std::atof(faces))) : kFewBakes ? 40 : 80;
    Mesh land = grid("land", {-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, edge, edge);
    for (glm::vec3& v : land.vertices) v.z = 0.3f * std::sin(3 * v.x) * std::cos(2 * v.y);
    place(scene, land, grey("", 0.5f));
    place(scene, box("box", {-0.5f, -0.5f, 0.5f}, {0.5f, 0.5f, 1.5f}, false), grey("", 0.5f));
    scene.addLight(pointLight({2, 1, 3}, glm::dvec3(30)));
    CancelAndCount whole{INT32_MAX};
    Bake bake;
    bake.settings.targetError = 0.1f;
    bake.progress = Progress(CancelAndCount::tell, &whole);
    bake.run(scene);
    ASSERT_GT(whole.calls, 8);
    const std::vector<glm::vec3> light = cornerLight(bake, 0, RB_OUTPUT_LIGHTING);
    std::mt19937 random(1);
    std::array<double, RB_STAGE_RECONSTRUCTION + 1> most{};
    int cancels = 0;
    for (int k = 0; k < (faces ? 64 : 8); ++k) {
        CancelAndCount cancel{int(random() % uint32_t(whole.calls))};
        bake.progress = Progress(CancelAndCount::tell, &cancel);
        bake.settings.skipGeometry = 0;
        try {
            bake.run(scene);
            // The number of calls depends on the time that the bake takes.
            EXPECT_LE(cancel.calls, cancel.call + 1);
        } catch (const Error& error) {
            EXPECT_EQ(error.code, RB_ERROR_CANCELLED);
            ++cancels;
            double& ofStage = most[cancel.stage];
            ofStage = std::max(ofStage, CancelAndCount::computed() - cancel.at);
            EXPECT_EQ(cornerLight(bake, 0, RB_OUTPUT_LIGHTING), light) << "the last result stays";
        }
    }
    EXPECT_GT(cancels, 0);
    std::printf("[ figures  ] after a cancel the threads compute for at most, by stage, s:");
    for (const double seconds : most) std::printf(" %.3f", seconds);
    std::printf("\n");
    bake.progress = Progress();
    bake.run(scene);
    EXPECT_LT(difference(cornerLight(bake, 0, RB_OUTPUT_LIGHTING), light), 1e-5);
}

// Cancels at one call of the progress function.
struct CancelAtCall {
    int call = 0, calls = 0;  // index of the call, from 0; calls so far
    std::pair<rb_stage, double> last{RB_STAGE_PATCHES, 0.0};  // what the last call reported
};

bool cancelAtCall(void* user, rb_stage stage, double fraction) {
    CancelAtCall& at = *static_cast<CancelAtCall*>(user);
    at.last = {stage, fraction};
    return at.calls++ != at.call;
}

// Cancels at each call in turn, or at every step-th call. The results of the bake before remain, and
// the next bake, which uses what is left, is right. Its solve starts from another solution, which
// allows a difference of 1e-5 (kMostTolerance in bundle_solve.cpp).
void cancelAtEachCall(const Scene& before, const Scene& scene, const Settings& settings,
                      int step = 1) {
    Bake fresh, bake;
    fresh.settings = bake.settings = settings;
    CancelAtCall never{-1};
    fresh.progress = Progress(cancelAtCall, &never);
    fresh.run(scene);
    const std::vector<glm::vec3> wanted = everything(fresh);
    for (CancelAtCall at;; at.call += step) {
        bake.progress = Progress();
        bake.run(before);
        const std::vector<glm::vec3> light = everything(bake);
        const std::string json = bake.reportJson();
        bake.progress = Progress(cancelAtCall, &at);
        bake.settings.skipGeometry = 0;  // do the whole work, not a relighting
        at.calls = 0;
        bool isCancelled = false;
        try {
            bake.run(scene);
        } catch (const Error& error) {
            isCancelled = error.code == RB_ERROR_CANCELLED;
        }
        bake.settings.skipGeometry = 1;
        if (at.calls <= at.call) {
            EXPECT_FALSE(isCancelled);
            EXPECT_GT(at.call, 10);
            break;
        }
        // The last report is repeated every 20 ms, also when nothing is left to do.
        if (!isCancelled && at.last == never.last) {
            EXPECT_LT(difference(everything(bake), wanted), 1e-5) << "call " << at.call;
            continue;
        }
        ASSERT_TRUE(isCancelled) << "call " << at.call;
        EXPECT_EQ(everything(bake), light) << "call " << at.call;
        EXPECT_EQ(bake.reportJson(), json) << "call " << at.call;
        bake.progress = Progress();
        bake.run(scene);
        EXPECT_LT(difference(everything(bake), wanted), 1e-5) << "call " << at.call;
    }
}

TEST(Cancel, EachCallCanCancel) {
    Bake quick;
    setQuick(quick, 32);
    cancelAtEachCall(litRoom(0.3f), litRoom(), quick.settings);
}

TEST(Cancel, EachCallCanCancelLightSetsGatheredAtCorners) {
    auto room = [](float reflectance) {
        Scene scene = litRoom(reflectance);
        const int32_t set = scene.addLightSet("lamps");
        Light lamp = pointLight({1, 1, 2}, {1, 5, 2});
        lamp.lightSet = set;
        scene.addLight(std::move(lamp));
        return scene;
    };
    Bake quick;
    setQuick(quick, 32);
    quick.settings.reconstruction = Reconstruction::POINT;
    quick.settings.finalGather = 1;
    cancelAtEachCall(room(0.3f), room(0.6f), quick.settings, kFewBakes ? 4 : 1);
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
