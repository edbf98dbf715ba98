// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light that is reflected close to a lamp: the gathered light equals that of very many bundles.
#include "first_shot/bright_spots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// A closed room with a lamp in front of one of its walls. If `isRough`, the walls reflect light
// depending on its direction.
Scene roomWithLampAtWall(double distance, bool isRough = false) {
    Scene scene;
    Material paint = grey("", 0.6f);
    if (isRough) {
        paint.sides[0].scattering.diffuseModel = RB_DIFFUSE_BURLEY;
        paint.sides[0].scattering.diffuseRoughness = 1;
    }
    place(scene, box("room", glm::vec3(0), glm::vec3(2), true), paint);
    scene.addLight(pointLight({1.03, distance, 0.96}, glm::dvec3(5)));
    return scene;
}

size_t spotsOf(const Bake& bake) { return skippedCount(reportOf(bake), SkippedWork::BRIGHT_SPOTS); }

// Returns the mean irradiance on the fronts of all patches but those of the wall at the lamp.
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

class BrightSpots : public testing::TestWithParam<bool> {};

TEST_P(BrightSpots, GiveTheLightOfVeryManyBundles) {
    const Scene scene = roomWithLampAtWall(0.01, GetParam());
    Bake gathered, bundled;
    for (Bake* bake : {&gathered, &bundled}) {
        bake->settings.patchSize = 0.1f;
        bake->settings.targetError = 0.01f;
    }
    gathered.run(scene);
    EXPECT_GT(spotsOf(gathered), 0u);
    EXPECT_LT(reportOf(gathered)["bundles"], 1000);
    EXPECT_LT(reportOf(gathered)["energy"]["balance_error"], 2e-3);
    // With this target too few bundles would be saved for bright spots to pay.
    bundled.settings.targetError = 1;
    bundled.settings.minBundles = bundled.settings.maxBundles = 16384;
    bundled.settings.skipBundles = 0;
    bundled.run(scene);
    EXPECT_EQ(spotsOf(bundled), 0u);
    // One patch has most of the light. 16,384 bundles meet it 33,000 times, which leaves 0.6 % of
    // noise with random lines. The gathered light has 1 % on each of many patches.
    EXPECT_NEAR(lightOfOthers(gathered) / lightOfOthers(bundled), 1, 0.01);
}

TEST_P(BrightSpots, LightDraftsTheSame) {
    Bake whole, draft;
    for (Bake* bake : {&whole, &draft}) {
        bake->settings.patchSize = 0.1f;
        bake->settings.targetError = 0.3f;
        bake->settings.minBundles = bake->settings.maxBundles = 64;
    }
    draft.settings.draft = 1;
    const Scene scene = roomWithLampAtWall(0.01, GetParam());
    whole.run(scene);
    draft.run(scene);
    // Both have the same lines and rays. The residual of a draft is 0.002 of all light, which the
    // patch beside the lamp has most of.
    EXPECT_NEAR(lightOfOthers(draft) / lightOfOthers(whole), 1, 0.05);
}

TEST_P(BrightSpots, LeaveNoNoiseToTheRoom) {
    // Compares the opposite half of the room, whose corners are lit only by the bright spot.
    std::vector<glm::vec3> light[2];
    for (int seed = 0; seed < 2; ++seed) {
        Bake bake;
        bake.settings.patchSize = 0.1f;
        bake.settings.seed = seed;
        bake.run(roomWithLampAtWall(0.01, GetParam()));
        EXPECT_LT(reportOf(bake)["bundles"], 400);
        const Patches& patches = bake.patches();
        for (uint32_t side = 0; side < patches.sideCount(); side += 2)
            if (patches.point(side / 2, glm::vec2(0.5f)).y > 0)
                light[seed].push_back(bake.patchIrradiance().indirect[side]);
    }
    // Two bakes differ by sqrt(2) of the noise. The noise is the target on parts of objects, and up
    // to twice that on single patches.
    EXPECT_LT(noise(light[0], light[1]), 2 * std::sqrt(2.0) * 0.02);
}

// Bars a millimetre in front of the bright wall, like a fork on a lit table. All light on their
// sides comes from between the bars.
TEST_P(BrightSpots, LightSmallThingsBesideThem) {
    std::vector<glm::vec3> light[2];
    for (int seed = 0; seed < 2; ++seed) {
        Scene scene = roomWithLampAtWall(0.05, GetParam());
        for (int k = 0; k < 6; ++k) {
            const float x = 0.85f + 0.008f * float(k);
            place(scene, box("bar", {x, 0.001f, 0.9f}, {x + 0.004f, 0.003f, 1.0f}, false),
                  grey("bar", 0.5f));
        }
        Bake bake;
        bake.settings.patchSize = 0.1f;
        bake.settings.targetError = 0.005f;
        bake.settings.seed = seed;
        bake.run(scene);
        EXPECT_GT(spotsOf(bake), 0u);
        const Patches& patches = bake.patches();
        const Irradiance& found = bake.patchIrradiance();
        for (uint32_t side = 0; side < patches.sideCount(); side += 2)
            if (patches.parentAt(side).instance > 0 && std::abs(patches.normal(side).x) > 0.9f)
                light[seed].push_back(found.direct[side] + found.indirect[side]);
    }
    // Two bakes differ by sqrt(2) of the noise. The measured difference is 0.006, and 0.017 for
    // rough walls, which have no closed form to compare samples with.
    EXPECT_LT(noise(light[0], light[1]), 0.02);
}

