// SPDX-License-Identifier: GPL-3.0-or-later
//
// Shadows in gathered light, and the error that is stated there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "first_shot/first_shot.h"
#include "lights/light_source.h"
#include "lights/mesh_outline.h"
#include "test_bakes.h"
#include "test_scenes.h"
#include "test_shots.h"
#include "visibility/visibility.h"

namespace raybundle {
namespace {

using namespace test;

TEST(Shadows, UmbraIsBlackAndFullLightIsExact) {
    // A lamp of 0.4 m at 2 m, a blocker of 1 m at 1 m: on the floor the umbra is 1.6 m wide, and
    // the penumbra ends 1.2 m from the centre.
    Scene scene, open;
    for (Scene* s : {&scene, &open}) {
        place(*s, rectangle("floor", {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}), grey("", 0.5f));
        s->addLight(areaLight({0, 0, 2}, {0.2, 0, 0}, {0, -0.2, 0}, glm::dvec3(10)));
    }
    place(scene, rectangle("blocker", {-0.5f, -0.5f, 1}, {1, 0, 0}, {0, 1, 0}), grey("", 0.5f));
    const GatheredShot shadowed = gatherFinely(scene, 0.1f), lit = gatherFinely(open, 0.1f);
    int dark = 0, full = 0, half = 0;
    for (uint32_t p = 0; p < lit.patches.count(); ++p) {
        const glm::dvec3 at = lit.patches.centre + glm::dvec3(lit.patches.point(p, {0.5f, 0.5f}));
        const double reach = std::max(std::abs(at.x), std::abs(at.y));
        const float found = shadowed.light.irradiance[2 * p].x,
                    free = lit.light.irradiance[2 * p].x;
        if (reach < 0.75) {
            EXPECT_EQ(found, 0) << "umbra at " << at.x << ", " << at.y;
            ++dark;
        } else if (reach > 1.25) {
            // Means of the closed form at the same points of the patch, except for rounding of the
            // points.
            EXPECT_NEAR(found, free, 1e-3f * free) << "full light at " << at.x << ", " << at.y;
            ++full;
        } else {
            EXPECT_LE(found, 1.01f * free);
            half += found > 0 && found < 0.99f * free;
        }
    }
    EXPECT_GT(dark, 100);
    EXPECT_GT(full, 100);
    EXPECT_GT(half, 50);
}

// The shadow of a plate a little wider than a patch covers a corner of some patches. All samples of
// these patches may miss it. Over 256 shots with the plate in 64 places, true and stated error are
// means over some 2000 patches at the edge, accurate to about 3 %.
TEST(Shadows, TheStatedErrorCoversCornersThatAllSamplesMiss) {
    constexpr float kPatch = 0.5f, kPlate = 0.6f;
    constexpr int kShots = 256;
    double found = 0, stated = 0;
    for (int k = 0; k < kShots; ++k) {
        const glm::vec2 low(1.5f + 0.37f * kPatch * float(k % 8),
                            1.5f + 0.21f * kPatch * float(k / 8 % 8));
        Scene scene;
        place(scene, rectangle("floor", {0, 0, 0}, {5, 0, 0}, {0, 5, 0}), grey("", 0.5f));
        place(scene, rectangle("plate", {low.x, low.y, 1}, {kPlate, 0, 0}, {0, kPlate, 0}),
              grey("", 0));
        scene.addLight(sunLight({0, 0, 1}, glm::dvec3(1)));
        const Patches patches = subdivide(scene, kPatch, kMany);
        const Visibility visibility(patches);
        Settings settings;
        settings.targetError = 0.02f;
        const FirstShot shot = gather({DirectLight(scene, patches, visibility, uint32_t(k)),
                                       patches, visibility, settings, Progress()});
        for (uint32_t patch = 0; patch < patches.count(); ++patch) {
            if (patches.parentAt(2 * patch).instance != 0) continue;
            const glm::vec2 from(patches.point(patch, {0, 0})), to(patches.point(patch, {1, 1}));
            const glm::vec2 at = low - glm::vec2(patches.centre);
            const glm::vec2 overlap =
                glm::max(glm::vec2(0), glm::min(to, at + kPlate) - glm::max(from, at));
            const double exact = 1 - double(overlap.x * overlap.y) / (kPatch * kPatch);
            found += std::pow(double(shot.irradiance[2 * patch].x) - exact, 2);
            stated += std::pow(double(shot.error[2 * patch]), 2);
        }
    }
    EXPECT_LT(std::sqrt(found), 1.15 * std::sqrt(stated)) << std::sqrt(found) / std::sqrt(stated);
    EXPECT_GT(std::sqrt(found), 0.4 * std::sqrt(stated)) << "overstated";
    std::printf("[ figures  ] shadow of a plate: found over stated %.2f\n",
                std::sqrt(found / stated));
}

// A floor of 1 m under a slit in a plate, with a lamp of 1 m above the plate.
Scene floorUnderSlit(float width) {
    Scene scene;
    place(scene, rectangle("floor", {-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0));
    for (const float x : {-2 - 0.5f * width, 0.5f * width})
        place(scene, rectangle("half", {x, -2, 1}, {2, 0, 0}, {0, 4, 0}), grey("", 0));
    scene.addLight(areaLight({0, 0, 2}, {0.5, 0, 0}, {0, -0.5, 0}, glm::dvec3(10)));
    return scene;
}

// A floor that is lit only by a lamp of 1 m through a slit of 20 cm. Low targets need thousands of
// samples.
TEST(Shadows, ErrorsFollowTheTargetBehindASlit) {
    const ShotScene shots(floorUnderSlit(0.2f), 0.25f);
    auto floor = [&](float target, int seed) {
        std::vector<glm::vec3> light =
            shots.shoot(FirstShotKind::GATHER, 0, seed, target).irradiance;
        light.resize(32);  // both sides of its patches
        return light;
    };
    const std::vector<glm::vec3> right = floor(0.0005f, 1);
    double errors[2];
    for (int k = 0; k < 2; ++k) errors[k] = noise(floor(k ? 0.002f : 0.02f, 0), right);
    // Measured 0.016 and 0.0034. The lit halves are brighter, which allows the floor more than the
    // target. When at most 256 samples were taken, both were 0.018.
    EXPECT_LT(errors[0], 0.02);
    EXPECT_LT(errors[1], 0.3 * errors[0]);
}

// 16 patches see 2 % of a lamp of 1 m through a slit of 1 cm. Nearly three quarters of them miss
// this with their first 16 samples and learn of it from their neighbours. All patches miss it with
// the probability 0.98^128, in 8 % of the shots; the result is then dark.
TEST(Shadows, LightThroughANarrowSlitIsFound) {
    for (const bool hasSky : {false, true}) {
        Scene scene = floorUnderSlit(0.01f);
        scene.lights.front().strength = {10, 0, 0};
        // The floor sees the sky around the plates, and therefore all of the floor gathers again in
        // any case.
        if (hasSky) {
            scene.worldImage.width = 4;
            scene.worldImage.height = 2;
            scene.worldImage.pixels.assign(8, glm::vec3(0, 0, 0.3f));
        }
        const ShotScene shots(scene, 0.25f);
        int dark = 0, lit = 0;
        for (int seed = 0; seed < 20; ++seed) {
            const FirstShot shot = shots.shoot(FirstShotKind::GATHER, 0, seed, 0.02f);
            int found = 0;
            for (uint32_t patch = 0; patch < 16; ++patch) found += shot.irradiance[2 * patch].x > 0;
            lit += found;
            dark += found == 0;
        }
        EXPECT_LE(dark, 4);
        // Measured: 0.85 of the patches, 0.98 with the sky. It was 0.45 when only the neighbours of
        // a patch that found the slit at once learnt of it, and 0.84 with the sky when receivers
        // that gathered again for the sky did not learn of it.
        EXPECT_GT(lit, (hasSky ? 0.92 : 0.75) * 16 * (20 - dark));
    }
}

// 64 lamps in one place are together as strong as one lamp. Their errors add up, and all of them
// together keep to the error allowed for the light.
TEST(Shadows, ErrorsOfManyLampsAddUp) {
    constexpr float kTarget = 0.005f;
    auto shot = [](int lamps, float target) {
        Scene scene;
        place(scene, rectangle("floor", {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}), grey("", 0));
        place(scene, rectangle("plate", {-0.6f, -0.7f, 1}, {1.3f, 0, 0}, {0, 1.1f, 0}),
              grey("", 0));
        for (int k = 0; k < lamps; ++k)
            scene.addLight(
                areaLight({0.1, 0, 2}, {0.03, 0, 0}, {0, -0.03, 0}, glm::dvec3(10.0 / lamps)));
        return ShotScene(scene, 0.2f).shoot(FirstShotKind::GATHER, 0, 1, target).irradiance;
    };
    const double found = noise(shot(64, kTarget), shot(1, 0.0002f));
    // Measured 0.0029. It was 0.0051 when each lamp was allowed as much error as a single one.
    EXPECT_LT(found, kDirectShare * kTarget);
}

// A face of one patch sees a twenty-fifth of a lamp, and no neighbour reveals what its samples miss.
// Bright lamps are hidden from it. The share of each lamp in what the face could get does not tell
// how much it gives.
TEST(Shadows, AFaceAloneFindsTheLampOfWhichItSeesLittle) {
    constexpr int kSeeds = 20;
    auto light = [](int brightLamps, int seed, float target) {
        Scene scene;
        place(scene, rectangle("receiver", {-0.01f, -0.01f, 0}, {0.02f, 0, 0}, {0, 0.02f, 0}),
              grey("", 0));
        // The weak lamp lights this floor, or it would be taken for one that lights nothing.
        place(scene, rectangle("floor", {0.5f, -0.2f, 0}, {0.4f, 0, 0}, {0, 0.4f, 0}), grey("", 0));
        const int32_t plate =
            place(scene, rectangle("plate", {-1, -1, 1}, {1.23f, 0, 0}, {0, 2, 0}), grey("", 0));
        scene.instances[size_t(plate)].role = RB_ROLE_OCCLUDE;
        scene.addLight(areaLight({0, 0, 2}, {0.5, 0, 0}, {0, -0.5, 0}, glm::dvec3(1)));
        for (int k = 0; k < brightLamps; ++k)
            scene.addLight(pointLight({-0.3 - 0.01 * k, 0, 1.5}, glm::dvec3(100)));
        Bake bake;
        bake.settings.seed = seed;
        bake.settings.targetError = target;
        bake.settings.patchSize = 0.25f;
        bake.run(scene);
        return cornerLight(bake, 0, RB_OUTPUT_DIRECT)[0].x;
    };
    const float right = light(0, 1, 0.001f);
    for (const int brightLamps : {0, 8}) {
        double squares = 0;
        for (int seed = 0; seed < kSeeds; ++seed) {
            const float found = light(brightLamps, seed, 0.02f);
            squares += (found / right - 1) * (found / right - 1) / kSeeds;
        }
        // The error may be 1.5 % of a quarter of the light of the floor, which sees all of the weak
        // lamp, or 9 % of the light of the face. Measured 2 %. It was 55 % without bright lamps,
        // because 16 samples that found the lamp hidden were believed, and 97 % among eight bright
        // lamps, where the weak one took four.
        EXPECT_LT(std::sqrt(squares), 0.09) << brightLamps << " bright lamps";
    }
}

// A block stands on a glowing panel. Its inside is dark, though shadow rays to the panel end just
// before the bottom of the block, and the panel gives only the light that the block does not cover.
TEST(Shadows, TheInsideOfASolidOnAGlowingFaceIsDark) {
    for (const double degrees : {0.0, 23.0})
        for (const double far : {0.0, 1000.0}) {
            glm::dmat4 pose = glm::translate(glm::dmat4(1), glm::dvec3(far, 0.3 * far, -far));
            pose = glm::rotate(pose, glm::radians(degrees), glm::normalize(glm::dvec3(1, 2, 3)));
            Scene scene;
            place(scene, box("room", {-1, -1, -0.5f}, {1, 1, 1.5f}, true), grey("walls", 0.5f),
                  pose);
            place(scene, rectangle("panel", {-0.8f, -0.8f, 0}, {1.6f, 0, 0}, {0, 1.6f, 0}),
                  grey("panel", 0.0f, 5), pose);
            const int32_t block =
                place(scene, box("block", {-0.47f, -0.5f, 0}, {-0.14f, -0.1f, 0.4f}, false),
                      grey("block", 0.3f), pose);
            Bake bake;
            bake.settings.patchSize = 0.1f;
            bake.run(scene);
            const Patches& patches = bake.patches();
            for (uint32_t side = 1; side < patches.sideCount(); side += 2) {
                if (patches.parentAt(side).instance != uint32_t(block)) continue;
                EXPECT_EQ(bake.patchIrradiance().ofSources[side], glm::vec3(0.0f));
            }
            const Json energy = reportOf(bake)["energy"];
            // 2.56 m^2 of panel less 0.33 x 0.4 m of block, at 5 W/m^2 in each of three channels.
            // The covered share is measured with 16,384 rays, to about 0.2 % of the power.
            EXPECT_NEAR(double(energy["emitted"]) / (15 * (2.56 - 0.132)), 1, 0.005);
            // It was 0.057 when the covered light reached the inside.
            EXPECT_LT(energy["balance_error"], 5e-3) << degrees << " degrees, " << far << " m";
        }
}

TEST(Shadows, SurfacesBlockFromBothSides) {
    for (bool turned : {false, true}) {
        Scene scene;
        placeReceiver(scene);
        const glm::vec3 u(2, 0, 0), v(0, 2, 0);
        place(scene, rectangle("blocker", {-1, -1, 1}, turned ? v : u, turned ? u : v),
              grey("", 0.5f));
        scene.addLight(pointLight({0.01, 0.02, 3}, glm::dvec3(10)));
        EXPECT_EQ(gatherFinely(scene).front(), 0);
    }
}

}  // namespace
}  // namespace raybundle
