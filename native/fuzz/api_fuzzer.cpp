// SPDX-License-Identifier: GPL-3.0-or-later
//
// Fuzz target that makes arbitrary calls of the C interface: the input bytes select calls with
// arbitrary numbers, ids, enum values, counts and settings, and a small bake. No call may crash,
// hang, leak or return a number that is not finite, and every failure must have a message. This is
// a target of libFuzzer; native/fuzz/replay.cpp runs saved inputs without libFuzzer.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "cube_arrays.h"
#include "raybundle/raybundle.h"

namespace {

using namespace raybundle::test;

// Reads the input from front to end. After the end every byte is 0, so that each prefix is a valid
// input.
class Bytes {
  public:
    Bytes(const uint8_t* data, size_t size) : at(data), end(data + size) {}

    bool isAtEnd() const { return at == end; }
    uint8_t byte() { return at < end ? *at++ : 0; }
    uint32_t below(uint32_t limit) { return limit ? byte() % limit : 0; }
    bool flag() { return byte() & 1; }
    int32_t integer() {
        int32_t value = 0;
        for (int k = 0; k < 4; ++k) value = int32_t(uint32_t(value) << 8 | byte());
        return value;
    }
    // Returns an id or an enum value: mostly small, sometimes any integer.
    int32_t small() {
        const uint8_t first = byte();
        return first < 240 ? first % 4 : first < 248 ? -1 : integer();
    }
    // Returns mostly a number in the range of rooms, sometimes any float: huge, tiny, negative,
    // infinite, NaN.
    float number() {
        const uint8_t first = byte();
        if (first < 200) return float(first) / 50 - 1;
        if (first < 210) return 0;
        float value;
        const int32_t bits = integer();
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }
    template <size_t N>
    std::array<float, N> numbers() {
        std::array<float, N> values;
        for (float& v : values) v = number();
        return values;
    }
    std::vector<float> numbers(size_t count) {
        std::vector<float> values(count);
        for (float& v : values) v = number();
        return values;
    }
    std::string text() {
        std::string value(below(12), ' ');
        for (char& c : value) c = char(byte());
        return value;
    }

