// SPDX-License-Identifier: GPL-3.0-or-later
//
// The directions in which surfaces that are not Lambert's send light: the light that the walls of a
// black room get from its floor, and the light that passes between its floor and a white ceiling,
// against the published models.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "bake/bake.h"
#include "test_bakes.h"
#include "test_bsdfs.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// -------------------------------------------------------------------------------------------------
// A black unit cube. A sun that nothing blocks lights its floor.
// -------------------------------------------------------------------------------------------------

constexpr double kSunCosine = 0.6;
// Of the floor. It mirrors light from all directions as much as light along the normal.
constexpr float kMirrored = 0.3f, kReflected = 0.5f, kRoughness = 0.6f;

Scene studio(bool isBurley = false) {
    Scene scene;
    Material paint = grey("paint", kReflected);
    if (isBurley) {
        paint.sides[0].scattering.diffuseModel = RB_DIFFUSE_BURLEY;
        paint.sides[0].scattering.diffuseRoughness = 1;
    } else {
        paint.sides[0].scattering.glossScale = glm::vec3(kMirrored / kReflected);
        paint.sides[0].scattering.glossRoughness = kRoughness;
    }
    const Material black = grey("black", 0);
    place(scene, rectangle("floor", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), paint);
    place(scene, rectangle("behind", {0, 0, 0}, {0, 1, 0}, {0, 0, 1}), black);
    place(scene, rectangle("ahead", {1, 0, 0}, {0, 0, 1}, {0, 1, 0}), black);
    place(scene, rectangle("right", {0, 0, 0}, {0, 0, 1}, {1, 0, 0}), black);
    place(scene, rectangle("left", {0, 1, 0}, {1, 0, 0}, {0, 0, 1}), black);
    place(scene, rectangle("ceiling", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}), black);
    // The sun shines from behind, so that its light is mirrored forwards.
    Light sun = sunLight({-std::sqrt(1 - kSunCosine * kSunCosine), 0, kSunCosine}, glm::dvec3(1));
    sun.castsShadows = false;
    scene.addLight(sun);
    return scene;
}

// Returns the floor's exitance towards a direction, relative to its reflectance times its
// irradiance.
std::function<double(const glm::dvec3&)> sentBy(bool isBurley) {
    const glm::dvec3 in(-std::sqrt(1 - kSunCosine * kSunCosine), 0, kSunCosine);
    const Bsdf bsdf = isBurley ? burley(1) : ggx(kRoughness, 1);
    const double share = isBurley ? 1 : double(kMirrored / kReflected), mean = moments(bsdf, in).x;
    return [=](const glm::dvec3& out) { return 1 - share + share * kPi * bsdf(in, out) / mean; };
}

// Returns the wall of the cube (axis, and whether it is the upper one) in which a ray from inside
// ends.
std::pair<int, bool> wallAhead(const glm::dvec3& point, const glm::dvec3& direction) {
    int wall = 0;
    double nearest = INFINITY;
    for (int axis = 0; axis < 3; ++axis) {
        const double distance = ((direction[axis] > 0 ? 1 : 0) - point[axis]) / direction[axis];
        if (direction[axis] != 0 && distance < nearest) {
            nearest = distance;
            wall = axis;
        }
    }
    return {wall, direction[wall] > 0};
}

class Studio : public testing::TestWithParam<bool> {};

TEST_P(Studio, GoesWhereTheModelSendsIt) {
    // The share of the floor's light that reaches the wall of each instance after the floor.
    constexpr int kPoints = 24, kDirections = 96;
    std::array<double, 6> expected{};
    const auto sent = sentBy(GetParam());
    forCosine(kDirections, [&](const glm::dvec3& out, double share) {
        const double power = share * sent(out) / (kPoints * kPoints);
        for (int i = 0; i < kPoints; ++i)
            for (int j = 0; j < kPoints; ++j) {
                const auto [axis, isUpper] =
                    wallAhead({(i + 0.5) / kPoints, (j + 0.5) / kPoints, 0}, out);
                const size_t instance = axis == 2 ? 5 : size_t(1 + 2 * axis + isUpper);
                expected[instance] += power;
            }
    });
    const Scene scene = studio(GetParam());
    Bake bake;
    bake.settings.patchSize = 0.1f;
    bake.settings.targetError = 0.003f;
    bake.run(scene);
    std::array<double, 6> found{};
    const Patches& patches = bake.patches();
    for (uint32_t side = 0; side < patches.sideCount(); side += 2)
        found[patches.parentAt(side).instance] +=
            double(patches.area[side / 2] * bake.patchIrradiance().indirect[side].x);
    for (size_t instance = 1; instance < 6; ++instance)
        // Relative to all light that the floor reflects. The noise on a wall is 0.2 %. In addition,
        // patches send their light from their centres.
        EXPECT_NEAR(found[instance] / (double(kReflected) * kSunCosine), expected[instance], 0.005)
            << instance;
    EXPECT_NEAR(expected[1] + expected[2] + expected[3] + expected[4] + expected[5], 1, 0.003);
    // By Lambert's law the two walls would get equal light.
    EXPECT_GT(std::abs(expected[1] - expected[2]), GetParam() ? 0.015 : 0.25);
    EXPECT_LT(reportOf(bake)["energy"]["balance_error"].get<double>(), 2e-3);
}

