// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light that is reflected close to a lamp: gathered, against what very many bundles bring.
#include "transport/bright_spots.h"

#include <gtest/gtest.h>

#include <string>

#include "bake/bake.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// A closed room with a lamp before one of its walls.
Scene roomWithLampAtWall(double distance) {
    Scene scene;
    place(scene, box("room", glm::vec3(0), glm::vec3(2), true), grey("", 0.6f));
    scene.addLight(pointLight({1.03, distance, 0.96}, glm::dvec3(5)));
    return scene;
}

size_t spotsOf(const Bake& bake) {
    const Json report = reportOf(bake);
    for (const auto& skip : report["skipped"])
        if (std::string(skip["why"]).find("bright sides") != std::string::npos)
            return skip["count"];
    return 0;
}

// Mean irradiance of the fronts of all patches but those of the wall at the lamp.
double lightOfOthers(const Bake& bake) {
    const Patches& patches = bake.patches();
    const Irradiance& found = bake.patchIrradiance();
    double sum = 0, area = 0;
    for (uint32_t side = 0; side < found.direct.size(); side += 2) {
        if (std::abs(patches.normal(side).y - 1) < 1e-3f) continue;
        sum += double(patches.area[side / 2] * (found.direct[side].x + found.indirect[side].x));
        area += double(patches.area[side / 2]);
    }
    return sum / area;
}

TEST(BrightSpots, GiveTheLightOfVeryManyBundles) {
    const Scene scene = roomWithLampAtWall(0.01);
    Bake gathered, bundled;
    for (Bake* bake : {&gathered, &bundled}) {
        bake->settings.patchSize = 0.1f;
        bake->settings.targetError = 0.01f;
    }
    gathered.run(scene);
    EXPECT_GT(spotsOf(gathered), 0u);
    EXPECT_LT(reportOf(gathered)["bundles"], 1000);
    EXPECT_LT(reportOf(gathered)["energy"]["balance_error"], 2e-3);
    // At this target the bundles that are spared are too few for spots.
    bundled.settings.targetError = 0.3f;
    bundled.settings.minBundles = bundled.settings.maxBundles = 16384;
    bundled.settings.skipBundles = 0;
    bundled.run(scene);
    EXPECT_EQ(spotsOf(bundled), 0u);
    // One patch has most of the light: 16,384 bundles meet it 33,000 times, 0.6 % of noise by random
    // lines; the gathered light has 1 % on each of many patches.
    EXPECT_NEAR(lightOfOthers(gathered) / lightOfOthers(bundled), 1, 0.01);
}

TEST(BrightSpots, AreNoneWhereALampIsFarFromWalls) {
    Bake bake;
    bake.settings.patchSize = 0.1f;
    bake.run(roomWithLampAtWall(1));
    EXPECT_EQ(spotsOf(bake), 0u);
}

}  // namespace
}  // namespace raybundle