// Returns the light of the room but for its bright wall, gathered and by very many bundles.
std::array<double, 2> gatheredAndBundled(const Scene& scene) {
    std::array<double, 2> light{};
    for (size_t k = 0; k < 2; ++k) {
        Bake bake;
        bake.settings.patchSize = 0.1f;
        bake.settings.targetError = 0.01f;
        if (k == 1) {
            // With this target too few bundles would be saved for bright spots to pay.
            bake.settings.targetError = 1;
            bake.settings.minBundles = bake.settings.maxBundles = 16384;
            bake.settings.skipBundles = 0;
        }
        bake.run(scene);
        EXPECT_EQ(spotsOf(bake) > 0, k == 0);
        if (k == 0) {
            EXPECT_LT(reportOf(bake)["bundles"], 1000);
            EXPECT_LT(reportOf(bake)["energy"]["balance_error"], 3e-3);
        }
        light[k] = lightOfOthers(bake);
    }
    return light;
}

// A block stands on the bright wall and covers a part of its brightest patch.
TEST_P(BrightSpots, ShineBesideWhatStandsOnThem) {
    Scene scene = roomWithLampAtWall(0.02, GetParam());
    place(scene, box("block", {1.06f, 0, 0.9f}, {1.08f, 0.05f, 1.0f}, false), grey("block", 0.3f));
    const auto [gathered, bundled] = gatheredAndBundled(scene);
    // The 16,384 bundles leave about 0.6 % of noise, see above.
    EXPECT_NEAR(gathered / bundled, 1, 0.012);
}

// A lamp in a shade that is open below lights the inside of the shade, which lights itself.
TEST(BrightSpotsInAShade, LightEachOther) {
    Scene scene;
    place(scene, box("room", glm::vec3(0), glm::vec3(2), true), grey("walls", 0.6f));
    const glm::vec3 low(0.9f, 0.9f, 1.5f), high(1.1f, 1.1f, 1.6f);
    const Mesh whole = box("shade", low, high, true);
    Mesh shade = whole;
    // Without its bottom face.
    shade.cornerVertices.clear();
    shade.faceOffsets = {0};
    shade.faceMaterials.clear();
    for (size_t f = 0; f < whole.faceCount(); ++f) {
        const auto begin = whole.cornerVertices.begin() + whole.faceOffsets[f],
                   end = whole.cornerVertices.begin() + whole.faceOffsets[f + 1];
        if (std::all_of(begin, end, [&](int32_t v) { return whole.vertices[size_t(v)].z < 1.55f; }))
            continue;
        shade.cornerVertices.insert(shade.cornerVertices.end(), begin, end);
        shade.faceOffsets.push_back(int32_t(shade.cornerVertices.size()));
        shade.faceMaterials.push_back(0);
    }
    ASSERT_EQ(shade.faceCount(), 5u);
    place(scene, shade, grey("shade", 0.8f));
    scene.addLight(pointLight({1.02, 0.99, 1.57}, glm::dvec3(5)));
    const auto [gathered, bundled] = gatheredAndBundled(scene);
    EXPECT_NEAR(gathered / bundled, 1, 0.012);
}

TEST_P(BrightSpots, AreNoneWhereALampIsFarFromWalls) {
    Bake bake;
    bake.settings.patchSize = 0.1f;
    bake.run(roomWithLampAtWall(1, GetParam()));
    EXPECT_EQ(spotsOf(bake), 0u);
}

// A dark object far below, of 16 times the area of the room, changes neither the bright spots nor
// the light.
TEST_P(BrightSpots, AreTheSameWithSomethingDarkFarAway) {
    for (const double distance : {0.01, 1.0}) {
        Bake bakes[2];
        for (const bool hasFar : {false, true}) {
            Scene scene = roomWithLampAtWall(distance, GetParam());
            if (hasFar)
                place(scene, box("far", {-4, -4, -308}, {4, 4, -300}, false), grey("far", 0.5f),
                      glm::dmat4(1), RB_ROLE_OCCLUDE);
            Bake& bake = bakes[hasFar];
            bake.settings.patchSize = 0.1f;
            bake.run(scene);
        }
        EXPECT_EQ(spotsOf(bakes[0]), spotsOf(bakes[1])) << distance;
        EXPECT_EQ(spotsOf(bakes[0]) > 0, distance < 0.1);
    }
}

// Something far away has a larger touch distance, which does not apply to the bright wall: a shade
// in front of the lamp, 10 cm from the wall, does not lie on it.
TEST_P(BrightSpots, AreJudgedByTheTouchDistanceOfTheirIsland) {
    size_t spots[2];
    for (const bool hasFar : {false, true}) {
        Scene scene = roomWithLampAtWall(0.03, GetParam());
        place(scene, box("shade", {0.5f, 0.1f, 0.5f}, {1.5f, 0.11f, 1.5f}, false),
              grey("shade", 0.5f));
        if (hasFar)
            place(scene, box("far", {-4, -4, -300008}, {4, 4, -300000}, false), grey("far", 0.5f),
                  glm::dmat4(1), RB_ROLE_OCCLUDE);
        Bake bake;
        bake.settings.patchSize = 0.1f;
        bake.run(scene);
        spots[hasFar] = spotsOf(bake);
        EXPECT_EQ(bake.patches().touchDistance > 0.02f, hasFar);
    }
    EXPECT_GT(spots[0], 0u);
    EXPECT_EQ(spots[0], spots[1]);
}

INSTANTIATE_TEST_SUITE_P(Of, BrightSpots, testing::Bool(), [](const auto& test) {
    return test.param ? "RoughWalls" : "LambertsWalls";
});

}  // namespace
}  // namespace raybundle