TEST_P(Studio, IsGatheredAtPointsToo) {
    const auto sent = sentBy(GetParam());
    const Scene scene = studio(GetParam());
    Bake bake;
    bake.settings.patchSize = 1;
    bake.settings.targetError = 0.005f;
    bake.settings.reconstruction = Reconstruction::POINT;
    bake.run(scene);
    double most = 0, worst = 0;
    for (int32_t instance = 1; instance < 6; ++instance) {
        const Mesh& mesh = scene.meshes[size_t(scene.instances[size_t(instance)].mesh)];
        const glm::dvec3 middle =
            glm::dvec3(mesh.vertices[0] + mesh.vertices[1] + mesh.vertices[2] + mesh.vertices[3]) /
            4.0;
        const glm::dvec3 normal = glm::round(2.0 * (glm::dvec3(0.5) - middle));
        const glm::dvec3 x(normal.z, normal.x, normal.y), y = glm::cross(normal, x);
        const auto found = cornerLight(bake, instance, RB_OUTPUT_INDIRECT);
        for (size_t corner = 0; corner < 4; ++corner) {
            const glm::dvec3 at(mesh.vertices[size_t(mesh.cornerVertices[corner])]);
            const glm::dvec3 point = at + 1e-6 * (middle - at);
            double light = 0;
            forCosine(256, [&](const glm::dvec3& d, double share) {
                const glm::dvec3 direction = d.x * x + d.y * y + d.z * normal;
                const auto [axis, isUpper] = wallAhead(point, direction);
                if (axis == 2 && !isUpper) light += share * sent(-direction);
            });
            const double expected = double(kReflected) * kSunCosine * light / kPi;
            most = std::max(most, expected);
            worst = std::max(worst, std::abs(double(found[corner].x) - expected));
        }
    }
    // The noise of the final gather is 0.3 % of the mean light (kNoiseShare of the target). This
    // mean includes the direct light, of which the indirect light is a tenth.
    EXPECT_LT(worst, 0.04 * most);
}

INSTANTIATE_TEST_SUITE_P(, Studio, testing::Bool(),
                         [](const auto& model) { return model.param ? "Burley" : "Gloss"; });

// The cube again. A sun from below, which nothing blocks, lights only the ceiling, which is white.
struct UpAndDown {
    double ceiling = 0, floor = 0;  // mean indirect irradiance, W/m^2
};

UpAndDown upAndDown(double whiteness, double reflectance, double share, const Bsdf& bsdf) {
    constexpr int kEdge = 10, kCount = kEdge * kEdge;
    constexpr double kArea = 1.0 / kCount;
    auto way = [&](int floor, int ceiling) {
        return glm::dvec3(double(ceiling % kEdge - floor % kEdge) / kEdge,
                          double(ceiling / kEdge - floor / kEdge) / kEdge, 1);
    };
    // The form factors are scaled, because that of opposite faces of a cube is known and the sum
    // over these cells is 0.3 % too large.
    double scale = 1;
    auto factor = [&](const glm::dvec3& d) {
        return scale * kArea / (kPi * std::pow(glm::dot(d, d), 2));
    };
    double all = 0;
    for (int f = 0; f < kCount; ++f)
        for (int c = 0; c < kCount; ++c) all += kArea * factor(way(f, c));
    scale = 0.199825 / all;
    // The mean exitance depends only on the cosine of the direction, and is taken from a table.
    std::vector<double> means;
    for (int i = 0; i <= 100; ++i) {
        double sum = 0;
        forCosine(100, [&](const glm::dvec3& out, double part) {
            sum += part * kPi * bsdf(inclined(0.5 + 0.005 * i), out);
        });
        means.push_back(sum);
    }
    // Form factors from the ceiling over the floor to the ceiling.
    std::vector<double> back(kCount * kCount);
    for (int f = 0; f < kCount; ++f)
        for (int from = 0; from < kCount; ++from) {
            const glm::dvec3 in = glm::normalize(way(f, from));
            const double mean = means[size_t(std::lround((in.z - 0.5) / 0.005))];
            for (int to = 0; to < kCount; ++to) {
                const glm::dvec3 out = glm::normalize(way(f, to));
                back[size_t(to * kCount + from)] +=
                    factor(way(f, from)) * factor(way(f, to)) * reflectance *
                    (1 - share + share * kPi * bsdf(in, out) / mean);
            }
        }
    std::vector<double> sent(kCount, whiteness), light(kCount);
    for (int bounce = 0; bounce < 8; ++bounce) {
        for (int to = 0; to < kCount; ++to) {
            light[size_t(to)] = 0;
            for (int from = 0; from < kCount; ++from)
                light[size_t(to)] += back[size_t(to * kCount + from)] * sent[size_t(from)];
        }
        for (int k = 0; k < kCount; ++k) sent[size_t(k)] = whiteness * (1 + light[size_t(k)]);
    }
    UpAndDown mean;
    for (int c = 0; c < kCount; ++c) {
        mean.ceiling += kArea * light[size_t(c)];
        for (int f = 0; f < kCount; ++f) mean.floor += kArea * factor(way(f, c)) * sent[size_t(c)];
    }
    return mean;
}

