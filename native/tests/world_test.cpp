// SPDX-License-Identifier: GPL-3.0-or-later
//
// The image of the world: its mapping, closed forms and samples, and that every first shot and
// every transport gets the same light from it.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "lights/mesh_outline.h"
#include "lights/receiver_place.h"
#include "lights/world_source.h"
#include "sampling/sphere_sampling.h"
#include "test_bakes.h"
#include "test_scenes.h"
#include "test_shots.h"

namespace raybundle {
namespace {

using namespace test;

// The target of 0.2 % is the standard error of a side. The tolerance is five times that.
constexpr double kFiveErrors = 0.01;

// Returns an image of a radiance by direction, evaluated at the centre of each pixel.
WorldImage painted(int width, int height,
                   const std::function<glm::vec3(const glm::dvec3&)>& radiance) {
    WorldImage image{width, height, {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double phi = kPi * (1 - 2 * (x + 0.5) / width),
                         e = kPi * ((y + 0.5) / height - 0.5);
            image.pixels.push_back(
                radiance({std::cos(e) * std::cos(phi), std::cos(e) * std::sin(phi), std::sin(e)}));
        }
    return image;
}

// A small bright disk in a sky that is brighter at the top, above dim ground.
glm::vec3 sunAndSky(const glm::dvec3& w) {
    const glm::dvec3 sun = glm::normalize(glm::dvec3(1, -2, 1.5));
    if (glm::dot(w, sun) > std::cos(0.02)) return {3000, 2500, 2000};
    return w.z > 0 ? glm::vec3(0.3, 0.5, 0.9) * float(0.5 + w.z) : glm::vec3(0.1f, 0.08f, 0.06f);
}

const glm::vec3 kNormals[] = {{0, 0, 1},           {0, 0, -1},       {1, 0, 0},
                              {0.6f, 0, 0.8f},     {0, -0.8f, 0.6f}, {-0.48f, 0.6f, 0.64f},
                              {0.1f, 0.7f, -0.7f}, {0, 1, 0}};

// Returns the irradiance by the whole image on a surface with this normal, W/m^2.
glm::vec3 unblocked(const WorldSource& world, const glm::vec3& normal) {
    return *world.irradiance({0, 0, 0}, glm::normalize(normal));
}

TEST(WorldImage, HasTheMappingOfCycles) {
    // The middle column is +X, three quarters -Y, a quarter +Y, the border -X, the top row +Z.
    const struct {
        int x, y;
        glm::vec3 direction;
    } kPlaces[] = {{32, 16, {1, 0, 0}},
                   {48, 16, {0, -1, 0}},
                   {16, 16, {0, 1, 0}},
                   {0, 16, {-1, 0, 0}},
                   {10, 31, {0, 0, 1}},
                   {10, 0, {0, 0, -1}},
                   {40, 24, {0.5f, -0.5f, std::sqrt(0.5f)}}};
    for (const auto& place : kPlaces) {
        WorldImage image{64, 32, std::vector<glm::vec3>(64 * 32, glm::vec3(0.0f))};
        image.pixels[size_t(place.y * 64 + place.x)] = glm::vec3(1);
        const WorldSource world(image);
        for (int k = 0; k < 16; ++k) {
            const glm::vec4 u((k % 4 + 0.5f) / 4, (k / 4 + 0.5f) / 4, 0.3f, 0.7f);
            // A pixel spans 0.1 radians. The directions are those of corners of the pixel.
            EXPECT_GT(glm::dot(world.sample({0, 0, 0}, place.direction, {u.x, u.y}).direction,
                               place.direction),
                      std::cos(0.15));
            EXPECT_LT(glm::dot(world.emit(u, 1).direction, place.direction), -std::cos(0.15));
        }
    }
}

TEST(WorldImage, AConstantOneGivesPiTimesItsRadiance) {
    for (int width : {1, 2, 64, 777}) {
        const WorldImage image =
            painted(width, (width + 1) / 2, [](auto&) { return glm::vec3(1, 2, 3); });
        EXPECT_NEAR(image.meanRadiance().y, 2, 1e-5);
        const WorldSource world(image);
        for (const glm::vec3& normal : kNormals) {
            const glm::vec3 found = unblocked(world, normal);
            EXPECT_NEAR(found.x, kPi, 2e-4 * kPi) << width;
            EXPECT_NEAR(found.z, 3 * kPi, 6e-4 * kPi) << width;
        }
    }
}

TEST(WorldImage, AHalfWhiteSphereHasAClosedForm) {
    for (const glm::vec3& towards : kNormals) {
        const glm::dvec3 white = glm::normalize(glm::dvec3(towards));
        const WorldImage image = painted(720, 360, [&](const glm::dvec3& w) {
            return glm::vec3(glm::dot(w, white) > 0 ? 1.0f : 0.0f);
        });
        const WorldSource world(image);
        for (const glm::vec3& normal : kNormals) {
            const double c = glm::dot(glm::normalize(glm::dvec3(normal)), white);
            // The edge follows whole pixels of half a degree.
            EXPECT_NEAR(unblocked(world, normal).x, 0.5 * kPi * (1 + c), 0.005);
        }
    }
}

TEST(WorldImage, IrradianceIsTheIntegralOverItsPixels) {
    constexpr int kWidth = 512, kHeight = 256;
    const WorldImage image = painted(kWidth, kHeight, sunAndSky);
    const WorldSource world(image);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (int k = 0; k < 20; ++k) {
        const glm::dvec3 normal(uniformDirection({uniform(random), uniform(random)}));
        double exact = 0;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const double low = kPi * (double(y) / kHeight - 0.5), step = kPi / kHeight;
                const double solidAngle = 2 * kPi / kWidth * (std::sin(low + step) - std::sin(low));
                double cosine = 0;
                for (int part = 0; part < 4; ++part) {
                    const double e = low + (0.25 + 0.5 * (part / 2)) * step;
                    const double phi = kPi * (1 - 2 * (x + 0.25 + 0.5 * (part % 2)) / kWidth);
                    const glm::dvec3 w(std::cos(e) * std::cos(phi), std::cos(e) * std::sin(phi),
                                       std::sin(e));
                    cosine += 0.25 * std::max(0.0, glm::dot(normal, w));
                }
                exact += solidAngle * cosine * double(image.pixels[size_t(y * kWidth + x)].y);
            }
        EXPECT_NEAR(double(world.irradiance({0, 0, 0}, glm::vec3(normal))->y), exact, 2e-4 * exact);
    }
}

TEST(WorldImage, ABrightPixelIsASun) {
    WorldImage image{512, 256, std::vector<glm::vec3>(512 * 256, glm::vec3(0.0f))};
    const int x = 300, y = 180;
    const double phi = kPi * (1 - 2 * (x + 0.5) / 512), low = kPi * (y / 256.0 - 0.5);
    const double e = low + 0.5 * kPi / 256;
    const glm::dvec3 direction(std::cos(e) * std::cos(phi), std::cos(e) * std::sin(phi),
                               std::sin(e));
    const double solidAngle = 2 * kPi / 512 * (std::sin(low + kPi / 256) - std::sin(low));
    image.pixels[size_t(y * 512 + x)] = glm::vec3(7 / solidAngle, 5 / solidAngle, 3 / solidAngle);

    Scene lit, sunny;
    for (Scene* scene : {&lit, &sunny}) {
        place(*scene, rectangle("ground", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), grey("", 0.5f));
        place(*scene, rectangle("slope", {4, 0, 0}, {1, 0, 1}, {0, 1, 0}), grey("", 0.5f));
        place(*scene, rectangle("wall", {-9, 0, 1}, {0, 3, 0}, {0, 0, 3}), grey("", 0.5f));
    }
    lit.setWorldImage(image);
    sunny.addLight(sunLight(direction, {7, 5, 3}));
    const ShotScene one(lit, 0.25f), other(sunny, 0.25f);
    const FirstShot found = one.shoot(FirstShotKind::GATHER, 0),
                    exact = other.shoot(FirstShotKind::GATHER, 0);
    for (size_t side = 0; side < exact.irradiance.size(); ++side)
        for (int c = 0; c < 3; ++c)
            // The wall's shadow has a soft edge here, far from all receivers.
            ASSERT_NEAR(found.irradiance[side][c], exact.irradiance[side][c], 1e-3) << side;
}

TEST(WorldImage, AnOccluderTakesItsFormFactor) {
    // A small square under a canopy, in a constant world.
    Scene scene;
    place(scene, rectangle("receiver", {-0.001f, -0.001f, 0}, {0.002f, 0, 0}, {0, 0.002f, 0}),
          grey("", 0.5f));
    place(scene, rectangle("canopy", {-0.6f, -0.8f, 0.7f}, {1.5f, 0, 0}, {0, 1.1f, 0}),
          grey("", 0));
    scene.setWorldImage(painted(128, 64, [](auto&) { return glm::vec3(2); }));
    const ShotScene shots(scene);
    const glm::dvec3 canopy[4] = {
        {-0.6, -0.8, 0.7}, {0.9, -0.8, 0.7}, {0.9, 0.3, 0.7}, {-0.6, 0.3, 0.7}};
    const double exact = 2 * (kPi - polygonIrradiance({0, 0, 0}, {0, 0, 1}, canopy, 4));
    const FirstShot shot = shots.shoot(FirstShotKind::GATHER, 0, 0, 0.002f);
    EXPECT_NEAR(shot.irradiance[0].x, exact, kFiveErrors * exact);
    EXPECT_NEAR(shot.irradiance[1].x, 2 * kPi, 1e-3);
    EXPECT_NEAR(shot.irradiance[0].x, exact, 5 * double(shot.error[0]));
}

// Expects samples of a sky with a sun to have its irradiance as their mean, and a variance of less
// than `most` times its square.
void expectSamplesFollow(LightSample (WorldSource::*sample)(const glm::vec3&, const glm::vec3&,
                                                            glm::vec2) const,
                         double most) {
    const WorldImage image = painted(1024, 512, sunAndSky);
    const WorldSource world(image);
    EXPECT_LT(world.regionCount(), 40000u);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0, 1);
    constexpr int kCount = 20000;
    for (const glm::vec3& direction : kNormals) {
        const glm::vec3 normal = glm::normalize(direction);
        const double exact = world.irradiance({0, 0, 0}, normal)->y;
        double mean = 0, squares = 0, flat = 0;
        for (int k = 0; k < kCount; ++k) {
            const double value =
                (world.*sample)({0, 0, 0}, normal, {uniform(random), uniform(random)}).irradiance.y;
            mean += value / kCount;
            squares += value * value / kCount;
            const glm::vec3 any = uniformDirection({uniform(random), uniform(random)});
            const double other =
                4 * kPi * double(std::max(0.0f, glm::dot(any, normal))) * double(sunAndSky(any).y);
            flat += other * other / kCount;
        }
        const double variance = squares - mean * mean;
        EXPECT_NEAR(mean, exact, 4 * std::sqrt(variance / kCount) + 1e-4 * exact);
        EXPECT_LT(variance, most * exact * exact) << normal.x << " " << normal.y << " " << normal.z;
        if (glm::dot(glm::dvec3(normal), glm::dvec3(1, -2, 1.5)) > 0.3) {
            EXPECT_LT(variance, 0.002 * (flat - exact * exact));
        }
    }
}

TEST(WorldImage, SamplesFollowTheProductOfLightAndCosine) {
    // The variance has two causes: samples follow the sum of the channels, and the pixels at the
    // horizon.
    expectSamplesFollow(&WorldSource::sample, 0.06);
}

TEST(WorldImage, SamplesAloneFollowItAboutAsWell) {
    // Large regions that the horizon cuts count as flat pieces. It is 0.34 where little of the sky
    // is left.
    expectSamplesFollow(&WorldSource::sampleAlone, 0.4);
}

TEST(WorldImage, IsOutOfSightWhereItIsBlack) {
    const WorldSource world(
        painted(256, 128, [](const glm::dvec3& w) { return glm::vec3(w.z > 0.5 ? 1.0f : 0.0f); }));
    auto isOutOfSight = [&](const glm::vec3& normal) {
        return world.isOutOfSight({glm::vec3(0.0f), glm::normalize(normal)});
    };
    EXPECT_TRUE(isOutOfSight({0, 0, -1}));
    EXPECT_FALSE(isOutOfSight({1, 0, 0}));
    EXPECT_FALSE(isOutOfSight({1, 0, -1}));
    EXPECT_TRUE(isOutOfSight({1, 0, -2}));
}

// A house on the ground, under an image.
Scene houseUnder(const WorldImage& image) {
    Scene scene;
    place(scene, rectangle("ground", {-3, -3, 0}, {6, 0, 0}, {0, 6, 0}), grey("", 0.5f));
    place(scene, box("house", {-0.5f, -0.5f, 0.01f}, {0.5f, 0.5f, 1}, false), grey("", 0.8f));
    scene.setWorldImage(image);
    return scene;
}

TEST(WorldImage, EveryFirstShotBringsTheSame) {
    const ShotScene house(houseUnder(painted(256, 128, sunAndSky)), 0.5f);
    const FirstShot exact = house.shoot(FirstShotKind::GATHER, 0, 0, 0.002f);
    for (FirstShotKind kind : {FirstShotKind::SHOOT, FirstShotKind::EXTENDED}) {
        const FirstShot shot = house.shoot(kind, 1 << 19);
        for (int c = 0; c < 3; ++c) {
            double found = 0, wanted = 0, variance = 0;
            for (size_t side = 0; side < exact.irradiance.size(); ++side) {
                const double area = double(house.patches.area[side / 2]);
                found += area * double(shot.irradiance[side][c]);
                wanted += area * double(exact.irradiance[side][c]);
                variance += std::pow(area * double(shot.error[side]), 2);
            }
            EXPECT_NEAR(found, wanted, 4 * std::sqrt(variance) + 0.002 * wanted)
                << choiceName(kind) << c;
        }
        EXPECT_NEAR(shot.emitted.z, arriving(house.patches, shot).z, 1e-6 * shot.emitted.z);
    }
}

// Returns the mean of an output over the corners of the house, W/(m^2 sr).
glm::dvec3 meanOf(const Bake& bake, rb_output output) {
    glm::dvec3 mean(0.0);
    const std::vector<glm::vec3> light = cornerLight(bake, 1, output);
    for (const glm::vec3& v : light) mean += glm::dvec3(v) / double(light.size());
    return mean;
}

TEST(WorldImage, AConstantOneEqualsTheConstantWorld) {
    const glm::vec3 radiance(0.5f, 0.7f, 1);
    const Scene image = houseUnder(painted(64, 32, [&](auto&) { return radiance; }));
    Scene constant = image;
    constant.worldImage = {};
    constant.worldRadiance = radiance;
    Bake one, other;
    one.settings.targetError = 0.005f;
    other.settings.targetError = 0.002f;  // errors of bundles are common to all corners
    one.run(image);
    other.run(constant);
    const glm::dvec3 light = meanOf(other, RB_OUTPUT_LIGHTING);
    for (rb_output output : {RB_OUTPUT_DIRECT, RB_OUTPUT_INDIRECT, RB_OUTPUT_LIGHTING}) {
        const glm::dvec3 a = meanOf(one, output), b = meanOf(other, output);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 0.005 * light[c]) << output;
    }
    EXPECT_LT(reportOf(one)["energy"]["balance_error"].get<double>(), 1e-3);
    EXPECT_NEAR(reportOf(one)["energy"]["absorbed"].get<double>(),
                reportOf(other)["energy"]["absorbed"].get<double>(),
                0.005 * reportOf(other)["energy"]["absorbed"].get<double>());
}

