// SPDX-License-Identifier: GPL-3.0-or-later
//
// Runs: bakes in the background behind the C interface.
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <thread>
#include <vector>

#include "api_fixture.h"

namespace raybundle {
namespace {

using namespace test;

// A test of a run. The run is released before the bake and the scene.
class ApiRun : public Api {
  protected:
    void TearDown() override {
        rb_release_run(run);
        Api::TearDown();
    }
    void start() { ASSERT_EQ(rb_start_bake(bake, scene, &run), RB_ERROR_NONE) << message(); }
    rb_run_state state() {
        rb_run_state now{};
        now.size = sizeof now;
        EXPECT_EQ(rb_get_run_state(run, &now), RB_ERROR_NONE) << message();
        return now;
    }
    // Waits until the state is as wanted, or the run has ended. Returns the state.
    rb_run_state waitFor(const std::function<bool(const rb_run_state&)>& isWanted) {
        rb_run_state now = state();
        while (now.is_running && !isWanted(now)) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
            now = state();
        }
        return now;
    }
    // Makes the bake last until it is cancelled.
    void makeEndless() {
        ASSERT_EQ(rb_set_bake_int(bake, "skip.bundles", 0), RB_ERROR_NONE) << message();
        ASSERT_EQ(rb_set_bake_int(bake, "max_bundles", 1 << 20), RB_ERROR_NONE) << message();
    }

    rb_run run = nullptr;
};

TEST_F(ApiRun, GivesTheLightOfAnExecution) {
    const int32_t instance = addFurnace();
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    const std::vector<float> executed = cornerLight(instance);
    rb_bake other = nullptr;
    ASSERT_EQ(rb_new_bake(&other), RB_ERROR_NONE);
    ASSERT_EQ(rb_set_bake_float(other, "patch_size", 0.2f), RB_ERROR_NONE);
    std::swap(bake, other);
    rb_release_bake(other);
    start();
    ASSERT_EQ(rb_finish_run(run), RB_ERROR_NONE) << message();
    EXPECT_FALSE(state().is_running);
    EXPECT_EQ(cornerLight(instance), executed);
}

TEST_F(ApiRun, DraftMakesNoInterimLight) {
    addFurnace();
    ASSERT_EQ(rb_set_bake_int(bake, "draft", 1), RB_ERROR_NONE) << message();
    start();
    ASSERT_EQ(rb_finish_run(run), RB_ERROR_NONE) << message();
    EXPECT_EQ(state().interim, 0);
}

TEST_F(ApiRun, ShowsLightWhileItGoesOn) {
    const int32_t instance = addFurnace();
    makeEndless();
    start();
    // Before the second light, the first one must be read: nothing is made for nobody.
    std::vector<float> rgb(72, -1);
    rb_run_state now = waitFor([](const rb_run_state& s) { return s.interim == 1; });
    ASSERT_EQ(now.interim, 1);
    ASSERT_EQ(rb_get_run_light(run, instance, RB_OUTPUT_COMBINED, rgb.data(), 24), RB_ERROR_NONE)
        << message();
    // The walls emit 1 W/m^2 from the beginning, and 2 W/m^2 at the end.
    for (float v : rgb) EXPECT_GE(v * 3.14159265f, 0.999f);
    now = waitFor([](const rb_run_state& s) { return s.interim >= 2 && s.noise >= 0; });
    ASSERT_GE(now.interim, 2);
    EXPECT_TRUE(now.is_running);
    ASSERT_EQ(rb_get_run_light(run, instance, RB_OUTPUT_COMBINED, rgb.data(), 24), RB_ERROR_NONE);
    for (float v : rgb) EXPECT_LE(v * 3.14159265f, 2.001f);
    expectInvalid(rb_get_run_light(run, instance, RB_OUTPUT_COMBINED, rgb.data(), 23), "count");
    expectInvalid(rb_get_run_light(run, 7, RB_OUTPUT_COMBINED, rgb.data(), 24), "instance 7");
}

TEST_F(ApiRun, EndsWhenItIsCancelledAndKeepsTheLastResult) {
    const int32_t instance = addFurnace();
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    makeEndless();
    start();
    waitFor([](const rb_run_state& s) { return s.stage == RB_STAGE_BUNDLES; });
    ASSERT_EQ(rb_cancel_run(run), RB_ERROR_NONE) << message();
    expectFailure(rb_finish_run(run), RB_ERROR_CANCELLED, "cancelled");
    EXPECT_FALSE(state().is_running);
    expectFurnace(instance);
    EXPECT_EQ(rb_cancel_run(run), RB_ERROR_NONE);
}

TEST_F(ApiRun, UsesItsBakeAndItsSceneUntilItEnds) {
    addFurnace();
    makeEndless();
    start();
    expectFailure(rb_execute_bake(bake, scene), RB_ERROR_INVALID_OPERATION, "bake");
    rb_run second = nullptr;
    expectFailure(rb_start_bake(bake, scene, &second), RB_ERROR_INVALID_OPERATION, "bake");
    rb_bake other = nullptr;
    ASSERT_EQ(rb_new_bake(&other), RB_ERROR_NONE);
    expectFailure(rb_start_bake(other, scene, &second), RB_ERROR_INVALID_OPERATION, "scene");
    rb_release_bake(other);
    // Both go when the run has ended.
    rb_release_bake(bake);
    rb_release_scene(scene);
    bake = nullptr;
    scene = nullptr;
    EXPECT_TRUE(state().is_running);
    rb_release_run(run);
    expectInvalid(rb_finish_run(run), "run");
}

TEST_F(ApiRun, FailsWithTheMessageOfTheBake) {
    addFurnace();
    ASSERT_EQ(rb_set_bake_string(bake, "solver", "RANDOM_WALK"), RB_ERROR_NONE);
    ASSERT_EQ(rb_set_bake_string(bake, "first_shot", "EXTENDED"), RB_ERROR_NONE);
    const rb_error executed = rb_execute_bake(bake, scene);
    const std::string said = message();
    ASSERT_NE(executed, RB_ERROR_NONE);
    start();
    EXPECT_EQ(rb_finish_run(run), executed);
    EXPECT_EQ(message(), said);
    expectInvalid(rb_start_bake(bake, scene, nullptr), "run");
    rb_run_state now{};
    expectInvalid(rb_get_run_state(run, &now), "state");
}

TEST_F(ApiRun, RestsTheCallersProgressFunction) {
    addFurnace();
    int calls = 0;
    auto count = [](void* user, rb_stage, double) { return ++*static_cast<int*>(user) > 0; };
    ASSERT_EQ(rb_set_bake_progress(bake, count, &calls), RB_ERROR_NONE);
    start();
    ASSERT_EQ(rb_finish_run(run), RB_ERROR_NONE) << message();
    EXPECT_EQ(calls, 0);
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    EXPECT_GT(calls, 0);
}

}  // namespace
}  // namespace raybundle