void runFinely(Bake& bake, const Scene& scene, int seed) {
    bake.settings.patchSize = 0.1f;
    bake.settings.targetError = 0.003f;
    bake.settings.seed = seed;
    bake.run(scene);
}

TEST_P(Studio, SendsOnWhatOthersSentIt) {
    constexpr float kWhiteness = 0.8f;
    Scene scene = studio(GetParam());
    scene.materials.back() = grey("white", kWhiteness);
    scene.lights.clear();
    Light sun = sunLight({0, 0, -1}, glm::dvec3(1));
    sun.castsShadows = false;
    scene.addLight(sun);
    constexpr int kSeeds = 4;
    UpAndDown found;
    for (int seed = 0; seed < kSeeds; ++seed) {
        Bake bake;
        runFinely(bake, scene, seed);
        const Patches& patches = bake.patches();
        for (uint32_t side = 0; side < patches.sideCount(); side += 2) {
            const uint32_t instance = patches.parentAt(side).instance;
            const double power =
                double(patches.area[side / 2] * bake.patchIrradiance().indirect[side].x) / kSeeds;
            if (instance == 0) found.floor += power;
            if (instance == 5) found.ceiling += power;
        }
    }
    const Bsdf bsdf = GetParam() ? burley(1) : ggx(kRoughness, 1);
    const double share = GetParam() ? 1 : double(kMirrored / kReflected);
    const UpAndDown expected = upAndDown(double(kWhiteness), double(kReflected), share, bsdf);
    const UpAndDown ofLambert = upAndDown(double(kWhiteness), double(kReflected), 0, bsdf);
    const double bent = expected.ceiling - ofLambert.ceiling;
    // The ceiling gets little light, and each seed has 0.7 % of noise there from the few lines that
    // represent all. The tolerance is three times the noise of the mean. With all lines the cells
    // of directions are 0.2 % (gloss) and 0.8 % (Burley) off.
    EXPECT_NEAR(found.floor, expected.floor, 0.005 * expected.floor);
    EXPECT_NEAR(found.ceiling, expected.ceiling, 0.012 * expected.ceiling);
    EXPECT_GT(std::abs(bent), 0.03 * expected.ceiling);
}

// Returns the share of the floor's light that goes to the wall behind, in the cube without its
// front wall under a uniform sky. At each angle the floor mirrors more or less than its mean as GGX
// does, and reflects the remainder diffusely.
double skyToWallBehind(double share, const Bsdf& bsdf) {
    constexpr int kPoints = 12, kDirections = 32;
    std::vector<glm::dvec3> directions;
    std::vector<double> shares, means;
    forCosine(kDirections, [&](const glm::dvec3& direction, double part) {
        // Directions of equal angle follow each other.
        const bool isNew = directions.empty() || direction.z != directions.back().z;
        means.push_back(isNew ? moments(bsdf, direction).x : means.back());
        directions.push_back(direction);
        shares.push_back(part);
    });
    const size_t n = directions.size();
    const double mean = std::inner_product(means.begin(), means.end(), shares.begin(), 0.0);
    std::vector<double> sent(n * n);
    for (size_t in = 0; in < n; ++in)
        for (size_t out = 0; out < n; ++out)
            sent[in * n + out] =
                1 + share * (kPi * bsdf(directions[in], directions[out]) - means[in]) / mean;
    double all = 0, toWall = 0;
    for (int k = 0; k < kPoints * kPoints; ++k) {
        const glm::dvec3 point((k % kPoints + 0.5) / kPoints, (k / kPoints + 0.5) / kPoints, 0);
        std::vector<std::pair<int, bool>> ahead(n);
        for (size_t i = 0; i < n; ++i) ahead[i] = wallAhead(point, directions[i]);
        for (size_t in = 0; in < n; ++in)
            for (size_t out = 0; out < n && ahead[in] == std::pair(0, true); ++out) {
                const double power = shares[in] * shares[out] * sent[in * n + out];
                all += power;
                if (ahead[out] == std::pair(0, false)) toWall += power;
            }
    }
    return toWall / all;
}

