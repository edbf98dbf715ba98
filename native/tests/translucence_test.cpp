// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light that passes diffusely through surfaces, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle::test {
namespace {

Material translucent(float reflectance, float translucence, float emission = 0) {
    Material material = grey("paper", reflectance, emission, emission);
    for (MaterialSide& side : material.sides) side.translucence.constant = glm::vec3(translucence);
    return material;
}

// A cube in a white world of exitance kWorld, W/m^2. The outside sees only the world. Inside all
// sides get equal light from each other, so that H_in = rho H_in + tau kWorld.
constexpr float kWorld = 2;

Scene paperCube(float reflectance, float translucence) {
    Scene scene;
    place(scene, box("cube", glm::vec3(0), glm::vec3(1), true),
          translucent(reflectance, translucence));
    scene.worldRadiance = glm::vec3(kWorld / float(kPi));
    return scene;
}

// Expects the same irradiance, W/m^2, at all corners of an instance.
void expectLight(const Bake& bake, int32_t instance, rb_output output, double irradiance,
                 double tolerance) {
    for (const glm::vec3& v : bake.instanceLight(instance).perCorner(output))
        EXPECT_NEAR(double(v.x) * kPi, irradiance, tolerance * irradiance);
}

class Translucence : public ::testing::TestWithParam<Reconstruction> {
  protected:
    Translucence() {
        bake.settings.reconstruction = GetParam();
        bake.settings.patchSize = 0.2f;
    }
    Bake bake;
};

// In a closed furnace every line carries the same light, so that there is no noise except rounding
// and the residual of the solve.
TEST_P(Translucence, LightInsideAPaperCubeIsThatOfTheClosedForm) {
    for (const auto& [rho, tau] :
         {std::pair(0.5f, 0.3f), std::pair(0.0f, 0.6f), std::pair(0.2f, 0.7f)}) {
        bake.run(paperCube(rho, tau));
        const double inside = tau * kWorld / (1 - rho);
        // The front shows the light of both sides, weighted by the share that it sends of each.
        const double sent = rho * inside + tau * kWorld;
        expectLight(bake, 0, RB_OUTPUT_LIGHTING, sent / (rho + tau), 1e-3);
        expectLight(bake, 0, RB_OUTPUT_COMBINED, sent, 1e-3);
        for (size_t side = 0; side < bake.patches().sideCount(); side += 2)
            EXPECT_NEAR(bake.patchIrradiance().all(side).x, inside, 1e-3 * inside);
    }
}

// A wall divides a room in two. The share of the light that the wall reflects and lets through
// together equals the reflectance of the other walls, so that the light is the same everywhere: B =
// E / (1 - rho).
TEST_P(Translucence, TwoHalvesOfAFurnaceAreOne) {
    Scene scene = closedCube(0.6f, 1);
    const int32_t wall = place(
        scene, grid("wall", glm::vec3(0.4f, 0, 0), glm::vec3(0, 1, 0), glm::vec3(0, 0, 1), 2, 2),
        translucent(0.25f, 0.35f, 1));
    bake.run(scene);
    expectLight(bake, 0, RB_OUTPUT_COMBINED, 2.5, 1e-3);
    expectLight(bake, wall, RB_OUTPUT_COMBINED, 2.5, 1e-3);
}

// The sun shines from behind. There is no noise and nothing else in the scene.
TEST_P(Translucence, ASheetShowsTheSunBehindIt) {
    Scene scene;
    const int32_t sheet =
        place(scene, grid("sheet", glm::vec3(0), glm::vec3(1, 0, 0), glm::vec3(0, 1, 0), 2, 2),
              translucent(0.2f, 0.3f));
    scene.addLight(sunLight({0, 0.6, -0.8}, glm::dvec3(5)));
    bake.run(scene);
    expectLight(bake, sheet, RB_OUTPUT_DIRECT, 0.6 * 4, 1e-4);
    expectLight(bake, sheet, RB_OUTPUT_COMBINED, 0.3 * 4, 1e-4);
}

// A sheet without reflectance above a floor without reflectance. The floor gets tau times the sun's
// light times their form factor.
TEST_P(Translucence, AFloorGetsTheSunThroughASheet) {
    Scene scene;
    const int32_t floor =
        place(scene, grid("floor", glm::vec3(0), glm::vec3(1, 0, 0), glm::vec3(0, 1, 0), 8, 8),
              grey("floor", 0));
    place(scene, rectangle("sheet", glm::vec3(0, 0, 1), glm::vec3(1, 0, 0), glm::vec3(0, 1, 0)),
          translucent(0, 0.5f), glm::dmat4(1), RB_ROLE_OCCLUDE);
    scene.addLight(sunLight({0, 0, 1}, glm::dvec3(4)));
    bake.settings.targetError = 0.005f;
    bake.settings.maxBundles = 4096;
    bake.run(scene);
    double sum = 0, area = 0;
    const Patches& patches = bake.patches();
    for (size_t side = 0; side < patches.sideCount(); side += 2) {
        if (int32_t(patches.parentAt(uint32_t(side)).instance) != floor) continue;
        sum += double(patches.area[side / 2] * bake.patchIrradiance().all(side).x);
        area += double(patches.area[side / 2]);
    }
    // The stated noise is 0.5 %. The mean over the floor has less.
    const double exact = 0.5 * 4 * parallelRectangles(1, 1, 1);
    EXPECT_NEAR(sum / area, exact, 0.01 * exact);
}

INSTANTIATE_TEST_SUITE_P(Reconstructions, Translucence,
                         ::testing::Values(Reconstruction::LEAST_SQUARES,
                                           Reconstruction::AREA_AVERAGE, Reconstruction::POINT),
                         [](const auto& one) { return std::string(choiceName(one.param)); });

// Light that passes back and forth through a sheet between highly reflecting walls takes a thousand
// passes. The result must be right, or a warning must say that it is not.
TEST(TranslucenceOfMaterials, LightThatDoesNotComeToRestIsSaid) {
    for (float rho : {0.6f, 0.9f, 0.99f, 0.999f}) {
        Scene scene = closedCube(rho, 1 - rho);
        place(scene, rectangle("sheet", {0.5f, 0, 0}, {0, 1, 0}, {0, 0, 1}),
              translucent(0, rho, 1 - rho));
        Bake bake;
        setQuick(bake);
        bake.run(scene);
        const std::vector<glm::vec3> light = cornerLight(bake, 0, RB_OUTPUT_COMBINED);
        const bool isSaid = warns(reportOf(bake), WarningId::UNSETTLED_EXCHANGE);
        EXPECT_NE(isSaid, std::abs(light[0].x * kPi - 1) < 0.02) << rho << ' ' << light[0].x * kPi;
    }
}

TEST(TranslucenceOfMaterials, EnergyIsBalanced) {
    Bake bake;
    bake.settings.patchSize = 0.1f;
    bake.run(paperCube(0.4f, 0.5f));
    const auto energy = reportOf(bake)["energy"];
    EXPECT_NEAR(double(energy["absorbed"]) + double(energy["escaped"]), double(energy["emitted"]),
                1e-3 * double(energy["emitted"]));
}

// Reflectance and translucence together must not create light.
TEST(TranslucenceOfMaterials, TooMuchIsClamped) {
    Bake bake;
    bake.settings.patchSize = 0.2f;
    bake.run(paperCube(0.8f, 0.5f));
    const float inside = bake.patchIrradiance().all(0).x;
    EXPECT_NEAR(inside, 0.199 * kWorld / 0.2, 0.01);
}

// With the closed form of the paper cube, as above.
TEST(TranslucenceOfMaterials, ACubeStaysExactBeyondTheMemoryLimit) {
    Bake bake;
    bake.settings.patchSize = 0.1f;
    bake.settings.memoryLimit = 2;
    bake.settings.minBundles = bake.settings.maxBundles = 512;
    bake.run(paperCube(0.5f, 0.3f));
    ASSERT_TRUE(warns(reportOf(bake), WarningId::MEMORY_LIMIT));
    expectLight(bake, 0, RB_OUTPUT_COMBINED, 0.5 * 1.2 + 0.3 * kWorld, 1e-3);
}

TEST(TranslucenceOfMaterials, AnExtendedFirstShotGoesThroughToo) {
    Scene scene = paperCube(0.5f, 0.3f);
    scene.worldRadiance = glm::vec3(0.0f);
    // The lamp inside lights the walls and shines out through them. No light returns from outside.
    scene.addLight(pointLight(glm::dvec3(0.5), glm::dvec3(1)));
    Bake bake;
    bake.settings.patchSize = 0.1f;
    bake.settings.targetError = 0.005f;
    auto meanOutside = [&](FirstShotKind firstShot) {
        bake.settings.firstShot = firstShot;
        bake.run(scene);
        double sum = 0;
        for (const glm::vec3& v : bake.instanceLight(0).perCorner(RB_OUTPUT_COMBINED))
            sum += double(v.x) / 24;
        return sum;
    };
    const double gathered = meanOutside(FirstShotKind::GATHER);
    EXPECT_NEAR(meanOutside(FirstShotKind::EXTENDED), gathered, 0.01 * gathered);
}

TEST(TranslucenceOfMaterials, AnImageVariesIt) {
    Scene scene = paperCube(0, 0.6f);
    scene.meshes[0].uvs.assign(24, glm::vec2(0.5f));
    scene.images.push_back({"half", 1, 1, RB_IMAGE_REPEAT, {glm::vec3(0.5f)}});
    for (MaterialSide& paper : scene.materials[0].sides)
        paper.translucence = {glm::vec3(0.1f), 0, glm::vec3(1.0f)};
    Bake bake;
    bake.settings.patchSize = 0.2f;
    bake.run(scene);
    EXPECT_NEAR(bake.patchIrradiance().all(0).x, 0.6 * kWorld, 1e-3);
}

// Half of the light passes straight through: H_in = 0.5 kWorld + rho H_in + tau kWorld, because
// reflectance and translucence are those of the whole surface. The noise in the mean over all walls
// is below 1 %.
TEST(TranslucenceOfMaterials, ItIsThatOfTheWholeSurfaceHolesIncluded) {
    Scene scene = paperCube(0.2f, 0.2f);
    scene.materials[0].opacity = 0.5f;
    Bake bake;
    bake.settings.patchSize = 0.1f;
    bake.settings.targetError = 0.005f;
    bake.run(scene);
    double sum = 0, area = 0;
    for (size_t side = 0; side < bake.patches().sideCount(); side += 2) {
        sum += double(bake.patches().area[side / 2] * bake.patchIrradiance().all(side).x);
        area += double(bake.patches().area[side / 2]);
    }
    EXPECT_NEAR(sum / area, 0.7 * kWorld / 0.8, 0.01 * kWorld);
}

TEST(TranslucenceOfMaterials, OtherSolversSayThatTheyDoNotCarryIt) {
    Bake bake;
    bake.settings.patchSize = 0.2f;
    bake.settings.solver = Solver::MULTIPATH;
    bake.settings.directions = DirectionKind::RANDOM;
    bake.run(paperCube(0.5f, 0.3f));
    EXPECT_NE(bake.reportJson().find("material \\\"paper\\\": solver MULTIPATH does not send"),
              std::string::npos)
        << bake.reportJson();
}

}  // namespace
}  // namespace raybundle::test
