// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light sets through the C interface.
#include <gtest/gtest.h>

#include <vector>

#include "api_fixture.h"

namespace raybundle {
namespace {

using namespace test;

class ApiLightSets : public Api {
  protected:
    int32_t addSet(const char* name) {
        int32_t set = -1;
        EXPECT_EQ(rb_add_light_set(scene, name, &set), RB_ERROR_NONE) << message();
        return set;
    }
    std::vector<float> setLight(int32_t set, int32_t instance) {
        std::vector<float> rgb(72, -1);
        EXPECT_EQ(rb_get_set_corner_light(bake, set, instance, RB_OUTPUT_COMBINED, rgb.data(), 24),
                  RB_ERROR_NONE)
            << message();
        return rgb;
    }
};

TEST_F(ApiLightSets, GiveTheirPartOfTheLight) {
    const float centre[3] = {0.5f, 0.5f, 0.5f}, red[3] = {1, 0, 0};
    const int32_t box = addFurnace(), glow = addSet("glow"), lamps = addSet("lamps");
    int32_t lamp = -1;
    ASSERT_EQ(rb_add_point_light(scene, "lamp", centre, red, 0, RB_POINT_DISK, &lamp),
              RB_ERROR_NONE);
    ASSERT_EQ(rb_set_instance_light_set(scene, box, glow), RB_ERROR_NONE);
    ASSERT_EQ(rb_set_light_set(scene, lamp, lamps), RB_ERROR_NONE);
    ASSERT_EQ(rb_set_world_light_set(scene, lamps), RB_ERROR_NONE);
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    const std::vector<float> all = cornerLight(box), furnace = setLight(glow, box),
                             lit = setLight(lamps, box);
    for (size_t k = 0; k < all.size(); ++k) {
        EXPECT_NEAR(furnace[k] * 3.14159265f, 2, 1e-3);
        EXPECT_EQ(lit[k] > 0, k % 3 == 0);
        EXPECT_NEAR(all[k], furnace[k] + lit[k], 1e-5f);
    }
    std::vector<float> vertices(24, -1);
    ASSERT_EQ(rb_get_set_vertex_light(bake, glow, box, RB_OUTPUT_COMBINED, vertices.data(), 8),
              RB_ERROR_NONE);
    for (float v : vertices) EXPECT_NEAR(v * 3.14159265f, 2, 1e-3);
    EXPECT_EQ(report()["light_sets"][1]["name"], "lamps");

    ASSERT_EQ(rb_set_light_set(scene, lamp, RB_NO_LIGHT_SET), RB_ERROR_NONE);
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE);
    for (float v : setLight(lamps, box)) EXPECT_EQ(v, 0);
}

TEST_F(ApiLightSets, StayWhenLampsAreAddedAnew) {
    const float centre[3] = {0.5f, 0.5f, 0.5f}, corner[3] = {0.2f, 0.2f, 0.2f}, red[3] = {1, 0, 0};
    const int32_t box = addFurnace(), lamps = addSet("lamps");
    int32_t lamp = -1;
    // Each bake begins anew.
    ASSERT_EQ(rb_set_bake_int(bake, "skip.geometry", 0), RB_ERROR_NONE);
    auto bakeWithLamp = [&](const float(&position)[3]) {
        EXPECT_EQ(rb_add_point_light(scene, "lamp", position, red, 0, RB_POINT_DISK, &lamp),
                  RB_ERROR_NONE);
        EXPECT_EQ(lamp, 0);
        EXPECT_EQ(rb_set_light_set(scene, lamp, lamps), RB_ERROR_NONE);
        EXPECT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
        return setLight(lamps, box);
    };
    const std::vector<float> before = bakeWithLamp(centre);
    ASSERT_EQ(rb_remove_lights(scene), RB_ERROR_NONE);
    expectInvalid(rb_set_light_set(scene, lamp, lamps), "light 0");
    const std::vector<float> moved = bakeWithLamp(corner);
    EXPECT_NE(moved, before);
    ASSERT_EQ(rb_remove_lights(scene), RB_ERROR_NONE);
    EXPECT_EQ(bakeWithLamp(centre), before);
    ASSERT_EQ(rb_remove_lights(scene), RB_ERROR_NONE);
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE) << message();
    for (float v : setLight(lamps, box)) EXPECT_EQ(v, 0);
}

TEST_F(ApiLightSets, NameWhatIsWrong) {
    const int32_t box = addFurnace(), set = addSet("glow");
    int32_t other = -1;
    float rgb[72];
    expectInvalid(rb_add_light_set(scene, "glow", &other), "light set \"glow\"");
    expectInvalid(rb_add_light_set(nullptr, "a", &other), "scene");
    expectInvalid(rb_add_light_set(scene, "a", nullptr), "set");
    expectInvalid(rb_set_light_set(scene, 0, set), "light 0");
    expectInvalid(rb_set_light_set(nullptr, 0, set), "scene");
    expectInvalid(rb_set_instance_light_set(scene, box, 1), "light set 1");
    expectInvalid(rb_set_instance_light_set(scene, 7, set), "instance 7");
    expectInvalid(rb_set_instance_light_set(nullptr, box, set), "scene");
    expectInvalid(rb_set_world_light_set(scene, -2), "light set -2");
    expectInvalid(rb_set_world_light_set(nullptr, set), "scene");
    expectFailure(rb_get_set_corner_light(bake, set, box, RB_OUTPUT_COMBINED, rgb, 24),
                  RB_ERROR_INVALID_OPERATION, "before a successful bake");
    ASSERT_EQ(rb_execute_bake(bake, scene), RB_ERROR_NONE);
    expectInvalid(rb_get_set_corner_light(bake, 1, box, RB_OUTPUT_COMBINED, rgb, 24),
                  "light set 1");
    expectInvalid(rb_get_set_corner_light(bake, set, 5, RB_OUTPUT_COMBINED, rgb, 24), "instance 5");
    expectInvalid(rb_get_set_corner_light(bake, set, box, RB_OUTPUT_COMBINED, rgb, 23), "count");
    expectInvalid(rb_get_set_vertex_light(bake, set, box, RB_OUTPUT_COMBINED, nullptr, 8), "rgb");
    expectInvalid(rb_get_set_vertex_light(nullptr, set, box, RB_OUTPUT_COMBINED, rgb, 8), "bake");
    rb_set_bake_string(bake, "solver", "MULTIPATH");
    rb_set_bake_string(bake, "directions", "RANDOM");
    expectInvalid(rb_execute_bake(bake, scene), "light sets");
}

}  // namespace
}  // namespace raybundle