TEST(WorldImage, EveryTransportCarriesItsLight) {
    const Scene scene = houseUnder(painted(256, 128, sunAndSky));
    Bake reference;
    setQuick(reference, 512);
    reference.run(scene);
    const glm::dvec3 exact = meanOf(reference, RB_OUTPUT_COMBINED);
    EXPECT_GT(meanOf(reference, RB_OUTPUT_INDIRECT).x, 0.02 * exact.x);
    for (Solver solver : {Solver::MULTIPATH, Solver::STOCHASTIC_ITERATION, Solver::RANDOM_WALK}) {
        Bake bake;
        setQuick(bake, 512);
        bake.settings.solver = solver;
        bake.settings.directions = DirectionKind::RANDOM;
        bake.run(scene);
        const glm::dvec3 found = meanOf(bake, RB_OUTPUT_COMBINED);
        // Most of the light is direct. The rest has up to 5 % of noise.
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(found[c], exact[c], 0.02 * exact[c]) << choiceName(solver);
        EXPECT_LT(reportOf(bake)["energy"]["balance_error"].get<double>(), 0.02)
            << choiceName(solver);
    }
}

TEST(WorldImage, KeepsTheLinesOfTheBakeBefore) {
    Scene scene = houseUnder(painted(64, 32, sunAndSky));
    Bake bake;
    setQuick(bake);
    bake.run(scene);
    const glm::dvec3 before = meanOf(bake, RB_OUTPUT_COMBINED);
    for (glm::vec3& pixel : scene.worldImage.pixels) pixel *= 2;
    bake.run(scene);
    EXPECT_TRUE(skips(reportOf(bake), SkippedWork::UNCHANGED_GEOMETRY));
    EXPECT_NEAR(meanOf(bake, RB_OUTPUT_COMBINED).x, 2 * before.x, 1e-3 * before.x);
}

