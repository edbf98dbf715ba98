// SPDX-License-Identifier: GPL-3.0-or-later
//
// Surfaces that let light pass straight through, and emission that varies over a surface.
#include <gtest/gtest.h>

#include <cmath>

#include "job/error.h"
#include "lights/mesh_outline.h"
#include "test_bakes.h"
#include "test_scenes.h"
#include "test_shots.h"

namespace raybundle {
namespace {

using namespace test;

Material veil(float opacity, float reflectance = 0) {
    Material material = grey("veil", reflectance);
    material.sides[1] = material.sides[0];
    material.opacity = opacity;
    return material;
}

// Adds a plate of 2 m at a height above the floor.
void placePlate(Scene& scene, const Material& material, float z = 0.5f) {
    place(scene, rectangle("plate", {-1, -1, z}, {2, 0, 0}, {0, 2, 0}), material, glm::dmat4(1),
          RB_ROLE_OCCLUDE);
}

Scene floorUnderSun() {
    Scene scene;
    place(scene, rectangle("floor", {-0.2f, -0.2f, 0}, {0.4f, 0, 0}, {0, 0.4f, 0}), grey("", 0));
    scene.addLight(sunLight({0.1, 0.2, 1}, glm::dvec3(3)));
    return scene;
}

// The exitance is 1 W/m^2 everywhere, whatever the opacity of the inner shell: of the light that
// meets the shell one part passes, one is reflected, and the rest is replaced by emission.
Scene furnaceWithShell(float opacity) {
    Scene scene = closedCube(0.6f, 0.4f);
    Material shell = veil(opacity, 0.3f * opacity);
    for (MaterialSide& side : shell.sides) side.emission.constant = glm::vec3(0.7f * opacity);
    place(scene, box("shell", {0.25f, 0.25f, 0.25f}, {0.7f, 0.75f, 0.8f}, false), shell);
    return scene;
}

void expectFurnace(Bake& bake, const std::string& what, double tolerance = 1e-4) {
    bake.run(furnaceWithShell(0.5f));
    for (int32_t instance : {0, 1})
        for (const glm::vec3& light : cornerLight(bake, instance, RB_OUTPUT_LIGHTING))
            EXPECT_NEAR(double(light.x) * kPi, 1, tolerance) << what << ", instance " << instance;
    // The shell sends the light that it reflects and emits. Half of the light passes through it and
    // is not its own.
    for (const glm::vec3& light : cornerLight(bake, 1, RB_OUTPUT_COMBINED))
        EXPECT_NEAR(double(light.x) * kPi, 0.5, tolerance) << what;
}

TEST(Opacity, AFurnaceWithAHalfTransparentShellIsExact) {
    for (Reconstruction reconstruction : {Reconstruction::LEAST_SQUARES, Reconstruction::POINT}) {
        Bake bake;
        setQuick(bake);
        bake.settings.reconstruction = reconstruction;
        expectFurnace(bake, choiceName(reconstruction));
    }
}

TEST(Opacity, AFurnaceIsExactWithEveryProjector) {
    for (ProjectorKind projector : {ProjectorKind::FRAGMENT_LISTS, ProjectorKind::PAINTER,
                                    ProjectorKind::PAINTER_NEWELL, ProjectorKind::PLANES}) {
        Bake bake;
        setQuick(bake);
        bake.settings.projector = projector;
        expectFurnace(bake, choiceName(projector));
    }
}

TEST(Opacity, APlateUnderASunLetsItsShareThrough) {
    for (float opacity : {0.0f, 0.25f, 0.7f, 1.0f}) {
        Scene scene = floorUnderSun();
        placePlate(scene, veil(opacity));
        const ShotScene shot(scene);
        const double whole = 3 / std::sqrt(1.05);
        EXPECT_NEAR(meanLight(shot.patches, shot.shoot(FirstShotKind::GATHER, 0), 0).value,
                    double(1 - opacity) * whole, 1e-5 * whole)
            << opacity;
    }
}

TEST(Opacity, PlatesMultiply) {
    Scene scene = floorUnderSun();
    placePlate(scene, veil(0.5f), 0.5f);
    placePlate(scene, veil(0.2f), 0.8f);
    const ShotScene shot(scene);
    const double exact = 0.5 * 0.8 * 3 / std::sqrt(1.05);
    EXPECT_NEAR(meanLight(shot.patches, shot.shoot(FirstShotKind::GATHER, 0), 0).value, exact,
                1e-5 * exact);
    // SHOOT uses rays that a plate stops or lets pass. The standard error of 40,000 lines that
    // arrive is known.
    const Mean shotMean = meanLight(shot.patches, shot.shoot(FirstShotKind::SHOOT, 400000), 0);
    EXPECT_NEAR(shotMean.value, exact, 4 * shotMean.error);
    EXPECT_LT(shotMean.error, 0.02 * exact);
}

TEST(Opacity, ABlackVeilTakesItsShareOfTheSky) {
    // Every line from the floor to the sky crosses the dome once. The number of hits is random:
    // about 1e5 lines of the floor in 64 bundles of default lines leave a standard error of 0.3 %.
    for (DirectionKind directions : {DirectionKind::LOW_DISCREPANCY, DirectionKind::RANDOM}) {
        Scene scene;
        place(scene, rectangle("floor", {-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0));
        place(scene, icosphere("dome", 1, 2, true), veil(0.4f), glm::dmat4(1), RB_ROLE_OCCLUDE);
        scene.worldRadiance = glm::vec3(1);
        Bake bake;
        setQuick(bake);
        bake.settings.directions = directions;
        bake.run(scene);
        double mean = 0;
        for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_LIGHTING))
            mean += 0.25 * double(light.x);
        EXPECT_NEAR(mean, 0.6, 0.012) << choiceName(directions);
    }
}

TEST(Opacity, SingleLinesPassAsOften) {
    Scene scene;
    place(scene, rectangle("floor", {-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}), veil(0.25f));
    const Patches patches = subdivide(scene, 10, 1000);
    const Visibility visibility(patches);
    std::vector<LineHit> hits;
    int met = 0;
    for (int k = 0; k < 10000; ++k) {
        visibility.lineHits({0.00004 * k - 0.2, 0.01, 0}, {0, 0, 1}, hits);
        met += int(hits.size());
    }
    // Binomial distribution: the standard deviation is 43.
    EXPECT_NEAR(met, 2500, 4 * 43);
}

TEST(Opacity, AnImageIsAveragedOverPatches) {
    // An image of two by one pixels, white and black, over a plate. It is interpolated bilinearly.
    Scene scene;
    Mesh mesh = rectangle("leaf", {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    for (int32_t v : mesh.cornerVertices) mesh.uvs.push_back(glm::vec2(mesh.vertices[size_t(v)]));
    Material leaf = veil(0.8f, 0.2f);
    leaf.opacityImage =
        scene.addImage({"alpha", 2, 1, RB_IMAGE_EXTEND, {glm::vec3(1.0f), glm::vec3(0.0f)}});
    place(scene, mesh, leaf);
    const Patches patches = subdivide(scene, 0.25f, 1000);
    ASSERT_EQ(patches.count(), 16u);
    EXPECT_FLOAT_EQ(patches.opacity[0], 0.8f);
    // Three quarters of the way along the ramp from 1/4 to 3/4. The mean of its last half is 1/4.
    EXPECT_NEAR(patches.opacity[2], 0.8 * 0.25, 1e-3);
    // The reflectance and the area of a patch are those of its opaque share.
    EXPECT_NEAR(patches.reflectance[0].x, 0.2 / 0.8, 1e-6);
    EXPECT_NEAR(patches.area[0], 0.8 / 16, 1e-6);
    // The patch reflects, so that some lines must meet it.
    EXPECT_GT(patches.opacity[3], 0);
}

TEST(Opacity, ALaterBakeSeesItsChange) {
    Bake bake;
    setQuick(bake);
    for (float opacity : {0.25f, 0.75f}) {
        Scene scene;
        place(scene, rectangle("floor", {-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0));
        place(scene, icosphere("dome", 1, 2, true), veil(opacity), glm::dmat4(1), RB_ROLE_OCCLUDE);
        scene.worldRadiance = glm::vec3(1);
        bake.run(scene);
        EXPECT_NEAR(double(cornerLight(bake, 0, RB_OUTPUT_LIGHTING)[0].x), 1 - double(opacity),
                    0.05);
    }
}

// A lamp of 1 m with a checker of pixels, its front facing down, 2 m above the floor.
Scene floorUnderChecker(int pixels, const glm::vec3& bright) {
    Scene scene;
    place(scene, rectangle("floor", {-0.001f, -0.001f, 0}, {0.002f, 0, 0}, {0, 0.002f, 0}),
          grey("", 0.5f));
    // A black surface far below makes the mean exitance small, so that the lamp becomes a source.
    place(scene, rectangle("ground", {-10, -10, -10}, {20, 0, 0}, {0, 20, 0}), grey("", 0),
          glm::dmat4(1), RB_ROLE_OCCLUDE);
    Mesh mesh = rectangle("lamp", {-0.5f, -0.5f, 2}, {0, 1, 0}, {1, 0, 0});
    for (int32_t v : mesh.cornerVertices)
        mesh.uvs.push_back(glm::vec2(mesh.vertices[size_t(v)]) + 0.5f);
    std::vector<glm::vec3> checker;
    for (int y = 0; y < pixels; ++y)
        for (int x = 0; x < pixels; ++x)
            checker.push_back((x + y) % 2 ? glm::vec3(0.0f) : glm::vec3(1.0f));
    Material lamp = grey("lamp", 0);
    SurfaceColor& emission = lamp.sides[0].emission;
    emission.image = scene.addImage({"checker", pixels, pixels, RB_IMAGE_REPEAT, checker});
    emission.imageWeight = bright;
    place(scene, mesh, lamp, glm::dmat4(1), RB_ROLE_OCCLUDE);
    return scene;
}

TEST(VaryingEmission, ACheckerShinesAsItsMean) {
    // Pixels of 1/16 m on patches of 1/8 m, so that each patch has the mean.
    const Scene scene = floorUnderChecker(16, {600, 300, 100});
    const ShotScene shot(scene, 0.125f);
    const glm::dvec3 lamp[4] = {{-0.5, -0.5, 2}, {0.5, -0.5, 2}, {0.5, 0.5, 2}, {-0.5, 0.5, 2}};
    const double exact = 300 * polygonIrradiance({0, 0, 0}, {0, 0, 1}, lamp, 4) / kPi;
    const FirstShot light = shot.shoot(FirstShotKind::GATHER, 0, 0, 0.002f);
    // At most 256 stratified samples, which leave half a per cent of noise.
    EXPECT_NEAR(meanLight(shot.patches, light, 0).value, exact, 0.01 * exact);
    EXPECT_NEAR(light.emitted.x, 300, 0.1);
    EXPECT_NEAR(light.emitted.z, 50, 0.05);
}

TEST(VaryingEmission, OfARegularCheckerHalfEscapesFromTwoSides) {
    // The number of rays equals the number of pairs of a bright and a dark patch. Rays that go down
    // meet the ground.
    constexpr int kAlong = 256, kAcross = 128;
    Scene scene;
    place(scene, rectangle("ground", {-100, -100, -0.01f}, {200, 0, 0}, {0, 200, 0}), grey("", 0),
          glm::dmat4(1), RB_ROLE_OCCLUDE);
    Mesh mesh = grid("lamp", {0, 0, 0}, {2, 0, 0}, {0, 1, 0}, kAlong, kAcross);
    for (int32_t v : mesh.cornerVertices) {
        const glm::vec3& at = mesh.vertices[size_t(v)];
        mesh.uvs.push_back({at.x / 2, at.y});
    }
    std::vector<glm::vec3> checker;
    for (int y = 0; y < kAcross; ++y)
        for (int x = 0; x < kAlong; ++x) checker.push_back(glm::vec3((x + y) % 2 ? 0.0f : 1.0f));
    Material lamp = grey("lamp", 0);
    const int32_t image =
        scene.addImage({"checker", kAlong, kAcross, RB_IMAGE_REPEAT, std::move(checker)});
    for (MaterialSide& side : lamp.sides) side.emission = {glm::vec3(0.0f), image, glm::vec3(1.0f)};
    place(scene, mesh, lamp);
    const Patches patches = subdivide(scene, 20, kMany);
    ASSERT_GE(patches.count(), size_t(kAlong * kAcross));
    const Visibility visibility(patches);
    for (uint32_t seed = 0; seed < 8; ++seed) {
        const DirectLight light(scene, patches, visibility, seed);
        // Fronts and backs are separate sources of equal power.
        const std::vector<PowerShares> shares = light.powerShares();
        ASSERT_EQ(shares.size(), 2u);
        EXPECT_NEAR(shares[0].escaped.x, 1, 1e-6) << seed;
        EXPECT_NEAR(shares[1].escaped.x, 0, 1e-6) << seed;
    }
}

TEST(VaryingEmission, EachPatchShinesByItself) {
    // Two patches, one bright and one black. The image is constant over each of them.
    Scene scene = floorUnderChecker(2, {600, 600, 600});
    scene.images[0] = {"half", 8, 1, RB_IMAGE_EXTEND, std::vector<glm::vec3>(8, glm::vec3(0.0f))};
    for (size_t x = 0; x < 4; ++x) scene.images[0].pixels[x] = glm::vec3(1.0f);
    const ShotScene shot(scene, 0.5f);
    // The bilinear edge between the halves is a pixel wide and gives each half an eighth of the
    // ramp. The mean over all is a half.
    glm::dvec3 sum(0.0);
    for (uint32_t p = 0; p < shot.patches.count(); ++p)
        sum += double(shot.patches.area[p]) * glm::dvec3(shot.patches.emission[2 * p]);
    EXPECT_NEAR(sum.x, 300, 1);
    // At a point under the lamp's centre each half gives half of the light. With the bright half
    // alone all light comes from one side.
    const glm::dvec3 lamp[4] = {{-0.5, -0.5, 2}, {0, -0.5, 2}, {0, 0.5, 2}, {-0.5, 0.5, 2}};
    const double exact = 600 * polygonIrradiance({0, 0, 0}, {0, 0, 1}, lamp, 4) / kPi;
    EXPECT_NEAR(meanLight(shot.patches, shot.shoot(FirstShotKind::GATHER, 0, 0, 0.002f), 0).value,
                exact, 0.02 * exact);
}

TEST(VaryingEmission, ShotAndGatheredLightHaveTheSameColours) {
    // One half of the lamp is red and dim, the other blue and bright.
    Scene scene = floorUnderChecker(2, {600, 600, 600});
    scene.images[0] = {"half", 8, 1, RB_IMAGE_EXTEND,
                       std::vector<glm::vec3>(8, glm::vec3(0.0f, 0.1f, 1.0f))};
    for (size_t x = 0; x < 4; ++x) scene.images[0].pixels[x] = glm::vec3(0.3f, 0.0f, 0.0f);
    place(scene, rectangle("side", {-2, -1, 0}, {0, 0, 1.5f}, {0, 2, 0}), grey("", 0));
    const ShotScene shot(scene, 0.5f);
    const FirstShot gathered = shot.shoot(FirstShotKind::GATHER, 0, 0, 0.002f);
    const FirstShot sent = shot.shoot(FirstShotKind::SHOOT, 400000);
    const glm::dvec3 a = arriving(shot.patches, gathered), b = arriving(shot.patches, sent);
    // Both have some tenths of a per cent of noise.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(b[c], a[c], 0.02 * a[c]) << "channel " << c;
}

TEST(VaryingEmission, SidesOfOtherColoursAreShotInTheirColours) {
    // A lamp of 1 m between two floors, red below and blue above.
    Scene scene = floorUnderChecker(2, {0, 0, 0});
    Material& lamp = scene.materials[size_t(scene.meshes.back().faceMaterials[0])];
    lamp.sides[0].emission.constant = glm::vec3(50, 100, 0);
    lamp.sides[1].emission.constant = glm::vec3(0, 20, 900);
    place(scene, rectangle("below", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), grey("", 0));
    place(scene, rectangle("above", {-1, -1, 4}, {0, 2, 0}, {2, 0, 0}), grey("", 0));
    const ShotScene shot(scene, 0.5f);
    const glm::dvec3 a = arriving(shot.patches, shot.shoot(FirstShotKind::GATHER, 0, 0, 0.002f));
    const glm::dvec3 b = arriving(shot.patches, shot.shoot(FirstShotKind::SHOOT, 400000));
    // Red gets 4 % of the lines, which leaves half a per cent of noise.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(b[c], a[c], 0.02 * a[c]) << "channel " << c;
}

TEST(VaryingEmission, CornerColoursShineInBundles) {
    // A closed box of reflectance 0.5 that emits 0.5 W/m^2 in the mean, varying over the corners.
    // By reciprocity the mean light is that of uniform emission.
    Scene scene;
    Mesh mesh = box("box", {0, 0, 0}, {1, 1, 1}, true);
    for (int32_t v : mesh.cornerVertices)
        mesh.cornerColors.push_back(glm::vec3(2 * mesh.vertices[size_t(v)].x));
    Material glow = grey("glow", 0.5f);
    glow.sides[0].emission.cornerColorWeight = glm::vec3(0.5f);
    place(scene, mesh, glow);
    Bake bake;
    setQuick(bake);
    bake.run(scene);
    double mean = 0;
    for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_LIGHTING))
        mean += double(light.x) / 24;
    // In the mean B = E + rho H with E = 1/2, so H = 1 W/m^2. The noise of 64 bundles is below 1 %.
    EXPECT_NEAR(mean * kPi, 1, 0.02);
}

}  // namespace
}  // namespace raybundle
