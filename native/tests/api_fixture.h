// SPDX-License-Identifier: GPL-3.0-or-later
//
// A scene and a bake behind the C interface, for the tests of the interface.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cube_arrays.h"
#include "raybundle/raybundle.h"

namespace raybundle::test {

inline constexpr float kIdentity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
inline constexpr float kOne[3] = {1, 1, 1};

inline std::string message() { return rb_get_error_message(); }

inline void setAll(float (&rgb)[3], float value) { std::fill_n(rgb, 3, value); }

// Returns a grey surface with the given reflectance and emission, W/m^2.
inline rb_surface surface(float reflectance = 0.5f, float emission = 0) {
    rb_surface made;
    EXPECT_EQ(rb_init_surface(&made, sizeof made), RB_ERROR_NONE) << message();
    setAll(made.reflectance.constant, reflectance);
    setAll(made.emission.constant, emission);
    return made;
}

// Checks the error code, and that the message contains `named`.
inline void expectFailure(rb_error found, rb_error wanted, const std::string& named) {
    EXPECT_EQ(found, wanted) << named;
    EXPECT_NE(message().find(named), std::string::npos)
        << "\"" << message() << "\" does not name " << named;
}

inline void expectInvalid(rb_error found, const std::string& named) {
    expectFailure(found, RB_ERROR_INVALID_ARGUMENT, named);
}

// A test with a scene and a bake of coarse patches, which are released at the end. addFurnace()
// adds a furnace whose exact exitance is 2 W/m^2.
class Api : public ::testing::Test {
  protected:
    void SetUp() override {
        ASSERT_EQ(rb_new_scene(&scene), RB_ERROR_NONE);
        ASSERT_EQ(rb_new_bake(&bake), RB_ERROR_NONE);
        ASSERT_EQ(rb_set_bake_float(bake, "patch_size", 0.2f), RB_ERROR_NONE);
    }
    void TearDown() override {
        rb_release_bake(bake);
        rb_release_scene(scene);
    }
    int32_t addMaterial(const rb_surface& front = surface(0.5f, 1),
                        const rb_surface& back = surface()) {
        int32_t id = -1;
        EXPECT_EQ(rb_add_material(scene, "glow", &front, &back, 1, RB_NO_IMAGE, &id), RB_ERROR_NONE)
            << message();
        return id;
    }
    int32_t addCube(int32_t material) {
        const std::vector<int32_t> materials(6, material);
        int32_t id = -1;
        EXPECT_EQ(rb_add_mesh(scene, "cube", kVertices, 8, kCorners, 24, kFaces, 6,
                              materials.data(), &id),
                  RB_ERROR_NONE)
            << message();
        return id;
    }
    int32_t addInstance(int32_t mesh, rb_role role = RB_ROLE_BAKE) {
        int32_t id = -1;
        EXPECT_EQ(rb_add_instance(scene, mesh, "box", kIdentity, role, RB_SIDE_FRONT, &id),
                  RB_ERROR_NONE)
            << message();
        return id;
    }
    int32_t addFurnace() { return addInstance(addCube(addMaterial())); }
    std::vector<float> cornerLight(int32_t instance) {
        std::vector<float> rgb(72, -1);
        EXPECT_EQ(rb_get_corner_light(bake, instance, RB_OUTPUT_COMBINED, rgb.data(), 24),
                  RB_ERROR_NONE)
            << message();
        return rgb;
    }
    void expectFurnace(int32_t instance) {
        for (float v : cornerLight(instance)) EXPECT_NEAR(v * 3.14159265f, 2, 1e-3);
    }
    nlohmann::json report() {
        const char* json = nullptr;
        EXPECT_EQ(rb_get_report(bake, &json), RB_ERROR_NONE);
        return nlohmann::json::parse(json ? json : "{}");
    }

    rb_scene scene = nullptr;
    rb_bake bake = nullptr;
};

}  // namespace raybundle::test