TEST(WorldImage, ABlackOneIsDark) {
    Bake bake;
    bake.run(houseUnder(painted(4, 2, [](auto&) { return glm::vec3(0); })));
    EXPECT_TRUE(warns(reportOf(bake), WarningId::NO_LIGHT));
}

TEST(WorldSource, IsMadeOncePerImageWhileItIsHeld) {
    WorldImage image = painted(128, 64, sunAndSky);
    const auto held = worldSource(image);
    EXPECT_EQ(worldSource(image), held);
    WorldImage changed = image;
    changed.pixels[128 * 60 + 77].y += 0.5f;
    auto other = worldSource(changed);
    EXPECT_NE(other->irradiance({0, 0, 0}, {0, 0, 1}), held->irradiance({0, 0, 0}, {0, 0, 1}));
    EXPECT_NE(other->shape, held->shape);
    EXPECT_EQ(worldSource(changed), other);
    // Of the same number of pixels, but of another shape.
    changed.width = 64;
    changed.height = 128;
    EXPECT_NE(worldSource(changed)->shape, other->shape);
    const std::weak_ptr<const WorldSource> last = other = worldSource(image);
    EXPECT_FALSE(last.expired());
    other.reset();
    EXPECT_TRUE(last.expired());
}

}  // namespace
}  // namespace raybundle
