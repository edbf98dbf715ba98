// SPDX-License-Identifier: GPL-3.0-or-later
//
// Results at some corners only (rb_set_result_corners). Their light equals that in a bake with
// results at all corners, for less work.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <glm/gtc/matrix_transform.hpp>

#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

constexpr int32_t kBall = 0;

// A ball of small faces above a ground, under a sun and a sky with clouds.
Scene ballInTheOpen(int subdivisions = 3, rb_role ofGround = RB_ROLE_BAKE) {
    Scene scene;
    place(scene, icosphere("ball", 0.5f, subdivisions, false), grey("ball", 0.6f),
          glm::translate(glm::dmat4(1), {0, 0, 0.7}));
    place(scene, grid("ground", {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 16, 16), grey("ground", 0.6f),
          glm::dmat4(1), ofGround);
    scene.addLight(sunLight({0.3, 0.2, 1}, glm::dvec3(2), 0.05));
    WorldImage sky{32, 16, {}};
    for (int k = 0; k < sky.width * sky.height; ++k)
        sky.pixels.emplace_back(k % 5 < 2 && k >= sky.width * 8 ? 2.0f : 0.1f);
    scene.setWorldImage(std::move(sky));
    return scene;
}

// Returns one corner of every 16th vertex, as if each face had been divided into sixteen.
std::vector<int32_t> someCorners(const Mesh& mesh) {
    std::vector<int32_t> corners;
    std::vector<bool> isDone(mesh.vertices.size());
    for (size_t c = 0; c < mesh.cornerCount(); ++c) {
        const size_t vertex = size_t(mesh.cornerVertices[c]);
        if (vertex % 16 || isDone[vertex]) continue;
        isDone[vertex] = true;
        corners.push_back(int32_t(c));
    }
    return corners;
}

std::vector<glm::vec3> lightAt(const Bake& bake, const std::vector<int32_t>& corners) {
    const std::vector<glm::vec3> all = cornerLight(bake, kBall, RB_OUTPUT_LIGHTING);
    std::vector<glm::vec3> some;
    for (int32_t corner : corners) some.push_back(all[size_t(corner)]);
    return some;
}

class ResultCorners : public testing::TestWithParam<Reconstruction> {};

TEST_P(ResultCorners, HaveTheLightThatTheyHaveAmongAllForFewerRays) {
    Scene scene = ballInTheOpen();
    Bake whole, part, fine;
    for (Bake* bake : {&whole, &part, &fine}) {
        bake->settings.reconstruction = GetParam();
        bake->settings.maxPatches = 4000;
    }
    // Without the extra rays of noisy sides, which are cast only from sides whose own light is
    // shown.
    const bool isOfPatches = GetParam() == Reconstruction::LEAST_SQUARES;
    for (Bake* bake : {&whole, &part})
        if (isOfPatches) bake->settings.maxBundles = bake->settings.minBundles;
    // All corners show the light of patches, although the ball is dense.
    if (isOfPatches) whole.settings.finalGather = 0;
    whole.run(scene);
    fine.settings.targetError = 0.008f;
    fine.settings.seed = 1;
    fine.run(scene);
    const std::vector<int32_t> corners = someCorners(scene.meshes[0]);
    scene.setResultCorners(kBall, corners.data(), corners.size());
    part.run(scene);

    const std::vector<glm::vec3> right = lightAt(fine, corners);
    // The RMS over 40 vertices varies by a ninth. One of two RMS values is 1.5 times the other in
    // one of 200 pairs.
    const double ofPart = noise(lightAt(part, corners), right),
                 ofWhole = noise(lightAt(whole, corners), right);
    std::printf("[ figures  ] %s: noise %.4f, of all %.4f\n", choiceName(GetParam()), ofPart,
                ofWhole);
    EXPECT_LT(ofPart, 1.5 * ofWhole + 0.01);
    const Json less = reportOf(part), more = reportOf(whole);
    const double fewer = less["shadow_rays"].get<double>() / more["shadow_rays"].get<double>();
    // With LEAST_SQUARES the bake with all results has the light of patches, while these few
    // corners gather their light: with as many rays, but less than half the noise. Rays count by
    // the square of the noise.
    if (isOfPatches)
        EXPECT_LT(fewer * std::pow(ofPart / ofWhole, 2), 0.7);
    else
        EXPECT_LT(fewer, 0.7);
    EXPECT_LE(less["bundles"].get<int>(), more["bundles"].get<int>());
    EXPECT_TRUE(skips(less, SkippedWork::UNWANTED_CORNERS));
    EXPECT_FALSE(skips(more, SkippedWork::UNWANTED_CORNERS));
}

INSTANTIATE_TEST_SUITE_P(Of, ResultCorners,
                         testing::Values(Reconstruction::LEAST_SQUARES, Reconstruction::POINT,
                                         Reconstruction::AREA_AVERAGE),
                         [](const auto& test) { return choiceName(test.param); });

// Returns one corner of each vertex of a ball with 80 faces. These are the first vertices of finer
// balls.
std::vector<int32_t> cornersOfCoarseBall(const Mesh& mesh) {
    constexpr size_t kVertices = 42;
    std::vector<int32_t> corners(kVertices, -1);
    for (size_t c = 0; c < mesh.cornerCount(); ++c)
        if (const size_t vertex = size_t(mesh.cornerVertices[c]); vertex < kVertices)
            corners[vertex] = int32_t(c);
    return corners;
}

// A ball that is subdivided `subdivisions` times, with results at the vertices of the coarse ball.
struct SubdividedBall {
    explicit SubdividedBall(int subdivisions, float target = 0.02f, int seed = 0) {
        Scene scene = ballInTheOpen(subdivisions, RB_ROLE_OCCLUDE);
        const std::vector<int32_t> corners = cornersOfCoarseBall(scene.meshes[kBall]);
        scene.setResultCorners(kBall, corners.data(), corners.size());
        bake.settings.targetError = target;
        bake.settings.seed = seed;
        bake.run(scene);
        light = lightAt(bake, corners);
    }
    Bake bake;
    std::vector<glm::vec3> light;
};

TEST(ResultCorners, OfAFinerMeshAreAsRightForNoMoreBundles) {
    // Chords of the coarser ball, of 1280 faces, lie 1 % of its radius inside the finer ball of
    // 20,480 faces.
    constexpr double kShape = 0.01;
    const SubdividedBall right(5, 0.004f, 1), coarse(3), fine(5);
    EXPECT_LT(noise(coarse.light, right.light), 0.02 + kShape);
    EXPECT_LT(noise(fine.light, right.light), 0.02);
    const Json less = reportOf(coarse.bake), more = reportOf(fine.bake);
    EXPECT_TRUE(skips(more, SkippedWork::SPARSE_CORNERS));
    EXPECT_LE(more["bundles"].get<int>(), 2 * less["bundles"].get<int>());
}

TEST(ResultCorners, StateTheNoiseOfWhatTheyGather) {
    std::vector<std::vector<glm::vec3>> bakes;
    double stated = 0;
    constexpr int kSeeds = 6;
    for (int seed = 0; seed < kSeeds; ++seed) {
        const SubdividedBall ball(4, 0.02f, seed);
        bakes.push_back(ball.light);
        stated += reportOf(ball.bake)["objects"][0]["error"]["noise"].get<double>() / kSeeds;
    }
    double squares = 0, signal = 0;
    for (size_t k = 0; k < bakes[0].size(); ++k) {
        glm::dvec3 mean(0.0);
        for (const auto& light : bakes) mean += glm::dvec3(light[k]) / double(kSeeds);
        signal += glm::dot(mean, mean);
        for (const auto& light : bakes) {
            const glm::dvec3 d = glm::dvec3(light[k]) - mean;
            squares += glm::dot(d, d) / (kSeeds - 1);
        }
    }
    const double found = std::sqrt(squares / signal);
    std::printf("[ figures  ] stated %.4f, found %.4f\n", stated, found);
    // The stated noise is an upper bound. At shadow edges it is as large as the noise, but samples
    // of smooth light like this converge faster.
    EXPECT_LT(found, stated);
    EXPECT_LT(stated, 0.03);
}

TEST(ResultCorners, OfAFurnaceAreExact) {
    Scene scene = closedCube(0.5f, 1);
    const int32_t corners[] = {0, 9};
    scene.setResultCorners(0, corners, 2);
    Bake bake;
    setQuick(bake);
    bake.run(scene);
    const std::vector<glm::vec3> light = cornerLight(bake, 0, RB_OUTPUT_LIGHTING);
    for (int32_t corner : corners) EXPECT_NEAR(light[size_t(corner)].x, 2 / kPi, 1e-3);
    const Json error = reportOf(bake)["objects"][0]["error"];
    EXPECT_LT(error["total"].get<double>(), 1e-3);
}

TEST(ResultCorners, CountAloneInTheStatedError) {
    // One half of the ground has a shadow edge. The other, distant half is lit as evenly as
    // possible.
    Scene scene;
    place(scene, grid("ground", {-8, -1, 0}, {16, 0, 0}, {0, 2, 0}, 16, 2), grey("ground", 0.5f));
    place(scene, box("post", {-7, -0.2f, 0.3f}, {-6.6f, 0.2f, 1}, false), grey("post", 0.5f),
          glm::dmat4(1), RB_ROLE_OCCLUDE);
    scene.addLight(sunLight({0.3, 0.2, 1}, glm::dvec3(2), 0.05));
    Bake bake;
    bake.run(scene);
    const double whole = reportOf(bake)["objects"][0]["error"]["total"].get<double>();
    const Mesh& mesh = scene.meshes[0];
    std::vector<int32_t> corners;
    for (size_t c = 0; c < mesh.cornerCount(); ++c)
        if (mesh.vertices[size_t(mesh.cornerVertices[c])].x > 2) corners.push_back(int32_t(c));
    scene.setResultCorners(0, corners.data(), corners.size());
    bake.run(scene);
    EXPECT_LT(reportOf(bake)["objects"][0]["error"]["total"].get<double>(), 0.3 * whole);
}

TEST(ResultCorners, MayBeNone) {
    Scene scene = litRoom();
    for (int32_t instance = 0; instance < int32_t(scene.instances.size()); ++instance)
        scene.setResultCorners(instance, nullptr, 0);
    for (Reconstruction reconstruction : {Reconstruction::LEAST_SQUARES, Reconstruction::POINT}) {
        Bake bake;
        setQuick(bake);
        bake.settings.reconstruction = reconstruction;
        bake.run(scene);
        for (const glm::vec3& light : everything(bake)) EXPECT_TRUE(std::isfinite(light.x));
    }
}

TEST(ResultCorners, AreOfTheFaceThatStandsForItsDouble) {
    // Two squares in the same place. The second one has the result.
    Scene scene;
    place(scene, rectangle("below", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0.5f));
    const int32_t asked =
        place(scene, rectangle("asked for", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0.5f));
    scene.addLight(sunLight({0, 0, 1}, glm::dvec3(kPi)));
    scene.setResultCorners(0, nullptr, 0);
    Bake bake;
    setQuick(bake);
    bake.run(scene);
    for (const glm::vec3& light : cornerLight(bake, asked, RB_OUTPUT_LIGHTING))
        EXPECT_NEAR(light.x, 1, 1e-4);
    EXPECT_EQ(bake.patches().parents.front().instance, uint32_t(asked));
}

}  // namespace
}  // namespace raybundle
