/* SPDX-License-Identifier: GPL-3.0-or-later
 * The C interface on one page: a program that bakes a closed box whose walls all have the same
 * emission and the same reflectance, a so-called furnace. The exact exitance is B = E / (1 - rho)
 * everywhere, and the program compares its result with it. The tests also compile this file to
 * check that the header is valid C99. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "raybundle/raybundle.h"

static const double kPi = 3.14159265358979323846;

/* Prints the message of the library and exits if a call failed. */
static void check(rb_error error) {
    if (error != RB_ERROR_NONE) {
        fprintf(stderr, "error %d: %s\n", (int)error, rb_get_error_message());
        exit(EXIT_FAILURE);
    }
}

static bool showProgress(void* user, rb_stage stage, double fraction) {
    (void)user;
    if (fraction == 1) printf("stage %d done\n", (int)stage);
    return true; /* continue the bake */
}

int main(void) {
    /* A unit cube whose faces look inwards: the front sides are inside. */
    static const float vertices[8 * 3] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0,
                                          0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
    static const int32_t corners[24] = {0, 1, 2, 3, 4, 7, 6, 5, 0, 4, 5, 1,
                                        1, 5, 6, 2, 2, 6, 7, 3, 3, 7, 4, 0};
    static const int32_t faces[7] = {0, 4, 8, 12, 16, 20, 24};
    static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

    /* The walls have reflectance 0.5 on both sides and emit 1 W/m^2 on the inside. */
    rb_surface inside, outside;
    check(rb_init_surface(&outside, sizeof outside));
    for (int c = 0; c < 3; ++c) outside.reflectance.constant[c] = 0.5f;
    inside = outside;
    for (int c = 0; c < 3; ++c) inside.emission.constant[c] = 1;

    /* Describe the scene. */
    rb_scene scene;
    int32_t material, mesh, instance;
    int32_t materials[6];
    check(rb_new_scene(&scene));
    check(rb_add_material(scene, "furnace", &inside, &outside, 1, RB_NO_IMAGE, &material));
    for (int i = 0; i < 6; ++i) materials[i] = material;
    check(rb_add_mesh(scene, "box", vertices, 8, corners, 24, faces, 6, materials, &mesh));
    check(rb_add_instance(scene, mesh, "box", identity, RB_ROLE_BAKE, RB_SIDE_FRONT, &instance));

    /* Bake the scene. */
    rb_bake bake;
    check(rb_new_bake(&bake));
    check(rb_set_bake_float(bake, "target_error", 0.01f));
    check(rb_set_bake_progress(bake, showProgress, NULL));
    check(rb_execute_bake(bake, scene));

    /* Fetch the radiance that leaves each corner, and the report. */
    float radiance[24 * 3];
    const char* report;
    check(rb_get_corner_light(bake, instance, RB_OUTPUT_COMBINED, radiance, 24));
    check(rb_get_report(bake, &report));
    printf("%s\n", report);

    double worst = 0;
    for (int i = 0; i < 24 * 3; ++i) worst = fmax(worst, fabs(radiance[i] * kPi / 2 - 1));
    printf("exact exitance 2 W/m^2, largest relative error %.2e\n", worst);

    rb_release_bake(bake);
    rb_release_scene(scene);
    return worst < 1e-4 ? EXIT_SUCCESS : EXIT_FAILURE;
}
