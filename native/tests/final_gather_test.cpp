// SPDX-License-Identifier: GPL-3.0-or-later
//
// Final gather at corners, against closed forms of light that varies too fast for the faces of the
// mesh.
#include <gtest/gtest.h>

#include <cmath>

#include "lights/mesh_outline.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

constexpr float kGatherTarget = 0.01f;

void bakePoint(Bake& bake, const Scene& scene, bool gathers = true) {
    bake.settings.reconstruction = Reconstruction::POINT;
    bake.settings.finalGather = gathers;
    bake.settings.targetError = kGatherTarget;
    bake.settings.maxBundles = 1024;
    bake.run(scene);
}

// Returns the largest difference from an exact irradiance at the corners of the first instance,
// relative to this irradiance, or to its RMS where it is darker. Corners where `exact` returns NaN
// are left out.
template <class Exact>
double worstCorner(const Scene& scene, const Bake& bake, const Exact& exact) {
    const Mesh& mesh = scene.meshes[0];
    const auto light = cornerLight(bake, 0, RB_OUTPUT_LIGHTING);
    std::vector<double> expected;
    double squares = 0;
    for (int32_t vertex : mesh.cornerVertices) {
        expected.push_back(exact(mesh.vertices[size_t(vertex)]));
        if (!std::isnan(expected.back()))
            squares += expected.back() * expected.back() / double(light.size());
    }
    double worst = 0;
    for (size_t c = 0; c < light.size(); ++c)
        if (!std::isnan(expected[c]))
            worst = std::max(worst, std::abs(double(light[c].x) * kPi - expected[c]) /
                                        std::max(std::sqrt(squares), expected[c]));
    return worst;
}

// A black ground of 4 x 4 faces of 1 m under a white sky. A black board is 0.1 m above one of the
// faces.
Scene groundUnderBoard() {
    Scene scene;
    place(scene, grid("ground", {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 4, 4), grey("", 0));
    place(scene, rectangle("board", {0, 0, 0.1f}, {1, 0, 0}, {0, 1, 0}), grey("", 0), glm::dmat4(1),
          RB_ROLE_OCCLUDE);
    scene.worldRadiance = glm::vec3(1);
    return scene;
}

double skyIrradiance(const glm::vec3& point) {
    const glm::dvec3 board[4] = {{0, 0, 0.1}, {1, 0, 0.1}, {1, 1, 0.1}, {0, 1, 0.1}};
    return kPi - polygonIrradiance(point, {0, 0, 1}, board, 4);
}

TEST(FinalGather, CornersUnderABoardSeeTheSkyAroundIt) {
    const Scene scene = groundUnderBoard();
    Bake gathered, interpolated;
    bakePoint(gathered, scene);
    bakePoint(interpolated, scene, false);
    // The noise takes three quarters of the target, one standard error of each of 64 corners. The
    // receivers lie 7 mm inside their faces, in four directions around a vertex, and the light
    // changes over 0.1 m.
    EXPECT_LT(worstCorner(scene, gathered, skyIrradiance),
              4 * 0.75 * double(kGatherTarget) + 0.007);
    // Otherwise the test would prove nothing.
    EXPECT_GT(worstCorner(scene, interpolated, skyIrradiance), 0.1);
}

TEST(FinalGather, CornersBesideAWallSeeWhatItReflects) {
    // The sun shines along the black ground onto a white wall at its border.
    Scene scene;
    place(scene, grid("ground", {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 4, 4), grey("", 0));
    place(scene, rectangle("wall", {2, -1, 0}, {0, 0, 0.5f}, {0, 2, 0}), grey("", 0.5f),
          glm::dmat4(1), RB_ROLE_OCCLUDE);
    scene.addLight(sunLight({-1, 0, 0}, {4, 4, 4}));
    const auto exact = [](const glm::vec3& at) {
        // At the ends of the wall's foot the light is discontinuous.
        if (at.x == 2 && std::abs(at.y) == 1) return std::nan("");
        const glm::dvec3 wall[4] = {{2, -1, 0}, {2, 1, 0}, {2, 1, 0.5}, {2, -1, 0.5}};
        // The position of the receivers of the corners at the wall.
        const glm::dvec3 point(std::min(at.x, 1.995f), at.y, 0);
        return 2 / kPi * polygonIrradiance(point, {0, 0, 1}, wall, 4);
    };
    Bake gathered, interpolated;
    bakePoint(gathered, scene);
    bakePoint(interpolated, scene, false);
    // Interpolated corners are off by the target in the RMS over the corners around them; a single
    // corner may be off by three times that.
    EXPECT_LT(worstCorner(scene, gathered, exact), (4 * 0.75 + 3) * double(kGatherTarget));
    EXPECT_GT(worstCorner(scene, interpolated, exact), 0.1);
}

TEST(FinalGather, CornersOverANarrowGapSeeTheLightInIt) {
    // A black board of 0.1 m, 1 cm above white ground of one patch, under a sun at the zenith. Its
    // underside sees the lit ground beside its shadow.
    Scene scene;
    place(scene, rectangle("board", {-0.05f, -0.05f, 0.01f}, {0, 0.1f, 0}, {0.1f, 0, 0}),
          grey("", 0));
    place(scene, rectangle("ground", {-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0.5f));
    scene.addLight(sunLight({0, 0, 1}, {4, 4, 4}));
    const auto exact = [](const glm::vec3& at) {
        const glm::dvec3 lit[4] = {{-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}};
        const glm::dvec3 shadow[4] = {
            {-0.05, -0.05, 0}, {0.05, -0.05, 0}, {0.05, 0.05, 0}, {-0.05, 0.05, 0}};
        // The position of the receivers, 1 % of the way towards the centre.
        const glm::dvec3 point(0.99 * at.x, 0.99 * at.y, 0.01), down(0, 0, -1);
        return 2 / kPi *
               (polygonIrradiance(point, down, lit, 4) - polygonIrradiance(point, down, shadow, 4));
    };
    for (int contacts : {0, 1}) {
        Bake gathered, interpolated;
        gathered.settings.contacts = interpolated.settings.contacts = contacts;
        bakePoint(gathered, scene);
        bakePoint(interpolated, scene, false);
        EXPECT_LT(worstCorner(scene, gathered, exact), 4 * 0.75 * double(kGatherTarget));
        EXPECT_GT(worstCorner(scene, interpolated, exact), 0.1);
    }
}

TEST(FinalGather, LeavesSmoothLightAlone) {
    // In a furnace the light does not change, and the report counts the corners that were
    // interpolated.
    const Scene scene = roomWithBoxes(0.5f, 0.5f, 0.1f);
    Bake bake;
    bakePoint(bake, scene);
    EXPECT_TRUE(skips(reportOf(bake), SkippedWork::SMOOTH_CORNERS));
}

TEST(FinalGather, IsTheSameForAnyNumberOfThreads) {
    Bake one, two;
    one.settings.threads = 1;
    two.settings.threads = 2;
    bakePoint(one, groundUnderBoard());
    bakePoint(two, groundUnderBoard());
    EXPECT_EQ(cornerLight(one, 0, RB_OUTPUT_LIGHTING), cornerLight(two, 0, RB_OUTPUT_LIGHTING));
}

}  // namespace
}  // namespace raybundle
