// SPDX-License-Identifier: GPL-3.0-or-later
//
// Input that the C interface rejects, with the error code and a message that names the argument or
// the object.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "api_fixture.h"

namespace raybundle {
namespace {

using namespace test;

TEST(ApiNull, HandlesAreRefusedEverywhere) {
    int32_t id = 77, values[4] = {};
    float number = 77, rgb[3] = {};
    size_t count = 0;
    const char* text = nullptr;
    rb_subdivision subdivision = nullptr;
    const float matrix[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const rb_surface grey = surface();
    expectInvalid(rb_new_scene(nullptr), "scene");
    expectInvalid(rb_new_bake(nullptr), "bake");
    expectInvalid(rb_add_image(nullptr, "", 1, 1, kOne, RB_IMAGE_REPEAT, &id), "scene");
    expectInvalid(rb_init_surface(nullptr, sizeof grey), "surface");
    expectInvalid(rb_add_material(nullptr, "", &grey, &grey, 1, RB_NO_IMAGE, &id), "scene");
    expectInvalid(rb_add_mesh(nullptr, "", kVertices, 8, kCorners, 24, kFaces, 6, nullptr, &id),
                  "scene");
    expectInvalid(rb_set_mesh_corner_normals(nullptr, 0, kVertices, 8), "scene");
    expectInvalid(rb_set_mesh_uvs(nullptr, 0, kVertices, 8), "scene");
    expectInvalid(rb_set_mesh_corner_colors(nullptr, 0, kVertices, 8), "scene");
    expectInvalid(rb_add_instance(nullptr, 0, "", kIdentity, RB_ROLE_BAKE, RB_SIDE_FRONT, &id),
                  "scene");
    expectInvalid(rb_add_point_light(nullptr, "", kOne, kOne, 0, RB_POINT_DISK, &id), "scene");
    expectInvalid(rb_set_light_cone(nullptr, 0, matrix, 1, 0, false), "scene");
    expectInvalid(rb_set_light_spread(nullptr, 0, 1), "scene");
    expectInvalid(rb_set_light_shadows(nullptr, 0, false), "scene");
    expectInvalid(rb_remove_lights(nullptr), "scene");
    expectInvalid(rb_set_instance_visibility(nullptr, 0, true, true), "scene");
    expectInvalid(rb_set_instance_quality(nullptr, 0, 1, 1), "scene");
    expectInvalid(rb_set_result_corners(nullptr, 0, nullptr, 0), "scene");
    expectInvalid(rb_add_sun_light(nullptr, "", kOne, kOne, 0, &id), "scene");
    expectInvalid(rb_add_area_light(nullptr, "", kOne, kOne, kOne, kOne, RB_AREA_ELLIPSE, &id),
                  "scene");
    expectInvalid(rb_set_world(nullptr, kOne), "scene");
    expectInvalid(rb_set_bake_int(nullptr, "seed", 1), "bake");
    expectInvalid(rb_set_bake_float(nullptr, "patch_size", 1), "bake");
    expectInvalid(rb_set_bake_string(nullptr, "solver", "LINE_REUSE"), "bake");
    expectInvalid(rb_get_bake_int(nullptr, "seed", &id), "bake");
    expectInvalid(rb_get_bake_float(nullptr, "patch_size", &number), "bake");
    expectInvalid(rb_get_bake_string(nullptr, "solver", &text), "bake");
    expectInvalid(rb_set_bake_progress(nullptr, nullptr, nullptr), "bake");
    expectInvalid(rb_execute_bake(nullptr, nullptr), "bake");
    expectInvalid(rb_get_corner_light(nullptr, 0, RB_OUTPUT_COMBINED, rgb, 1), "bake");
    expectInvalid(rb_get_vertex_light(nullptr, 0, RB_OUTPUT_COMBINED, rgb, 1), "bake");
    expectInvalid(rb_get_corner_error(nullptr, 0, rgb, 1), "bake");
    expectInvalid(rb_get_report(nullptr, &text), "bake");
    expectInvalid(rb_new_subdivision(kVertices, 8, kCorners, 24, kFaces, 6, 1, nullptr),
                  "subdivision");
    expectInvalid(rb_get_subdivision_size(nullptr, &count, &count), "subdivision");
    expectInvalid(rb_get_subdivision(nullptr, rgb, 1, values, values, values, rgb, 1),
                  "subdivision");
    expectInvalid(rb_new_simplification(kVertices, 8, kCorners, 24, kFaces, 6, nullptr, nullptr,
                                        nullptr, nullptr, 0, 1, nullptr),
                  "simplification");
    expectInvalid(rb_get_simplification_size(nullptr, &count, &count), "simplification");
    expectInvalid(rb_get_simplification(nullptr, values, values, 1, values, values, 1, rgb, 1),
                  "simplification");
    EXPECT_EQ(id, 77) << "outputs are untouched on failure";
    EXPECT_EQ(number, 77);
    EXPECT_EQ(subdivision, nullptr);
    rb_release_scene(nullptr);
    rb_release_bake(nullptr);
    rb_release_subdivision(nullptr);
    rb_release_simplification(nullptr);
}

TEST_F(Api, NullArraysAndOutputsAreRefusedByName) {
    int32_t id = 77;
    const rb_surface grey = surface();
    expectInvalid(rb_add_image(scene, "", 1, 1, nullptr, RB_IMAGE_REPEAT, &id), "rgb");
    expectInvalid(rb_add_image(scene, "", 1, 1, kOne, RB_IMAGE_REPEAT, nullptr), "image");
    expectInvalid(rb_add_material(scene, "", nullptr, &grey, 1, RB_NO_IMAGE, &id), "front");
    expectInvalid(rb_add_material(scene, "", &grey, &grey, 1, RB_NO_IMAGE, nullptr), "material");
    expectInvalid(rb_add_mesh(scene, "", nullptr, 8, kCorners, 24, kFaces, 6, nullptr, &id),
                  "vertices");
    expectInvalid(rb_add_mesh(scene, "", kVertices, 8, nullptr, 24, kFaces, 6, nullptr, &id),
                  "corner_vertices");
    expectInvalid(rb_add_mesh(scene, "", kVertices, 8, kCorners, 24, nullptr, 6, nullptr, &id),
                  "face_offsets");
    expectInvalid(rb_add_mesh(scene, "", kVertices, 8, kCorners, 24, kFaces, 6, nullptr, nullptr),
                  "mesh");
    expectInvalid(rb_add_point_light(scene, "", nullptr, kOne, 0, RB_POINT_DISK, &id), "position");
    expectInvalid(rb_add_sun_light(scene, "", nullptr, kOne, 0, &id), "direction");
    expectInvalid(rb_add_area_light(scene, "", kOne, nullptr, kOne, kOne, RB_AREA_ELLIPSE, &id),
                  "axis_u");
    expectInvalid(rb_set_world(scene, nullptr), "radiance");
    expectInvalid(rb_set_world_image(scene, 1, 1, nullptr), "rgb");
    expectInvalid(rb_get_bake_int(bake, "seed", nullptr), "value");
    expectInvalid(rb_execute_bake(bake, nullptr), "scene");
    expectInvalid(rb_set_bake_int(bake, nullptr, 1), "setting");
    expectInvalid(rb_set_bake_string(bake, "solver", nullptr), "solver");
    EXPECT_EQ(id, 77);
    // A missing name counts as an empty one; without a back, both sides are as the front.
    EXPECT_EQ(rb_add_material(scene, nullptr, &grey, nullptr, 1, RB_NO_IMAGE, &id), RB_ERROR_NONE);
    EXPECT_EQ(id, 0);
}

TEST_F(Api, LightThatIsTooBrightIsRefusedByName) {
    const float bright[3] = {0, 2e15f, 0};
    const float x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, small[3] = {1e-4f, 0, 0};
    int32_t id = 77;
    const rb_surface glow = surface(0.5f, bright[1]);
    expectInvalid(rb_add_material(scene, "glow", &glow, nullptr, 1, RB_NO_IMAGE, &id), "glow");
    expectInvalid(rb_add_point_light(scene, "bulb", kOne, bright, 0, RB_POINT_DISK, &id), "bulb");
    expectInvalid(rb_add_sun_light(scene, "sun", kOne, bright, 0, &id), "sun");
    expectInvalid(rb_add_area_light(scene, "panel", kOne, x, y, bright, RB_AREA_RECTANGLE, &id),
                  "panel");
    expectInvalid(rb_set_world(scene, bright), "world");
    expectInvalid(rb_set_world_image(scene, 1, 1, bright), "world");
    EXPECT_EQ(id, 77);
    // The limit applies to radiance times area, so that a small panel may be brighter.
    EXPECT_EQ(rb_add_area_light(scene, "panel", kOne, small, y, bright, RB_AREA_RECTANGLE, &id),
              RB_ERROR_NONE);
}

TEST_F(Api, LightThatMultipliesToTooMuchIsAnErrorWithoutAResult) {
    const float pixel[3] = {1e25f, 1e25f, 1e25f};
    rb_surface sun = surface();
    setAll(sun.emission.image_weight, 1e25f);
    ASSERT_EQ(rb_add_image(scene, "sun", 1, 1, pixel, RB_IMAGE_REPEAT, &sun.emission.image),
              RB_ERROR_NONE);
    const int32_t mesh = addCube(addMaterial(sun));
    const std::vector<float> uvs(48, 0.5f);
    ASSERT_EQ(rb_set_mesh_uvs(scene, mesh, uvs.data(), 24), RB_ERROR_NONE);
    addInstance(mesh);
    expectInvalid(rb_execute_bake(bake, scene), "box");
    const char* report = nullptr;
    EXPECT_EQ(rb_get_report(bake, &report), RB_ERROR_INVALID_OPERATION);
}

TEST_F(Api, ALongMessageEndsWithAWholeCharacter) {
    std::string name;
    for (int i = 0; i < 5000; ++i) name += "\u00e4";  // two bytes
    for (const std::string shift : {"", "x"}) {
        expectInvalid(rb_set_bake_int(bake, (shift + name).c_str(), 1), shift + "\u00e4");
        EXPECT_GT(message().size(), 2045u);
        EXPECT_LT(message().size(), 2048u);
        EXPECT_EQ(message().substr(message().size() - 2), "\u00e4");
    }
}

TEST_F(Api, IdsThatWereNotGivenOutAreRefused) {
    const int32_t mesh = addCube(addMaterial());
    int32_t id = 77;
    const float matrix[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (int32_t bad : {-1, 1, 1000, std::numeric_limits<int32_t>::min()}) {
        expectInvalid(rb_set_mesh_uvs(scene, bad, kVertices, 24), "mesh " + std::to_string(bad));
        expectInvalid(rb_set_light_cone(scene, bad, matrix, 1, 0, false),
                      "light " + std::to_string(bad));
        expectInvalid(rb_add_instance(scene, bad, "", kIdentity, RB_ROLE_BAKE, RB_SIDE_FRONT, &id),
                      "mesh " + std::to_string(bad));
    }
    const std::vector<int32_t> materials(6, 5);
    expectInvalid(
        rb_add_mesh(scene, "", kVertices, 8, kCorners, 24, kFaces, 6, materials.data(), &id),
        "material 5");
    expectInvalid(rb_add_instance(scene, mesh, "", kIdentity, rb_role(5), RB_SIDE_FRONT, &id),
                  "role 5");
    expectInvalid(rb_add_instance(scene, mesh, "", kIdentity, RB_ROLE_BAKE, rb_side(5), &id),
                  "side 5");
    expectInvalid(rb_add_image(scene, "", 1, 1, kOne, rb_image_extension(5), &id), "extension 5");
    expectInvalid(rb_add_point_light(scene, "", kOne, kOne, 0, rb_point_shape(5), &id), "shape 5");
    expectInvalid(rb_add_area_light(scene, "", kOne, kOne, kOne, kOne, rb_area_shape(5), &id),
                  "shape 5");
    EXPECT_EQ(id, 77);
}

TEST_F(Api, MeshesThatDoNotAddUpAreRefusedByName) {
    int32_t id = 77;
    auto add = [&](const std::vector<int32_t>& corners, const std::vector<int32_t>& offsets) {
        return rb_add_mesh(scene, "knot", kVertices, 8, corners.data(), corners.size(),
                           offsets.data(), offsets.size() - 1, nullptr, &id);
    };
    expectInvalid(add({0, 1, 8}, {0, 3}), "knot");
    expectInvalid(add({0, 1, -1}, {0, 3}), "knot");
    expectInvalid(add({0, 1}, {0, 2}), "knot");
    expectInvalid(add({0, 1, 2}, {0, 4}), "knot");
    expectInvalid(add({0, 1, 2}, {1, 3}), "knot");
    expectInvalid(add({0, 1, 2, 3, 4, 5}, {0, 5, 3, 6}), "knot");
    expectInvalid(rb_add_mesh(scene, "knot", kVertices, 8, kCorners, 24, nullptr, 0, nullptr, &id),
                  "knot");
    std::array<float, 24> broken;
    std::copy(std::begin(kVertices), std::end(kVertices), broken.begin());
    broken[7] = NAN;
    expectInvalid(
        rb_add_mesh(scene, "knot", broken.data(), 8, kCorners, 24, kFaces, 6, nullptr, &id),
        "knot");
    broken[7] = INFINITY;
    expectInvalid(
        rb_add_mesh(scene, "knot", broken.data(), 8, kCorners, 24, kFaces, 6, nullptr, &id),
        "knot");
    EXPECT_EQ(id, 77);
    EXPECT_EQ(rb_add_mesh(scene, "empty", nullptr, 0, nullptr, 0, nullptr, 0, nullptr, &id),
              RB_ERROR_NONE)
        << "an empty mesh is one";
    addInstance(id);
    EXPECT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
}

TEST_F(Api, WrongCountsAreRefused) {
    const int32_t mesh = addCube(addMaterial()), instance = addInstance(mesh);
    const std::vector<float> values(100, 0.5f);
    for (size_t wrong : {size_t(0), size_t(23), size_t(25)}) {
        expectInvalid(rb_set_mesh_corner_normals(scene, mesh, values.data(), wrong), "24");
        expectInvalid(rb_set_mesh_uvs(scene, mesh, values.data(), wrong), "24");
        expectInvalid(rb_set_mesh_corner_colors(scene, mesh, values.data(), wrong), "24");
    }
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    std::vector<float> rgb(75, -1);
    expectInvalid(rb_get_corner_light(bake, instance, RB_OUTPUT_COMBINED, rgb.data(), 23), "24");
    expectInvalid(rb_get_corner_light(bake, instance, RB_OUTPUT_COMBINED, nullptr, 24), "rgb");
    expectInvalid(rb_get_vertex_light(bake, instance, RB_OUTPUT_COMBINED, rgb.data(), 24), "8");
    expectInvalid(rb_get_corner_error(bake, instance, rgb.data(), 23), "24");
    expectInvalid(rb_get_corner_light(bake, 1, RB_OUTPUT_COMBINED, rgb.data(), 24), "instance 1");
    expectInvalid(rb_get_corner_light(bake, instance, rb_output(9), rgb.data(), 24), "output 9");
    for (float v : rgb) EXPECT_EQ(v, -1) << "outputs are untouched on failure";
    EXPECT_EQ(rb_get_vertex_light(bake, instance, RB_OUTPUT_COMBINED, rgb.data(), 8),
              RB_ERROR_NONE);
    EXPECT_NEAR(rgb[23] * 3.14159265f, 2, 1e-3);
    EXPECT_EQ(rgb[24], -1);
}

TEST_F(Api, NumbersThatMakeNoSenseAreRefusedByName) {
    int32_t id = 77;
    const float negative[3] = {0, 0, -1};
    const float infinite[3] = {0, INFINITY, 0}, zero[3] = {0, 0, 0};
    expectInvalid(rb_add_point_light(scene, "bulb", infinite, kOne, 0, RB_POINT_DISK, &id), "bulb");
    expectInvalid(rb_add_point_light(scene, "bulb", kOne, negative, 0, RB_POINT_DISK, &id), "bulb");
    expectInvalid(rb_add_point_light(scene, "bulb", kOne, kOne, -1, RB_POINT_DISK, &id), "bulb");
    expectInvalid(rb_add_point_light(scene, "bulb", kOne, kOne, NAN, RB_POINT_DISK, &id), "bulb");
    expectInvalid(rb_add_sun_light(scene, "sol", zero, kOne, 0, &id), "sol");
    expectInvalid(rb_add_sun_light(scene, "sol", kOne, kOne, -0.1f, &id), "sol");
    expectInvalid(
        rb_add_area_light(scene, "panel", kOne, infinite, kOne, kOne, RB_AREA_RECTANGLE, &id),
        "panel");
    expectInvalid(rb_set_world(scene, infinite), "world");
    expectInvalid(rb_set_world_image(scene, 1, 1, infinite), "world");
    expectInvalid(rb_set_world_image(scene, 0, 1, kOne), "world");
    float transform[12];
    std::copy(std::begin(kIdentity), std::end(kIdentity), transform);
    transform[5] = NAN;
    const int32_t mesh = addCube(addMaterial());
    expectInvalid(
        rb_add_instance(scene, mesh, "chair", transform, RB_ROLE_BAKE, RB_SIDE_FRONT, &id),
        "chair");
    expectInvalid(rb_add_image(scene, "photo", 0, 5, kOne, RB_IMAGE_REPEAT, &id), "photo");
    expectInvalid(rb_add_image(scene, "photo", 5, -1, kOne, RB_IMAGE_REPEAT, &id), "photo");
    EXPECT_EQ(id, 77);
    int32_t light = -1;
    ASSERT_EQ(rb_add_point_light(scene, "spot", kOne, kOne, 0, RB_POINT_DISK, &light),
              RB_ERROR_NONE);
    const float matrix[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (float angle : {-1.0f, NAN, INFINITY})
        expectInvalid(rb_set_light_cone(scene, light, matrix, angle, 0, false), "spot");
    for (float blend : {-0.1f, 1.1f, NAN})
        expectInvalid(rb_set_light_cone(scene, light, matrix, 1, blend, false), "spot");
    int32_t sun = -1;
    ASSERT_EQ(rb_add_sun_light(scene, "sol", kOne, kOne, 0, &sun), RB_ERROR_NONE);
    expectInvalid(rb_set_light_cone(scene, sun, matrix, 1, 0, false), "sol");
    expectInvalid(rb_set_light_spread(scene, sun, 1), "sol");
    expectInvalid(rb_set_light_shadows(scene, 99, false), "99");
    expectInvalid(rb_set_instance_visibility(scene, 99, true, true), "99");
    expectInvalid(rb_set_instance_quality(scene, 99, 1, 1), "99");
    const int32_t noCorners[] = {0, 77777};
    expectInvalid(rb_set_result_corners(scene, 99, noCorners, 1), "99");
    const int32_t box = addInstance(mesh);
    expectInvalid(rb_set_instance_quality(scene, box, 0.001f, 1), "0.01 to 100");
    expectInvalid(rb_set_instance_quality(scene, box, 1, NAN), "0.01 to 100");
    expectInvalid(rb_set_result_corners(scene, box, nullptr, 1), "corners");
    expectInvalid(rb_set_result_corners(scene, box, noCorners, 2), "77777");
    int32_t screen = -1;
    ASSERT_EQ(
        rb_add_instance(scene, mesh, "screen", kIdentity, RB_ROLE_OCCLUDE, RB_SIDE_FRONT, &screen),
        RB_ERROR_NONE);
    expectInvalid(rb_set_result_corners(scene, screen, noCorners, 1), "screen");
}

// Adds the material "fog" with a wrong side or a wrong opacity.
class ApiMaterial : public Api {
  protected:
    rb_error add(const rb_surface& side, rb_side wrong = RB_SIDE_FRONT, float opacity = 1,
                 int32_t opacityImage = RB_NO_IMAGE) {
        const rb_surface right = surface();
        const rb_surface* sides[] = {&right, &right};
        sides[wrong] = &side;
        return rb_add_material(scene, "fog", sides[0], sides[1], opacity, opacityImage, &id);
    }
    void TearDown() override {
        EXPECT_EQ(id, 77) << "outputs are untouched on failure";
        Api::TearDown();
    }

    int32_t id = 77;
};

TEST_F(ApiMaterial, SurfacesOfAnotherSizeAreRefusedByName) {
    rb_surface made = surface();
    EXPECT_EQ(made.size, sizeof made);
    const size_t sizes[] = {0, sizeof(size_t), sizeof made + 1, std::numeric_limits<size_t>::max()};
    for (const size_t size : sizes) {
        const std::string named = "has a size of " + std::to_string(size) + " bytes";
        expectInvalid(rb_init_surface(&made, size), "surface " + named);
        EXPECT_EQ(made.size, sizeof made);
        rb_surface wrong = surface();
        wrong.size = size;
        expectInvalid(add(wrong, RB_SIDE_FRONT), "material \"fog\": its front " + named);
        expectInvalid(add(wrong, RB_SIDE_BACK), "material \"fog\": its back " + named);
    }
}

// NAN is no valid value of any member: neither as a number nor, by its bits, as an image or an enum
// value.
TEST_F(ApiMaterial, EveryMemberOfASurfaceIsCheckedByName) {
    const float bad = NAN;
    constexpr size_t kEnd = offsetof(rb_surface, diffuse) + sizeof(rb_diffuse);
    for (const rb_side side : {RB_SIDE_FRONT, RB_SIDE_BACK})
        for (size_t at = sizeof(size_t); at < kEnd; at += sizeof bad) {
            rb_surface wrong = surface();
            std::memcpy(reinterpret_cast<char*>(&wrong) + at, &bad, sizeof bad);
            SCOPED_TRACE(at);
            expectInvalid(add(wrong, side), "fog");
        }
}

TEST_F(ApiMaterial, TheMemberThatIsWrongIsNamed) {
    auto expect = [&](const auto& spoil, const std::string& named) {
        rb_surface made = surface();
        spoil(made);
        expectInvalid(add(made, RB_SIDE_BACK), "material \"fog\": " + named);
    };
    const std::string ofLight = "reflectance and emission must be finite and not negative";
    expect([](rb_surface& s) { s.reflectance.constant[2] = -1; }, ofLight);
    expect([](rb_surface& s) { s.emission.constant[0] = -1e-3f; }, ofLight);
    expect([](rb_surface& s) { s.emission.corner_color_weight[1] = INFINITY; },
           "back emission.corner_color_weight 1 is not a finite number");
    expect([](rb_surface& s) { s.shown.by_angle.cosine_fifth[2] = NAN; },
           "back shown.by_angle.cosine_fifth 2 is not a finite number");
    for (const float rough : {-0.1f, 1.1f, NAN, INFINITY}) {
        expect([&](rb_surface& s) { s.gloss.roughness = rough; },
               "back gloss.roughness must be 0 to 1");
        expect([&](rb_surface& s) { s.velvet.roughness = rough; },
               "back velvet.roughness must be 0 to 1");
        expect([&](rb_surface& s) { s.diffuse.roughness = rough; },
               "back diffuse.roughness must be 0 to 1");
    }
    expect([](rb_surface& s) { s.gloss.masking = rb_masking(2); }, "unknown masking 2");
    expect([](rb_surface& s) { s.diffuse.model = rb_diffuse_model(3); }, "unknown diffuse model 3");
    for (const int32_t image : {-2, 0, 1000, std::numeric_limits<int32_t>::min()}) {
        const std::string noImage = "there is no image " + std::to_string(image);
        expect([&](rb_surface& s) { s.reflectance.image = image; }, noImage);
        expect([&](rb_surface& s) { s.translucence.image = image; }, noImage);
        expectInvalid(add(surface(), RB_SIDE_FRONT, 1, image), "material \"fog\": " + noImage);
    }
    for (const float opacity : {-0.1f, 1.1f, NAN})
        expectInvalid(add(surface(), RB_SIDE_FRONT, opacity),
                      "material \"fog\": opacity must be 0 to 1");
}

TEST_F(Api, UnknownSettingsAndOtherTypesAreRefused) {
    int32_t number = 77;
    expectInvalid(rb_set_bake_int(bake, "colour", 1), "colour");
    expectInvalid(rb_set_bake_int(bake, "target_error", 1), "target_error");
    expectInvalid(rb_set_bake_float(bake, "seed", 1), "seed");
    expectInvalid(rb_set_bake_float(bake, "solver", 1), "solver");
    expectInvalid(rb_set_bake_string(bake, "seed", "1"), "seed");
    expectInvalid(rb_set_bake_string(bake, "solver", "MAGIC"), "MAGIC");
    expectInvalid(rb_set_bake_string(bake, "directions", "random"), "LOW_DISCREPANCY");
    expectInvalid(rb_get_bake_int(bake, "", &number), "setting");
    EXPECT_EQ(number, 77);
}

TEST_F(Api, SettingsOutOfRangeAreRefusedAndNotKept) {
    for (const char* name :
         {"max_patches", "min_bundles", "max_bundles", "lines_per_bundle", "seed", "threads"}) {
        int32_t before = 0, after = -1;
        EXPECT_EQ(rb_get_bake_int(bake, name, &before), RB_ERROR_NONE);
        expectInvalid(rb_set_bake_int(bake, name, -1), name);
        expectInvalid(rb_set_bake_int(bake, name, std::numeric_limits<int32_t>::min()), name);
        EXPECT_EQ(rb_get_bake_int(bake, name, &after), RB_ERROR_NONE);
        EXPECT_EQ(after, before);
    }
    for (const char* name : {"target_error", "patch_size", "memory_limit", "regularization"})
        for (float bad : {-1.0f, NAN, INFINITY})
            expectInvalid(rb_set_bake_float(bake, name, bad), name);
    expectInvalid(rb_set_bake_float(bake, "target_error", 0), "target_error");
    EXPECT_EQ(rb_set_bake_int(bake, "max_bundles", 2), RB_ERROR_NONE);
}

TEST_F(Api, ObjectsTooFarAwayAreRefusedByName) {
    addFurnace();
    const float far[12] = {1, 0, 0, 2e12f, 0, 1, 0, 0, 0, 0, 1, 0};
    int32_t id = -1;
    ASSERT_EQ(rb_add_instance(scene, 0, "comet", far, RB_ROLE_BAKE, RB_SIDE_FRONT, &id),
              RB_ERROR_NONE);
    expectInvalid(rb_execute_bake(bake, scene), "comet");
}

TEST_F(Api, LightsTooFarAwayAreRefusedByName) {
    const float far[3] = {0, 2e12f, 0}, x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
    int32_t id = 77;
    for (rb_error error : {rb_add_point_light(scene, "it", far, kOne, 0, RB_POINT_DISK, &id),
                           rb_add_point_light(scene, "it", x, kOne, 2e12f, RB_POINT_SPHERE, &id),
                           rb_add_area_light(scene, "it", far, x, y, kOne, RB_AREA_ELLIPSE, &id),
                           rb_add_area_light(scene, "it", x, y, far, kOne, RB_AREA_ELLIPSE, &id)})
        expectInvalid(error, "light \"it\" reaches further than 1e12 m");
    EXPECT_EQ(id, 77);
}

TEST(ApiSubdivision, RefusesWhatCannotBeCut) {
    rb_subdivision subdivision = nullptr;
    for (float edge : {0.0f, -1.0f, NAN})
        expectInvalid(rb_new_subdivision(kVertices, 8, kCorners, 24, kFaces, 6, edge, &subdivision),
                      "max_edge");
    const int32_t bad[3] = {0, 1, 99}, offsets[2] = {0, 3};
    expectInvalid(rb_new_subdivision(kVertices, 8, bad, 3, offsets, 1, 1, &subdivision),
                  "vertex 99");
    EXPECT_EQ(subdivision, nullptr);
    ASSERT_EQ(rb_new_subdivision(nullptr, 0, nullptr, 0, nullptr, 0, 1, &subdivision),
              RB_ERROR_NONE);
    size_t vertices = 7, triangles = 7;
    EXPECT_EQ(rb_get_subdivision_size(subdivision, &vertices, &triangles), RB_ERROR_NONE);
    EXPECT_EQ(vertices + triangles, 0u);
    rb_release_subdivision(subdivision);
}

TEST(ApiSimplification, RefusesWhatDoesNotFit) {
    rb_simplification made = nullptr;
    std::vector<float> values(24), tolerances = {1};
    const auto simplified = [&](float distance) {
        return rb_new_simplification(kVertices, 8, kCorners, 24, kFaces, 6, nullptr, nullptr,
                                     values.data(), tolerances.data(), 1, distance, &made);
    };
    for (float distance : {0.0f, -1.0f, NAN}) expectInvalid(simplified(distance), "distance");
    values[3] = NAN;
    expectInvalid(simplified(1), "values must be finite");
    values[3] = 0;
    tolerances[0] = 0;
    expectInvalid(simplified(1), "tolerances must be positive");
    expectInvalid(rb_new_simplification(kVertices, 8, kCorners, 24, kFaces, 6, nullptr, nullptr,
                                        nullptr, tolerances.data(), 1, 1, &made),
                  "values");
    EXPECT_EQ(made, nullptr);
    ASSERT_EQ(rb_new_simplification(nullptr, 0, nullptr, 0, nullptr, 0, nullptr, nullptr, nullptr,
                                    nullptr, 0, 1, &made),
              RB_ERROR_NONE);
    size_t corners = 7, faces = 7;
    EXPECT_EQ(rb_get_simplification_size(made, &corners, &faces), RB_ERROR_NONE);
    EXPECT_EQ(corners + faces, 0u);
    rb_release_simplification(made);
}

}  // namespace
}  // namespace raybundle
