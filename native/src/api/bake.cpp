// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/bake.h"

#include "api/border.h"

using namespace raybundle;

namespace {

// Implements rb_get_bake_int() and rb_get_bake_float(), which differ only by their type.
template <class T>
rb_error getNumber(rb_bake bake, const char* name, T* value) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        need(value, "value");
        held->settings.get(nameOf(name), *value);
    });
}

}  // namespace

rb_error rb_new_bake(rb_bake* bake) {
    return guarded([&] {
        need(bake, "bake");
        *bake = Handles<rb_bake, Bake>::add(std::make_unique<Bake>());
    });
}

void rb_release_bake(rb_bake bake) { Handles<rb_bake, Bake>::release(bake); }

rb_error rb_set_bake_int(rb_bake bake, const char* name, int32_t value) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        held->settings.set(nameOf(name), int(value));
    });
}

rb_error rb_set_bake_float(rb_bake bake, const char* name, float value) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        held->settings.set(nameOf(name), value);
    });
}

rb_error rb_set_bake_string(rb_bake bake, const char* name, const char* value) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        held->settings.set(nameOf(name), nameOf(value));
    });
}

rb_error rb_get_bake_int(rb_bake bake, const char* name, int32_t* value) {
    return getNumber(bake, name, value);
}

rb_error rb_get_bake_float(rb_bake bake, const char* name, float* value) {
    return getNumber(bake, name, value);
}

rb_error rb_get_bake_string(rb_bake bake, const char* name, const char** value) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        need(value, "value");
        *value = held->settings.get(nameOf(name));
    });
}

rb_error rb_set_bake_progress(rb_bake bake, rb_progress_function function, void* user) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        held->progress = Progress(function, user);
    });
}

rb_error rb_execute_bake(rb_bake bake, rb_scene scene) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        const HeldScene heldScene(scene, "scene");
        held->run(*heldScene);
    });
}

rb_error rb_get_corner_light(rb_bake bake, int32_t instance, rb_output output, float* rgb,
                             size_t count) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        copyLight(held->instanceLight(instance).perCorner(output), rgb, count);
    });
}

rb_error rb_get_vertex_light(rb_bake bake, int32_t instance, rb_output output, float* rgb,
                             size_t count) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        copyLight(held->instanceLight(instance).perVertex(output), rgb, count);
    });
}

rb_error rb_get_set_corner_light(rb_bake bake, int32_t set, int32_t instance, rb_output output,
                                 float* rgb, size_t count) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        copyLight(held->setLight(set, instance).perCorner(output), rgb, count);
    });
}

rb_error rb_get_set_vertex_light(rb_bake bake, int32_t set, int32_t instance, rb_output output,
                                 float* rgb, size_t count) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        const CornerLight& light = held->setLight(set, instance);
        copyLight(held->instanceLight(instance).perVertex(light, output), rgb, count);
    });
}

rb_error rb_get_corner_error(rb_bake bake, int32_t instance, float* error, size_t count) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        const std::vector<float>& values = held->instanceLight(instance).error;
        needCount(count, values.size(), "count");
        copyArray(values, error, "error");
    });
}

rb_error rb_get_report(rb_bake bake, const char** json) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        need(json, "json");
        if (!held->hasRun())
            throw Error(RB_ERROR_INVALID_OPERATION, "there is no report before a successful bake");
        *json = held->reportJson().c_str();
    });
}