  private:
    const uint8_t* at;
    const uint8_t* const end;
};

[[noreturn]] void die(const char* what) {
    std::fprintf(stderr, "%s: %s\n", what, rb_get_error_message());
    std::abort();
}

void expectMessage(rb_error error) {
    if (error != RB_ERROR_NONE && !*rb_get_error_message()) die("a refusal without a message");
    if (error == RB_ERROR_UNKNOWN) die("an error that is not known");
}

// Adds a mesh: a box near the other objects, or arbitrary arrays.
void addMesh(Bytes& in, rb_scene scene) {
    int32_t id = -1;
    const std::string name = in.text();
    if (in.flag()) {
        const size_t vertices = in.below(12), faces = in.below(8);
        const std::vector<float> positions = in.numbers(3 * vertices);
        std::vector<int32_t> corners, offsets{0}, materials;
        for (size_t f = 0; f < faces; ++f) {
            for (uint32_t k = in.below(6); k > 0; --k)
                corners.push_back(in.flag() ? in.small() : int32_t(in.below(12)));
            offsets.push_back(in.byte() < 250 ? int32_t(corners.size()) : in.integer());
            materials.push_back(in.small());
        }
        expectMessage(rb_add_mesh(scene, name.c_str(), positions.data(), vertices, corners.data(),
                                  corners.size(), offsets.data(), faces,
                                  in.flag() ? materials.data() : nullptr, &id));
        if (in.flag()) {
            const std::vector<float> values = in.numbers(3 * corners.size());
            expectMessage(rb_set_mesh_corner_normals(scene, id, values.data(), corners.size()));
            expectMessage(rb_set_mesh_uvs(scene, id, values.data(), corners.size()));
            expectMessage(rb_set_mesh_corner_colors(scene, id, values.data(), corners.size()));
        }
        return;
    }
    std::array<int32_t, 6> materials;
    for (int32_t& m : materials) m = in.small();
    expectMessage(rb_add_mesh(scene, name.c_str(), kVertices, 8, kCorners, 24, kFaces, 6,
                              in.flag() ? materials.data() : nullptr, &id));
}

void addLight(Bytes& in, rb_scene scene) {
    int32_t id = -1;
    const std::string name = in.text();
    const auto a = in.numbers<3>(), b = in.numbers<3>(), c = in.numbers<3>(), d = in.numbers<3>();
    switch (in.below(3)) {
        case 0:
            expectMessage(rb_add_point_light(scene, name.c_str(), a.data(), b.data(), in.number(),
                                             rb_point_shape(in.small()), &id));
            break;
        case 1:
            expectMessage(
                rb_add_sun_light(scene, name.c_str(), a.data(), b.data(), in.number(), &id));
            break;
        default:
            expectMessage(rb_add_area_light(scene, name.c_str(), a.data(), b.data(), c.data(),
                                            d.data(), rb_area_shape(in.small()), &id));
    }
    const int32_t target = in.flag() ? id : in.small();
    const auto matrix = in.numbers<9>();
    if (in.flag())
        expectMessage(
            rb_set_light_cone(scene, target, matrix.data(), in.number(), in.number(), in.flag()));
    if (in.flag()) expectMessage(rb_set_light_spread(scene, target, in.number()));
    if (in.flag()) expectMessage(rb_set_light_shadows(scene, target, in.flag()));
    if (in.flag()) expectMessage(rb_set_light_set(scene, target, in.small()));
}

void addImage(Bytes& in, rb_scene scene) {
    int32_t id = -1;
    const int32_t width = int32_t(in.below(5)), height = int32_t(in.below(5));
    const std::vector<float> pixels = in.numbers(3 * size_t(width) * size_t(height));
    if (in.flag())
        expectMessage(rb_add_image(scene, in.text().c_str(), width, height, pixels.data(),
                                   rb_image_extension(in.small()), &id));
    else
        expectMessage(rb_set_world_image(scene, width, height, pixels.data()));
}

template <size_t N>
void copy(const std::array<float, N>& from, size_t first, float (&to)[3]) {
    for (size_t c = 0; c < 3; ++c) to[c] = from[first + c];
}

rb_angle_factors angleFactors(Bytes& in) {
    const auto values = in.numbers<12>();
    rb_angle_factors factors;
    copy(values, 0, factors.linear);
    copy(values, 3, factors.square);
    copy(values, 6, factors.fifth);
    copy(values, 9, factors.cosine_fifth);
    return factors;
}

struct Opacity {
    float share = 1;
    int32_t image = RB_NO_IMAGE;
};

// Sets one member of a surface, several that belong together, or the opacity. `a` and `b` hold
// numbers to use.
void spoil(Bytes& in, rb_surface& surface, Opacity& opacity, const std::array<float, 6>& a,
           const std::array<float, 6>& b) {
    switch (in.below(11)) {
        case 0:
            surface.reflectance.image = in.small();
            copy(a, 0, surface.reflectance.image_weight);
            break;
        case 1:
            copy(b, 0, surface.reflectance.corner_color_weight);
            break;
        case 2:
            surface.emission.image = in.small();
            copy(a, 3, surface.emission.image_weight);
            break;
        case 3:
            copy(b, 3, surface.emission.corner_color_weight);
            break;
        case 4:
            copy(a, 0, surface.shown.color.scale);
            copy(b, 0, surface.shown.color.offset);
            break;
        case 5:
            opacity = {in.number(), in.small()};
            break;
        case 6:
            copy(a, 0, surface.translucence.constant);
            surface.translucence.image = in.small();
            copy(b, 0, surface.translucence.image_weight);
            copy(b, 3, surface.translucence.corner_color_weight);
            break;
        case 7:
            copy(a, 0, surface.gloss.part.scale);
            copy(b, 0, surface.gloss.part.offset);
            surface.gloss.by_angle = angleFactors(in);
            surface.gloss.roughness = in.number();
            surface.gloss.masking = rb_masking(in.small());
            break;
        case 8:
            surface.diffuse.model = rb_diffuse_model(in.small());
            surface.diffuse.roughness = a[0];
            surface.diffuse.leaving = angleFactors(in);
            break;
        case 9: {
            rb_lobe* const lobes[] = {&surface.microfibers, &surface.velvet, &surface.burley_sheen,
                                      &surface.several_facets};
            rb_lobe& lobe = *lobes[in.below(4)];
            copy(a, 0, lobe.reflectance);
            lobe.by_angle = angleFactors(in);
            lobe.roughness = in.number();
            break;
        }
        default:
            surface.reflectance_by_angle = angleFactors(in);
            copy(a, 0, surface.shown.from_above);
            surface.shown.by_angle = angleFactors(in);
    }
}

void addMaterial(Bytes& in, rb_scene scene) {
    int32_t id = -1;
    rb_surface front, back;
    expectMessage(rb_init_surface(&front, sizeof front));
    expectMessage(rb_init_surface(&back, sizeof back));
    const auto a = in.numbers<6>(), b = in.numbers<6>();
    const std::string name = in.text();
    copy(a, 0, front.reflectance.constant);
    copy(a, 3, back.reflectance.constant);
    copy(b, 0, front.emission.constant);
    copy(b, 3, back.emission.constant);
    Opacity opacity;
    const rb_surface* other = &back;
    rb_surface* unusual = &front;
    uint32_t times = 1;
    if (!in.flag()) {
        const int32_t choice = in.small();
        if (choice != 1) unusual = &back;
        if (choice == 0)
            times += in.below(4);
        else if (choice == 1)
            other = nullptr;
        else
            back.size = size_t(choice);
    }
    for (; times > 0; --times) spoil(in, *unusual, opacity, a, b);
    expectMessage(
        rb_add_material(scene, name.c_str(), &front, other, opacity.share, opacity.image, &id));
}

void addInstance(Bytes& in, rb_scene scene) {
    int32_t id = -1;
    auto transform = in.numbers<12>();
    if (in.flag())
        transform = {1, 0, 0, transform[3], 0, 1, 0, transform[7], 0, 0, 1, transform[11]};
    expectMessage(rb_add_instance(scene, in.small(), in.text().c_str(), transform.data(),
                                  rb_role(in.below(3)), rb_side(in.below(3)), &id));
    if (in.flag()) expectMessage(rb_set_instance_visibility(scene, id, in.flag(), in.flag()));
    if (in.flag()) expectMessage(rb_set_instance_quality(scene, id, in.number(), in.number()));
    const int32_t corners[] = {in.small(), in.small(), 0};
    if (in.flag()) expectMessage(rb_set_result_corners(scene, id, corners, in.below(4)));
    if (in.flag()) expectMessage(rb_set_instance_light_set(scene, in.small(), in.small()));
}

// Returns all settings that are choices.
std::vector<rb_setting_info> choices() {
    std::vector<rb_setting_info> found;
    for (size_t index = 0; index < rb_get_setting_count(); ++index) {
        rb_setting_info info{};
        info.size = sizeof info;
        rb_get_setting_info(index, &info);
        if (info.type == RB_SETTING_CHOICE) found.push_back(info);
    }
    return found;
}

void set(Bytes& in, rb_bake bake) {
    static const char* const kIntegers[] = {
        "refine",          "contacts", "seed",        "thesis_literal", "final_gather",
        "plane_coherence", "skip.lit", "skip.gather", "skip.sheets",    "skip.warm_start"};
    static const std::vector<rb_setting_info> kChoices = choices();
    switch (in.below(4)) {
        case 0: {
            const rb_setting_info& choice = kChoices[in.below(uint32_t(kChoices.size()))];
            expectMessage(rb_set_bake_string(
                bake, choice.name, choice.choices[in.below(uint32_t(choice.choice_count))]));
            break;
        }
        case 1:
            expectMessage(rb_set_bake_int(bake, kIntegers[in.below(std::size(kIntegers))],
                                          int32_t(in.below(3))));
            break;
        case 2:
            expectMessage(rb_set_bake_float(bake, "regularization", in.number()));
            break;
        default:
            expectMessage(rb_set_bake_string(bake, in.text().c_str(), in.text().c_str()));
    }
}

// Progress function that cancels the bake at call number `after`; 0: never.
struct Canceller {
    uint32_t after;
    static bool goesOn(void* user, rb_stage, double fraction) {
        if (!(fraction >= 0 && fraction <= 1)) die("progress is not a share");
        uint32_t& after = static_cast<Canceller*>(user)->after;
        return after == 0 || --after > 0;
    }
};

void expectResults(rb_bake bake, rb_error error) {
    const char* report = nullptr;
    if (error == RB_ERROR_NONE && (rb_get_report(bake, &report) != RB_ERROR_NONE || !*report))
        die("no report after a bake");
    std::vector<float> light(3 * 64);
    for (int32_t instance = -1; instance < 5; ++instance)
        for (size_t count = 0; count < 64; ++count)
            for (int output = 0; output < 4; ++output) {
                if (rb_get_corner_light(bake, instance, rb_output(output), light.data(), count) !=
                    RB_ERROR_NONE)
                    break;
                for (size_t k = 0; k < 3 * count; ++k)
                    if (!(light[k] >= 0) || std::isinf(light[k])) die("light is not finite");
            }
}

// Bakes in a thread of the library, and reads interim light while it goes on. Returns the error of
// the bake.
rb_error runInBackground(rb_bake bake, rb_scene scene) {
    rb_run run = nullptr;
    if (rb_start_bake(bake, scene, &run) != RB_ERROR_NONE) die("no run");
    std::vector<float> light(3 * 64);
    rb_run_state state{};
    state.size = sizeof state;
    do {
        if (rb_get_run_state(run, &state) != RB_ERROR_NONE) die("no state of a run");
        for (size_t count = 0; state.interim > 0 && count < 64; ++count)
            rb_get_run_light(run, 0, RB_OUTPUT_COMBINED, light.data(), count);
        std::this_thread::yield();
    } while (state.is_running);
    const rb_error error = rb_finish_run(run);
    rb_release_run(run);
    return error;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    Bytes in(data, size);
    rb_scene scene = nullptr;
    rb_bake bake = nullptr;
    if (rb_new_scene(&scene) != RB_ERROR_NONE || rb_new_bake(&bake) != RB_ERROR_NONE)
        die("no handles");
    // Small settings, so that a bake takes milliseconds.
    rb_set_bake_int(bake, "max_patches", 300);
    rb_set_bake_int(bake, "min_bundles", 2);
    rb_set_bake_int(bake, "max_bundles", 8);
    rb_set_bake_int(bake, "lines_per_bundle", 400);
    rb_set_bake_int(bake, "local_rays", 200);
    rb_set_bake_float(bake, "target_error", 0.5f);
    rb_set_bake_int(bake, "threads", 1);
    Canceller canceller{0};
    rb_set_bake_progress(bake, &Canceller::goesOn, &canceller);
    for (int calls = 0; calls < 40 && !in.isAtEnd(); ++calls) switch (in.below(10)) {
            case 0:
                addMesh(in, scene);
                break;
            case 1:
                addLight(in, scene);
                break;
            case 2:
                addImage(in, scene);
                break;
            case 3:
                addMaterial(in, scene);
                break;
            case 4:
            case 5:
                addInstance(in, scene);
                break;
            case 6:
                set(in, bake);
                break;
            case 7: {
                const auto radiance = in.numbers<3>();
                expectMessage(rb_set_world(scene, radiance.data()));
                expectMessage(rb_set_world_light_set(scene, in.small()));
                break;
            }
            case 8: {
                int32_t id = -1;
                expectMessage(rb_add_light_set(scene, in.text().c_str(), &id));
                break;
            }
            default: {
                canceller.after = in.flag() ? in.byte() : 0;
                const rb_error error = rb_execute_bake(bake, scene);
                expectMessage(error);
                expectResults(bake, error);
            }
        }
    canceller.after = 0;
    const rb_error error = runInBackground(bake, scene);
    expectMessage(error);
    expectResults(bake, error);
    rb_release_bake(bake);
    rb_release_scene(scene);
    return 0;
}
