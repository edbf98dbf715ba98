// SPDX-License-Identifier: GPL-3.0-or-later
//
// The C interface, called through the shared library only.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "api_fixture.h"

namespace raybundle {
namespace {

using namespace test;

TEST(ApiVersion, IsThatOfTheHeader) {
    EXPECT_EQ(rb_get_abi_version(), RB_ABI_VERSION);
    int major = -1, minor = -1, patch = -1;
    EXPECT_EQ(std::sscanf(rb_get_version(), "%d.%d.%d", &major, &minor, &patch), 3)
        << rb_get_version();
}

TEST_F(Api, SettingsHaveReadableDefaults) {
    int32_t number = -1;
    float real = -1;
    const char* text = nullptr;
    const std::vector<std::pair<const char*, int32_t>> integers = {
        {"max_patches", 100000}, {"refine", 0}, {"min_bundles", 64}, {"max_bundles", 65536},
        {"lines_per_bundle", 0}, {"seed", 0},   {"threads", 0}};
    for (const auto& [name, value] : integers) {
        EXPECT_EQ(rb_get_bake_int(bake, name, &number), RB_ERROR_NONE) << name;
        EXPECT_EQ(number, value) << name;
    }
    const std::vector<std::pair<const char*, float>> reals = {{"target_error", 0.02f},
                                                              {"memory_limit", 0},
                                                              {"regularization", 0.005f},
                                                              {"patch_size", 0.2f}};
    for (const auto& [name, value] : reals) {
        EXPECT_EQ(rb_get_bake_float(bake, name, &real), RB_ERROR_NONE) << name;
        EXPECT_EQ(real, value) << name;
    }
    const std::vector<std::pair<const char*, const char*>> texts = {
        {"solver", "LINE_REUSE"},
        {"first_shot", "GATHER"},
        {"directions", "LOW_DISCREPANCY"},
        {"projector", "AUTO"},
        {"small_patches", "CENTRE_SAMPLING"},
        {"reconstruction", "LEAST_SQUARES"}};
    for (const auto& [name, value] : texts) {
        EXPECT_EQ(rb_get_bake_string(bake, name, &text), RB_ERROR_NONE) << name;
        EXPECT_STREQ(text, value) << name;
    }
}

TEST_F(Api, ThereIsNoResultBeforeABake) {
    addFurnace();
    std::vector<float> rgb(72, -1);
    const char* json = "untouched";
    expectFailure(rb_get_corner_light(bake, 0, RB_OUTPUT_COMBINED, rgb.data(), 24),
                  RB_ERROR_INVALID_OPERATION, "bake");
    expectFailure(rb_get_vertex_light(bake, 0, RB_OUTPUT_COMBINED, rgb.data(), 8),
                  RB_ERROR_INVALID_OPERATION, "bake");
    expectFailure(rb_get_report(bake, &json), RB_ERROR_INVALID_OPERATION, "bake");
    EXPECT_STREQ(json, "untouched");
}

TEST_F(Api, AnOccluderHasNoResult) {
    addInstance(addCube(addMaterial()), RB_ROLE_OCCLUDE);
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    std::vector<float> rgb(72);
    expectInvalid(rb_get_corner_light(bake, 0, RB_OUTPUT_COMBINED, rgb.data(), 24), "box");
}

TEST_F(Api, TheSceneMayGoBeforeItsResultIsFetched) {
    const int32_t instance = addFurnace();
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    rb_release_scene(scene);
    scene = nullptr;
    expectFurnace(instance);
}

TEST_F(Api, TheBakeMayGoBeforeTheScene) {
    const int32_t instance = addFurnace();
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    rb_release_bake(bake);
    bake = nullptr;
    ASSERT_EQ(rb_new_bake(&bake), RB_ERROR_NONE);
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    expectFurnace(instance);
}

TEST_F(Api, OneBakeServesSeveralScenes) {
    const int32_t instance = addFurnace();
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    rb_scene empty = nullptr;
    ASSERT_EQ(rb_new_scene(&empty), RB_ERROR_NONE);
    EXPECT_EQ(rb_execute_bake(bake, empty), RB_ERROR_NONE) << message();
    rb_release_scene(empty);
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    expectFurnace(instance);
}

TEST_F(Api, ReflectanceOfOneIsClampedAndTheMaterialNamed) {
    rb_surface mirror = surface(0.5f, 1);
    mirror.reflectance.constant[0] = 1;
    mirror.reflectance.constant[1] = 1.5f;
    addInstance(addCube(addMaterial(mirror)));
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    const std::string warnings = report()["warnings"].dump();
    EXPECT_NE(warnings.find("glow"), std::string::npos) << warnings;
    EXPECT_NE(warnings.find("0.999"), std::string::npos) << warnings;
    const std::vector<float> rgb = cornerLight(0);
    // E / (1 - rho): a thousand times the emission at 0.999. The third channel is unchanged.
    for (size_t c = 0; c < 72; c += 3) {
        EXPECT_NEAR(rgb[c] * 3.14159265f, 1000, 5);
        EXPECT_NEAR(rgb[c + 1] * 3.14159265f, 1000, 5);
        EXPECT_NEAR(rgb[c + 2] * 3.14159265f, 2, 1e-3);
    }
}

TEST_F(Api, ImagesAndCornerColoursGiveReflectance) {
    // A black base, plus half of an image of constant 0.6 and half of corner colours of 0.4: rho =
    // 0.5.
    const std::vector<float> pixels(4 * 2 * 3, 0.6f), uvs(48, 0.3f), colors(72, 0.4f);
    rb_surface painted = surface(0, 1);
    ASSERT_EQ(rb_add_image(scene, "paint", 4, 2, pixels.data(), RB_IMAGE_REPEAT,
                           &painted.reflectance.image),
              RB_ERROR_NONE);
    setAll(painted.reflectance.image_weight, 0.5f);
    setAll(painted.reflectance.corner_color_weight, 0.5f);
    const int32_t mesh = addCube(addMaterial(painted));
    ASSERT_EQ(rb_set_mesh_uvs(scene, mesh, uvs.data(), 24), RB_ERROR_NONE);
    ASSERT_EQ(rb_set_mesh_corner_colors(scene, mesh, colors.data(), 24), RB_ERROR_NONE);
    const int32_t instance = addInstance(mesh);
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    expectFurnace(instance);
}

TEST_F(Api, PixelsThatAreNoColoursAreBlackAndCounted) {
    std::vector<float> pixels(3 * 3, 0.5f);
    pixels[1] = -0.1f;
    pixels[5] = NAN;
    int32_t image = -1;
    ASSERT_EQ(rb_add_image(scene, "paint", 3, 1, pixels.data(), RB_IMAGE_REPEAT, &image),
              RB_ERROR_NONE);
    addFurnace();
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    const nlohmann::json said = report();
    ASSERT_EQ(said["warnings"].size(), 1u);
    EXPECT_EQ(
        said["warnings"][0],
        "image \"paint\": pixels that are negative or not finite count as black (2 of 3 pixels); "
        "correct them in the image");
    EXPECT_EQ(said["warning_ids"][0], "BLACK_PIXELS");
}

TEST_F(Api, ASurfaceIsByDefaultThatOfFacesWithoutAMaterial) {
    const float centre[3] = {0.5f, 0.5f, 0.5f};
    auto lightWith = [&](const std::vector<int32_t>& materials) {
        int32_t mesh = -1, lamp = -1;
        EXPECT_EQ(rb_add_mesh(scene, "cube", kVertices, 8, kCorners, 24, kFaces, 6,
                              materials.empty() ? nullptr : materials.data(), &mesh),
                  RB_ERROR_NONE);
        EXPECT_EQ(rb_add_point_light(scene, "bulb", centre, kOne, 0, RB_POINT_SPHERE, &lamp),
                  RB_ERROR_NONE);
        const int32_t instance = addInstance(mesh);
        EXPECT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
        return cornerLight(instance);
    };
    const std::vector<float> without = lightWith({});
    rb_release_scene(scene);
    ASSERT_EQ(rb_new_scene(&scene), RB_ERROR_NONE);
    rb_surface plain;
    ASSERT_EQ(rb_init_surface(&plain, sizeof plain), RB_ERROR_NONE);
    EXPECT_EQ(lightWith(std::vector<int32_t>(6, addMaterial(plain, plain))), without);
}

TEST_F(Api, OfAShorterSurfaceTheRestHasDefaults) {
    constexpr size_t kShort = offsetof(rb_surface, translucence);
    const float bad = NAN;
    rb_surface older = surface(0.5f, 1);
    for (size_t at = kShort; at < sizeof older; at += sizeof bad)
        std::memcpy(reinterpret_cast<char*>(&older) + at, &bad, sizeof bad);
    const rb_surface whole = older;
    ASSERT_EQ(rb_init_surface(&older, kShort), RB_ERROR_NONE);
    EXPECT_EQ(older.size, kShort);
    EXPECT_EQ(std::memcmp(&older.translucence, &whole.translucence, sizeof older - kShort), 0)
        << "what the caller does not know is not written";
    setAll(older.reflectance.constant, 0.5f);
    setAll(older.emission.constant, 1);
    const int32_t instance = addInstance(addCube(addMaterial(older)));
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    expectFurnace(instance);
}

TEST_F(Api, TheCallersMemoryIsNotKept) {
    int32_t mesh = -1;
    {
        std::vector<float> vertices(std::begin(kVertices), std::end(kVertices));
        std::vector<int32_t> corners(std::begin(kCorners), std::end(kCorners)),
            faces(std::begin(kFaces), std::end(kFaces)), materials(6, addMaterial());
        std::string name = "a name long enough to live on the heap, and gone before the bake";
        ASSERT_EQ(rb_add_mesh(scene, name.c_str(), vertices.data(), 8, corners.data(), 24,
                              faces.data(), 6, materials.data(), &mesh),
                  RB_ERROR_NONE);
        std::fill(vertices.begin(), vertices.end(), NAN);
        std::fill(corners.begin(), corners.end(), -1);
        name.assign(name.size(), 'x');
    }
    const int32_t instance = addInstance(mesh);
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    expectFurnace(instance);
}

struct Watched {
    double cancelAt;
    double done = 0;  // over all stages, each of which counts as a fifth
    bool cancelled = false;
    std::thread::id thread;
};

bool follow(void* user, rb_stage stage, double fraction) {
    Watched& progress = *static_cast<Watched*>(user);
    EXPECT_EQ(std::this_thread::get_id(), progress.thread) << "called from the thread that bakes";
    EXPECT_TRUE(fraction >= 0 && fraction <= 1);
    progress.done = std::max(progress.done, (int(stage) + fraction) / 5);
    progress.cancelled = progress.done >= progress.cancelAt;
    return !progress.cancelled;
}

TEST_F(Api, ABakeCanBeCancelledAnywhereAndUsedAgain) {
    const int32_t instance = addFurnace();
    for (double at : {0.0, 0.1, 0.5, 1.0}) {
        Watched progress{at, 0, false, std::this_thread::get_id()};
        ASSERT_EQ(rb_set_bake_progress(bake, follow, &progress), RB_ERROR_NONE);
        expectFailure(rb_execute_bake(bake, scene), RB_ERROR_CANCELLED, "cancelled");
        EXPECT_TRUE(progress.cancelled) << at;
        std::vector<float> rgb(72);
        EXPECT_EQ(rb_get_corner_error(bake, instance, rgb.data(), 24), RB_ERROR_INVALID_OPERATION);
        EXPECT_EQ(rb_get_corner_light(bake, instance, RB_OUTPUT_COMBINED, rgb.data(), 24),
                  RB_ERROR_INVALID_OPERATION)
            << "a cancelled bake has no result";
    }
    Watched progress{2, 0, false, std::this_thread::get_id()};
    ASSERT_EQ(rb_set_bake_progress(bake, follow, &progress), RB_ERROR_NONE);
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    EXPECT_EQ(progress.done, 1);
    std::vector<float> error(24, -1);
    EXPECT_EQ(rb_get_corner_error(bake, instance, error.data(), 24), RB_ERROR_NONE);
    for (float value : error) EXPECT_NEAR(value, 0, 1e-5) << "in a furnace";
    expectFurnace(instance);
    // Run again without a progress function. Then the old result stays when a later run is
    // cancelled.
    ASSERT_EQ(rb_set_bake_progress(bake, nullptr, nullptr), RB_ERROR_NONE);
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE);
    Watched late{0.5, 0, false, std::this_thread::get_id()};
    ASSERT_EQ(rb_set_bake_progress(bake, follow, &late), RB_ERROR_NONE);
    EXPECT_EQ(rb_execute_bake(bake, scene), RB_ERROR_CANCELLED);
    expectFurnace(instance);
}

TEST_F(Api, MessagesBelongToTheirThread) {
    expectInvalid(rb_set_bake_int(bake, "here", 1), "here");
    std::thread([] {
        EXPECT_EQ(message(), "") << "nothing failed in this thread yet";
        rb_set_bake_int(nullptr, "there", 1);
        EXPECT_NE(message(), "");
    }).join();
    EXPECT_NE(message().find("here"), std::string::npos);
    // A successful call does not clear the message.
    EXPECT_EQ(rb_set_bake_int(bake, "seed", 1), RB_ERROR_NONE);
    EXPECT_NE(message().find("here"), std::string::npos);
}

TEST_F(Api, TwoBakesRunAtOnce) {
    const int32_t instance = addFurnace();
    rb_bake other = nullptr;
    ASSERT_EQ(rb_new_bake(&other), RB_ERROR_NONE);
    rb_error result = RB_ERROR_UNKNOWN;
    rb_scene twin = nullptr;
    std::swap(scene, twin);
    ASSERT_EQ(rb_new_scene(&scene), RB_ERROR_NONE);
    addFurnace();
    std::thread thread([&] { result = rb_execute_bake(other, twin); });
    EXPECT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    thread.join();
    EXPECT_EQ(result, RB_ERROR_NONE);
    expectFurnace(instance);
    std::swap(bake, other);
    expectFurnace(instance);
    rb_release_bake(other);
    rb_release_scene(twin);
}

TEST(ApiSubdivision, CutsAMeshForTheCaller) {
    rb_subdivision subdivision = nullptr;
    ASSERT_EQ(rb_new_subdivision(kVertices, 8, kCorners, 24, kFaces, 6, 0.3f, &subdivision),
              RB_ERROR_NONE);
    size_t vertices = 0, triangles = 0;
    ASSERT_EQ(rb_get_subdivision_size(subdivision, &vertices, &triangles), RB_ERROR_NONE);
    EXPECT_EQ(vertices, triangles / 2 + 2) << "Euler: a closed surface without holes";
    std::vector<float> positions(3 * vertices), weights(9 * triangles);
    std::vector<int32_t> corners(3 * triangles), faces(triangles), sources(9 * triangles);
    expectInvalid(rb_get_subdivision(subdivision, positions.data(), vertices - 1, corners.data(),
                                     faces.data(), sources.data(), weights.data(), triangles),
                  "vertex_count");
    expectInvalid(rb_get_subdivision(subdivision, positions.data(), vertices, corners.data(),
                                     faces.data(), nullptr, weights.data(), triangles),
                  "source_corners");
    ASSERT_EQ(rb_get_subdivision(subdivision, positions.data(), vertices, corners.data(),
                                 faces.data(), sources.data(), weights.data(), triangles),
              RB_ERROR_NONE);
    for (int32_t corner : corners) EXPECT_TRUE(corner >= 0 && size_t(corner) < vertices);
    for (int32_t face : faces) EXPECT_TRUE(face >= 0 && face < 6);
    for (int32_t source : sources) EXPECT_TRUE(source >= 0 && source < 24);
    rb_release_subdivision(subdivision);
}

TEST(ApiSimplification, TakesVerticesOutForTheCaller) {
    // Three vertices in a row on one side of a triangle, cut into two faces.
    const float points[12] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 2, 0};
    const int32_t corners[6] = {0, 1, 3, 1, 2, 3}, offsets[3] = {0, 3, 6};
    const float values[6] = {0, 1, 0, 1, 2.1f, 0};
    for (const float tolerance : {0.04f, 0.06f}) {
        rb_simplification made = nullptr;
        ASSERT_EQ(rb_new_simplification(points, 4, corners, 6, offsets, 2, nullptr, nullptr, values,
                                        &tolerance, 1, 1e-3f, &made),
                  RB_ERROR_NONE);
        size_t cornerCount = 0, faceCount = 0;
        ASSERT_EQ(rb_get_simplification_size(made, &cornerCount, &faceCount), RB_ERROR_NONE);
        ASSERT_EQ(faceCount, tolerance < 0.05f ? 2u : 1u);
        ASSERT_EQ(cornerCount, 3 * faceCount);
        std::vector<int32_t> from(cornerCount), edges(cornerCount), starts(faceCount + 1),
            faces(faceCount);
        float change = 77;
        expectInvalid(rb_get_simplification(made, from.data(), edges.data(), cornerCount,
                                            starts.data(), faces.data(), faceCount, &change, 2),
                      "value_count");
        ASSERT_EQ(rb_get_simplification(made, from.data(), edges.data(), cornerCount, starts.data(),
                                        faces.data(), faceCount, &change, 1),
                  RB_ERROR_NONE);
        // The vertex in the middle changes by 0.05, and the three others by nothing.
        EXPECT_NEAR(change, faceCount == 2 ? 0 : 0.025, 1e-6);
        for (int32_t corner : from) EXPECT_TRUE(faceCount == 2 || corners[corner] != 1);
        EXPECT_EQ(starts.back(), int32_t(cornerCount));
        rb_release_simplification(made);
    }
}

}  // namespace
}  // namespace raybundle
