// SPDX-License-Identifier: GPL-3.0-or-later
//
// Every skip, switched on and off: the report names the skipped work, and the light stays the same.
#include "job/skips.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// The room with one bright lamp, five dim lamps, and an object that only occludes.
Scene roomOfLamps() {
    Scene scene = litRoom();
    for (int k = 0; k < 5; ++k)
        scene.addLight(pointLight({0.5 + 0.6 * k, 0.5, 2.4}, glm::dvec3(0.01)));
    place(scene, box("post", {3.2f, 2.4f, 0}, {3.4f, 2.6f, 1}, false), grey("post", 0.5f),
          glm::dmat4(1), RB_ROLE_OCCLUDE);
    return scene;
}

// The room of lamps with a carpet of many faces.
Scene roomWithCarpet() {
    Scene scene = roomOfLamps();
    place(scene, grid("carpet", {0.4f, 0.4f, 0.2f}, {3.0f, 0, 0}, {0, 2.4f, 0}, 12, 10),
          grey("carpet", 0.4f));
    return scene;
}

// The room of lamps with a ball that only occludes and whose faces are finer than tiles.
Scene roomWithFineBall() {
    Scene scene = roomOfLamps();
    place(scene, icosphere("ball", 0.3f, 4, false), grey("ball", 0.5f),
          glm::translate(glm::dmat4(1), {3, 0.8, 1.5}), RB_ROLE_OCCLUDE);
    return scene;
}

// A room with a ball that is a lamp emitting on both sides, and with another lamp in a closed box.
Scene roomOfBulbs() {
    Scene scene = litRoom();
    place(scene, icosphere("bulb", 0.2f, 1, false), grey("bulb", 0.5f, 20, 20),
          glm::translate(glm::dmat4(1), {1, 1, 1.5}));
    place(scene, box("case", {2.4f, 1.4f, 1.4f}, {2.9f, 1.9f, 1.9f}, false), grey("", 0.5f, 2, 2));
    place(scene, box("core", {2.5f, 1.5f, 1.5f}, {2.8f, 1.8f, 1.8f}, false), grey("", 0.5f, 2, 2));
    return scene;
}

struct Case {
    const char* name;
    SkippedWork work;  // the skipped work in the report
    // Largest difference relative to the largest value. 0: within the stated errors of the two
    // bakes.
    double tolerance;
    std::function<Scene()> scene = roomOfLamps;
    std::function<void(Settings&)> prepare = [](Settings&) {};
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

class Skip : public testing::TestWithParam<Case> {};

TEST_P(Skip, ChangesNoLight) {
    const Case& c = GetParam();
    const Scene scene = c.scene();
    std::vector<glm::vec3> light[2];
    double stated[2];
    for (int on : {0, 1}) {
        Bake bake;
        setQuick(bake);
        c.prepare(bake.settings);
        bake.settings.set(std::string("skip.") + c.name, on);
        bake.run(scene);
        bake.run(scene);  // a second run, with unchanged geometry
        const Json report = reportOf(bake);
        EXPECT_EQ(skips(report, c.work), on == 1) << report["skipped"];
        light[on] = everything(bake);
        stated[on] = report["estimated_error"];
    }
    bool isDark = true;
    for (const glm::vec3& v : light[0]) isDark = isDark && v == glm::vec3(0.0f);
    if (isDark)
        EXPECT_EQ(light[1], light[0]);
    else if (c.tolerance > 0)
        EXPECT_LT(difference(light[1], light[0]), c.tolerance);
    else
        // The noise at corners is that of patches, and up to twice as large beside contacts.
        EXPECT_LT(noise(light[1], light[0]), 2 * std::hypot(stated[0], stated[1]));
}

INSTANTIATE_TEST_SUITE_P(
    Skips, Skip,
    testing::Values(
        Case{"darkness", SkippedWork::EXCHANGE_WITHOUT_LIGHT, 1e-5,
             [] { return roomWithBoxes(0.5f); }},
        Case{"reflection", SkippedWork::EXCHANGE_WITHOUT_REFLECTION, 1e-5,
             [] { return litRoom(0); }},
        Case{"geometry", SkippedWork::UNCHANGED_GEOMETRY, 1e-5},
        Case{"lights", SkippedWork::UNCHANGED_LIGHTS, 1e-5},
        Case{"facing", SkippedWork::FACING_AWAY, 1e-5},
        Case{"occluders", SkippedWork::OCCLUDERS, 1e-5},
        Case{"sheets", SkippedWork::SHEETS, 0, roomWithCarpet,
             [](Settings& settings) { settings.skipGeometry = 0; }},
        Case{"lit", SkippedWork::WHOLLY_LIT, 0}, Case{"weak", SkippedWork::WEAK_SOURCES, 0},
        Case{"inside", SkippedWork::INSIDE_OF_SOLIDS, 0},
        Case{"clusters", SkippedWork::CLUSTERED_PATCHES, 0, roomWithFineBall},
        Case{"lamp_insides", SkippedWork::LAMP_INSIDES, 0, roomOfBulbs},
        Case{"gather", SkippedWork::SMOOTH_CORNERS, 0, roomOfLamps,
             [](Settings& settings) { settings.reconstruction = Reconstruction::POINT; }},
        Case{"bundles", SkippedWork::REACHED_TARGET, 0, roomOfLamps,
             [](Settings& settings) {
                 settings.minBundles = 32;
                 settings.maxBundles = 512;
                 settings.targetError = 0.05f;
             }},
        Case{"warm_start", SkippedWork::WARM_STARTS, 1e-3}),
    [](const testing::TestParamInfo<Case>& c) { return std::string(c.param.name); });

}  // namespace
}  // namespace raybundle
