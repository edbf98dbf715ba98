// SPDX-License-Identifier: GPL-3.0-or-later
//
// Least squares over faces of one patch: the slope of the direct light against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "bake/bake.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// Returns the light at the corners of a flat face of one patch, at most 4 m wide, with a lamp
// above.
std::vector<glm::vec3> directOnOneFace(const Scene& scene, Reconstruction reconstruction,
                                       rb_output output = RB_OUTPUT_DIRECT) {
    Bake bake;
    setQuick(bake);
    bake.settings.patchSize = 4;
    bake.settings.reconstruction = reconstruction;
    bake.run(scene);
    return cornerLight(bake, 0, output);
}

Scene faceUnder(const Light& lamp) {
    Scene scene;
    place(scene, rectangle("face", {-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}), grey("half", 0.5f));
    scene.addLight(lamp);
    return scene;
}

TEST(FaceSlopes, AreThoseOfAPointLight) {
    const glm::dvec3 lamp(0.9, 0.3, 2);
    const Scene scene = faceUnder(pointLight(lamp, glm::dvec3(5)));
    const auto flat = directOnOneFace(scene, Reconstruction::AREA_AVERAGE);
    const auto sloped = directOnOneFace(scene, Reconstruction::LEAST_SQUARES);
    ASSERT_EQ(sloped.size(), 4u);
    std::vector<double> exact;
    double mean = 0, flatMean = 0, slopedMean = 0;
    for (size_t k = 0; k < 4; ++k) {
        const glm::dvec3 to =
            lamp - glm::dvec3(scene.meshes[0].vertices[size_t(scene.meshes[0].cornerVertices[k])]);
        exact.push_back(5 * to.z / std::pow(glm::length(to), 3) / kPi);
        mean += exact.back() / 4;
        flatMean += double(flat[k].x) / 4;
        slopedMean += double(sloped[k].x) / 4;
    }
    // The mean over the face is kept. It differs from the mean over the corners.
    EXPECT_NEAR(slopedMean, flatMean, 1e-5 * mean);
    const double share = std::min(1.0, flatMean / mean);
    for (size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(double(sloped[k].x), flatMean + share * (exact[k] - mean), 1e-4 * mean);
        EXPECT_NEAR(double(flat[k].x), flatMean, 1e-5 * mean);
    }
    // The outputs that include colour have the slope too.
    const auto combined = directOnOneFace(scene, Reconstruction::LEAST_SQUARES, RB_OUTPUT_COMBINED);
    for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(combined[k].x, 0.5f * sloped[k].x, 1e-5);
}

TEST(FaceSlopes, OfASunThereAreNone) {
    const auto light = directOnOneFace(faceUnder(sunLight({0.3, 0, 1}, glm::dvec3(3))),
                                       Reconstruction::LEAST_SQUARES);
    for (const glm::vec3& corner : light) EXPECT_NEAR(corner.x, light[0].x, 1e-5f * light[0].x);
}

}  // namespace
}  // namespace raybundle
