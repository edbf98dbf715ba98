// SPDX-License-Identifier: GPL-3.0-or-later
//
// Cases of materials: reflectances up to 1 and beyond, emission over 24 orders of magnitude.
#include "cases.h"
#include "test_scenes.h"

namespace raybundle::stress {
namespace {

using namespace test;

// Returns a closed room whose walls and boxes all emit and reflect equally, so that the irradiance
// is `light` everywhere, W/m^2.
Case furnace(const std::string& name, float reflectance, float emission, double light) {
    Case made;
    made.group = "material";
    made.name = name;
    made.scene = roomWithBoxes(reflectance, emission);
    made.settings.patchSize = 0.25f;
    made.light = light;
    return made;
}

}  // namespace

std::vector<Case> materialCases() {
    std::vector<Case> cases;
    for (float reflectance : {0.0f, 0.5f, 0.9f, 0.99f, 0.999f})
        cases.push_back(furnace("reflectance " + printed("%g", double(reflectance)), reflectance, 1,
                                1 / (1 - double(reflectance))));
    for (float reflectance : {1.0f, 1.5f}) {
        cases.push_back(furnace("reflectance " + printed("%g", double(reflectance)), reflectance, 1,
                                1 / (1 - double(0.999f))));
        cases.back().says = "clamped to 0.999";
    }
    for (float emission : {1e-12f, 1e-6f, 1e6f, 1e12f})
        cases.push_back(furnace("emission " + printed("%g", double(emission)) + " W/m^2", 0.5f,
                                emission, 2 * double(emission)));

    // A lamp that is 24 orders of magnitude brighter than the boxes. The emission of the boxes is
    // lost in its light.
    Case mixed = furnace("emission 1e-12 beside 1e12 W/m^2", 0.5f, 0, 0);
    mixed.light.reset();
    auto bright = std::make_shared<Scene>(mixed.scene);
    for (Scene* scene : {&mixed.scene, bright.get()})
        place(*scene, rectangle("lamp", {1.5f, 1.2f, 2.7f}, {0, 0.6f, 0}, {0.6f, 0, 0}),
              grey("lamp", 0, 1e12f));
    mixed.scene.materials[1].sides[0].emission.constant = glm::vec3(1e-12f);
    mixed.scene.materials[1].sides[1].emission.constant = glm::vec3(0.0f);
    mixed.like = bright;
    mixed.likeSettings = mixed.settings;
    mixed.hasNoise = true;
    mixed.tolerance = 1e-3;
    cases.push_back(mixed);
    return cases;
}

}  // namespace raybundle::stress