TEST_P(Studio, SendsOnAnEvenSky) {
    Scene scene = studio(GetParam());
    scene.lights.clear();
    scene.instances.erase(scene.instances.begin() + 2);
    scene.worldRadiance = glm::vec3(1);
    constexpr int kSeeds = 4;
    double reflected = 0, toWall = 0;
    for (int seed = 0; seed < kSeeds; ++seed) {
        Bake bake;
        runFinely(bake, scene, seed);
        const Patches& patches = bake.patches();
        const Irradiance& light = bake.patchIrradiance();
        for (uint32_t side = 0; side < patches.sideCount(); side += 2) {
            const double area = double(patches.area[side / 2]);
            const uint32_t instance = patches.parentAt(side).instance;
            if (instance == 0)
                reflected += double(kReflected) * area * double(light.direct[side].x);
            if (instance == 1) toWall += area * double(light.indirect[side].x);
        }
    }
    const Bsdf bsdf = GetParam() ? burley(1) : ggx(kRoughness, 1);
    const double share = GetParam() ? 1 : double(kMirrored / kReflected);
    const double expected = skyToWallBehind(share, bsdf);
    // Each seed has 0.8 % of noise from the lines that represent all. With all lines, patches of
    // 0.1 m and cells of directions are 1.8 % off, patches of 0.05 m 0.3 %. The cells do not
    // resolve the rise of Burley's model at grazing angles: 0.003.
    EXPECT_NEAR(toWall / reflected, expected, 0.005);
    EXPECT_GT(std::abs(expected - skyToWallBehind(0, bsdf)), GetParam() ? 0.005 : 0.05);
}

TEST(DirectedLight, IsTheSameAfterLightsAndPaintWereChanged) {
    auto make = [](bool hasGloss, double red) {
        Scene scene = studio();
        if (!hasGloss) scene.materials.front().sides[0].scattering = {};
        scene.lights.front().strength.x = red;
        Light other = sunLight({0.6, 0, 0.8}, glm::dvec3(1));
        other.castsShadows = false;
        scene.addLight(other);
        return scene;
    };
    Bake again, fresh;
    setQuick(again);
    setQuick(fresh);
    fresh.run(make(true, 2));
    again.run(make(false, 1));
    again.run(make(true, 1));
    again.run(make(true, 2));
    EXPECT_TRUE(skips(reportOf(again), SkippedWork::SCALED_LIGHTS));
    EXPECT_LT(difference(everything(again), everything(fresh)), 1e-5);
    again.run(make(false, 2));
    EXPECT_GT(difference(everything(again), everything(fresh)), 1e-2);
}

// No surface is brighter than the sky that lights it. The scene consists of slits between glossy
// boards that reflect all light, as far as a scene allows.
TEST(GlossyBoards, GetNoMoreThanTheSky) {
    Scene scene;
    Material paint = grey("paint", 1);
    paint.sides[0].scattering.glossOffset = glm::vec3(0.2f);
    paint.sides[0].scattering.glossRoughness = 0.5f;
    constexpr int kBoards = kFewBakes ? 2 : 5;
    for (int k = 0; k < kBoards; ++k) {
        const float x = 0.072f * float(k);
        place(scene, box("board", {x, 0, 0}, {x + 0.07f, 0.22f, 0.3f}, false), paint);
    }
    scene.worldRadiance = glm::vec3(1);
    for (int seed = 0; seed < (kFewBakes ? 1 : 2); ++seed) {
        Bake bake;
        bake.settings.seed = seed;
        bake.settings.minBundles = bake.settings.maxBundles = 64;
        bake.run(scene);
        double most = 0;
        for (int32_t k = 0; k < kBoards; ++k)
            for (const glm::vec3& light : cornerLight(bake, k, RB_OUTPUT_LIGHTING))
                most = std::max(most, double(light.x));
        // Values fitted to corners may exceed the light that they are fitted to. A bug by which
        // directed light created power made this 2.2 and 2.6.
        EXPECT_LT(most, 1.05);
    }
}

}  // namespace
}  // namespace raybundle
