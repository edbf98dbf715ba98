// SPDX-License-Identifier: GPL-3.0-or-later
//
// Many lamps: their light is that of each of them, for about the rays of a few.
#include "lights/joint_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <vector>

#include "bake/bake.h"
#include "sampling/sobol.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// A grid of `count` x `count` lamps below the ceiling of a room of 4 x 4 x 2 m, with 8 W/sr in all.
// Boxes hide each lamp from some of the walls.
Scene roomWithLamps(int count) {
    Scene scene;
    place(scene, box("room", {-2, -2, 0}, {2, 2, 2}, true), grey("walls", 0.5f));
    for (int k = 0; k < 3; ++k)
        place(scene, box("box", {-1.4f + float(k), -0.8f, 0}, {-1 + float(k), 0.9f, 1.4f}, false),
              grey("box", 0.4f));
    for (int i = 0; i < count; ++i)
        for (int j = 0; j < count; ++j) {
            const glm::dvec2 at = 3.6 * (glm::dvec2(i, j) + 0.5) / double(count) - 1.8;
            scene.addLight(pointLight({at.x, at.y, 1.9}, glm::dvec3(8.0 / (count * count))));
        }
    return scene;
}

TEST(JointSource, SamplesGiveTheSumOfItsSources) {
    Scene scene;
    for (int k = 0; k < 20; ++k)
        scene.addLight(
            pointLight({0.3 * k - 3, 0.1 * k, 1 + 0.2 * (k % 5)}, glm::dvec3(1 + k % 3)));
    const Patches patches;
    const LightSources sources = lightSources(scene, patches, {}, {});
    ASSERT_EQ(sources.size(), 20u);
    JointSource joint(sources);
    // Any weights give the sum, as long as they are positive.
    for (uint32_t k = 0; k < 20; ++k) joint.add(k, 0.2f + float(k % 7));
    EXPECT_EQ(joint.strongest(), 6u);
    const glm::vec3 point(0.2f, 0.1f, 0), normal(0, 0, 1);
    double exact = 0, sum = 0;
    for (const auto& source : sources) exact += double(source->irradiance(point, normal)->x);
    constexpr uint32_t kSamples = 1 << 16;
    for (uint32_t i = 0; i < kSamples; ++i) {
        const glm::vec4 u = sobolPoint(i, 5);
        sum += double(joint.sample(point, normal, {u.x, u.y}).irradiance.x) / kSamples;
    }
    // Sobol points put as many samples on each source as its weight demands, within about one.
    EXPECT_NEAR(sum / exact, 1, 1e-3);
}

struct LampLight {
    std::vector<glm::vec3> ofSources;  // per side, W/m^2
    double mean = 0, shadowRays = 0;
};

LampLight lightOf(const Scene& scene, bool skipsWeak) {
    Bake bake;
    bake.settings.patchSize = 0.1f;
    bake.settings.skipWeak = skipsWeak;
    bake.run(scene);
    LampLight light;
    const Patches& patches = bake.patches();
    for (uint32_t side = 0; side < patches.sideCount(); ++side) {
        const glm::vec3& own = bake.patchIrradiance().ofSources[side];
        light.ofSources.push_back(own);
        light.mean += double(patches.area[side / 2] * own.x) / patches.totalArea;
    }
    light.shadowRays = reportOf(bake)["shadow_rays"];
    return light;
}

// 400 lamps are too many for the light of each to be kept for relighting.
TEST(ManyLamps, GiveTheLightOfEachForFewRays) {
    const Scene scene = roomWithLamps(20);
    const LampLight each = lightOf(scene, false), joined = lightOf(scene, true);
    // The noise of a side is at most 0.75 of the target, and half as large again beside shadows.
    // That of a mean over thousands of sides is far less.
    EXPECT_LT(noise(each.ofSources, joined.ofSources), 0.02);
    EXPECT_NEAR(joined.mean / each.mean, 1, 0.003);
    EXPECT_LT(joined.shadowRays, each.shadowRays / 10);
}

TEST(ManyLamps, TakeLittleMoreRaysThanAFew) {
    // More lamps make softer shadows, of which more sides see a part.
    EXPECT_LT(lightOf(roomWithLamps(20), true).shadowRays,
              1.5 * lightOf(roomWithLamps(4), true).shadowRays);
}

// Relation: lamps in one place give the light of a single lamp.
TEST(ManyLamps, InOnePlaceAreOneLamp) {
    Scene one = roomWithLamps(0), many = roomWithLamps(0);
    one.addLight(pointLight({0.3, -0.2, 1.8}, glm::dvec3(8)));
    for (int k = 0; k < 400; ++k)
        many.addLight(pointLight({0.3, -0.2, 1.8}, glm::dvec3(8.0 / 400)));
    const LampLight light = lightOf(one, true), ofMany = lightOf(many, true);
    EXPECT_LT(noise(light.ofSources, ofMany.ofSources), 0.02);
    EXPECT_NEAR(ofMany.mean / light.mean, 1, 0.003);
}

// Relation: neither the order of the lamps matters, nor one more that is too dim to be seen.
TEST(ManyLamps, AreTheSameInAnyOrderAndWithADimOneMore) {
    const Scene scene = roomWithLamps(20);
    Scene reversed = scene, more = scene;
    std::reverse(reversed.lights.begin(), reversed.lights.end());
    more.addLight(pointLight({0, 0, 0.5}, glm::dvec3(1e-9)));
    const LampLight light = lightOf(scene, true);
    for (const Scene* other : {&reversed, &more}) {
        const LampLight found = lightOf(*other, true);
        EXPECT_LT(noise(light.ofSources, found.ofSources), 0.02);
        EXPECT_NEAR(found.mean / light.mean, 1, 0.003);
    }
}

}  // namespace
}  // namespace raybundle
