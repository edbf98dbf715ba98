// SPDX-License-Identifier: GPL-3.0-or-later
//
// Handles that were released, belong to another kind or never existed, and calls from several
// threads with one handle. The result is an error or nothing, never a crash.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "api_fixture.h"

namespace raybundle {
namespace {

using namespace test;

class ApiHandles : public Api {};

TEST_F(ApiHandles, AReleasedOneIsSaidAndItsReleaseDoesNothing) {
    rb_scene other = nullptr;
    ASSERT_EQ(rb_new_scene(&other), RB_ERROR_NONE);
    rb_release_scene(other);
    rb_release_scene(other);
    const float black[3] = {0, 0, 0};
    expectInvalid(rb_set_world(other, black), "scene");
    expectInvalid(rb_execute_bake(bake, other), "scene");

    rb_bake gone = nullptr;
    ASSERT_EQ(rb_new_bake(&gone), RB_ERROR_NONE);
    rb_release_bake(gone);
    rb_release_bake(gone);
    expectInvalid(rb_set_bake_int(gone, "seed", 1), "bake");
    expectInvalid(rb_execute_bake(gone, scene), "bake");
}

TEST_F(ApiHandles, AnotherOneNeverTakesTheirPlace) {
    rb_bake gone = nullptr;
    ASSERT_EQ(rb_new_bake(&gone), RB_ERROR_NONE);
    rb_release_bake(gone);
    for (int k = 0; k < 100; ++k) {
        rb_bake other = nullptr;
        ASSERT_EQ(rb_new_bake(&other), RB_ERROR_NONE);
        EXPECT_NE(other, gone);
        rb_release_bake(gone);
        EXPECT_EQ(rb_set_bake_int(other, "seed", k), RB_ERROR_NONE) << message();
        rb_release_bake(other);
    }
}

TEST_F(ApiHandles, OfAnotherKindOrNeverGivenTheyAreRefused) {
    expectInvalid(rb_set_bake_int(reinterpret_cast<rb_bake>(scene), "seed", 1), "bake");
    expectInvalid(rb_execute_bake(bake, reinterpret_cast<rb_scene>(bake)), "scene");
    rb_release_scene(reinterpret_cast<rb_scene>(bake));
    int32_t number = 0;
    size_t count = 0;
    for (void* madeUp : {static_cast<void*>(&number), reinterpret_cast<void*>(~uintptr_t(0))}) {
        expectInvalid(rb_set_bake_int(static_cast<rb_bake>(madeUp), "seed", 1), "bake");
        expectInvalid(rb_get_subdivision_size(static_cast<rb_subdivision>(madeUp), &count, &count),
                      "subdivision");
        expectInvalid(
            rb_get_simplification_size(static_cast<rb_simplification>(madeUp), &count, &count),
            "simplification");
        rb_release_bake(static_cast<rb_bake>(madeUp));
        rb_release_scene(static_cast<rb_scene>(madeUp));
        rb_release_subdivision(static_cast<rb_subdivision>(madeUp));
        rb_release_simplification(static_cast<rb_simplification>(madeUp));
    }
    EXPECT_EQ(rb_set_bake_int(bake, "seed", 1), RB_ERROR_NONE) << message();
}

// An action that a progress function runs once, in the middle of a bake.
struct Intrusion {
    const std::function<void()> act;
    bool isDone = false;
};

bool intrude(void* user, rb_stage, double) {
    Intrusion& intrusion = *static_cast<Intrusion*>(user);
    if (!intrusion.isDone) intrusion.act();
    intrusion.isDone = true;
    return true;
}

TEST_F(ApiHandles, OneInUseIsRefusedInEveryThread) {
    const int32_t instance = addFurnace();
    const float black[3] = {0, 0, 0};
    auto isRefused = [&] {
        EXPECT_EQ(rb_set_bake_int(bake, "seed", 7), RB_ERROR_INVALID_OPERATION);
        EXPECT_NE(message().find("bake"), std::string::npos);
        EXPECT_EQ(rb_execute_bake(bake, scene), RB_ERROR_INVALID_OPERATION);
        EXPECT_EQ(rb_set_world(scene, black), RB_ERROR_INVALID_OPERATION);
        EXPECT_NE(message().find("scene"), std::string::npos);
    };
    Intrusion intrusion{[&] {
        isRefused();
        std::thread(isRefused).join();
    }};
    ASSERT_EQ(rb_set_bake_progress(bake, intrude, &intrusion), RB_ERROR_NONE);
    EXPECT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    EXPECT_TRUE(intrusion.isDone);
    expectFurnace(instance);
    int32_t seed = -1;
    EXPECT_EQ(rb_get_bake_int(bake, "seed", &seed), RB_ERROR_NONE);
    EXPECT_EQ(seed, 0);
}

TEST_F(ApiHandles, OneReleasedDuringABakeGoesAfterIt) {
    addFurnace();
    Intrusion intrusion{[&] {
        rb_release_bake(bake);
        rb_release_bake(bake);
        std::thread([&] { rb_release_scene(scene); }).join();
    }};
    ASSERT_EQ(rb_set_bake_progress(bake, intrude, &intrusion), RB_ERROR_NONE);
    EXPECT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    EXPECT_TRUE(intrusion.isDone);
    expectInvalid(rb_set_bake_int(bake, "seed", 7), "bake");
    expectInvalid(rb_execute_bake(bake, scene), "bake");
}

TEST_F(ApiHandles, ManyThreadsMakeUseAndReleaseThem) {
    // All threads use one common bake, which only one of them can use at a time, and each uses a
    // bake of its own.
    std::atomic<int> refused{0}, wrong{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&] {
            for (int k = 0; k < 500; ++k) {
                const rb_error shared = rb_set_bake_int(bake, "seed", k);
                refused += shared == RB_ERROR_INVALID_OPERATION;
                wrong += shared != RB_ERROR_NONE && shared != RB_ERROR_INVALID_OPERATION;
                rb_bake own = nullptr;
                wrong += rb_new_bake(&own) != RB_ERROR_NONE;
                wrong += rb_set_bake_int(own, "seed", k) != RB_ERROR_NONE;
                rb_release_bake(own);
                wrong += rb_set_bake_int(own, "seed", k) != RB_ERROR_INVALID_ARGUMENT;
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0) << "and " << refused << " refused";
}

}  // namespace
}  // namespace raybundle
