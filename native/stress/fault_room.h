// SPDX-License-Identifier: GPL-3.0-or-later
//
// A small bake for programs in which memory or threads run out.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "cube_arrays.h"
#include "raybundle/raybundle.h"

namespace raybundle::test {

// Makes a closed room with a box and a lamp. `brightness` is the intensity of the lamp, W/sr. The
// caller releases the scene.
inline rb_scene roomOf(float brightness) {
    static const float kRoom[12] = {4, 0, 0, 0, 0, 4, 0, 0, 0, 0, 3, 0};
    static const float kBox[12] = {-1, 0, 0, 2, 0, 1, 0, 1, 0, 0, 1, 0};
    const float intensity[3] = {brightness, brightness, brightness};
    const float position[3] = {1, 3, 2.5f};
    rb_scene scene = nullptr;
    int32_t id = -1, mesh = -1;
    rb_new_scene(&scene);
    rb_surface grey;
    rb_init_surface(&grey, sizeof grey);
    std::fill_n(grey.reflectance.constant, 3, 0.5f);
    rb_add_material(scene, "grey", &grey, nullptr, 1, RB_NO_IMAGE, &id);
    const std::vector<int32_t> materials(6, id);
    rb_add_mesh(scene, "cube", kVertices, 8, kCorners, 24, kFaces, 6, materials.data(), &mesh);
    rb_add_instance(scene, mesh, "room", kRoom, RB_ROLE_BAKE, RB_SIDE_FRONT, &id);
    rb_add_instance(scene, mesh, "box", kBox, RB_ROLE_BAKE, RB_SIDE_BACK, &id);
    rb_add_point_light(scene, "bulb", position, intensity, 0.1f, RB_POINT_DISK, &id);
    return scene;
}

// Returns the light at all corners of both objects, RGB.
inline std::vector<float> lightOf(rb_bake bake) {
    std::vector<float> light(2 * 72);
    for (int32_t i = 0; i < 2; ++i)
        rb_get_corner_light(bake, i, RB_OUTPUT_COMBINED, light.data() + 72 * i, 24);
    return light;
}

// Makes a bake with 8 bundles and the given reconstruction. The caller releases the bake.
inline rb_bake newBake(const char* reconstruction) {
    rb_bake bake = nullptr;
    rb_new_bake(&bake);
    rb_set_bake_float(bake, "patch_size", 0.5f);
    rb_set_bake_int(bake, "min_bundles", 8);
    rb_set_bake_int(bake, "max_bundles", 8);
    rb_set_bake_int(bake, "threads", 2);
    rb_set_bake_string(bake, "reconstruction", reconstruction);
    return bake;
}

// Returns whether two results are equal within the tolerance of the solver.
inline bool isLike(const std::vector<float>& light, const std::vector<float>& wanted) {
    return std::equal(light.begin(), light.end(), wanted.begin(), wanted.end(),
                      [](float a, float b) { return std::abs(a - b) <= 1e-4f * (1 + b); });
}

}  // namespace raybundle::test
