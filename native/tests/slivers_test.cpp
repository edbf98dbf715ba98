// SPDX-License-Identifier: GPL-3.0-or-later
//
// Slivers in a mesh, as left by boolean modifiers or filled into T-junctions, cost nothing and
// change nothing, however thin they are and however the mesh is rotated: the light, its stated
// error and the number of bundles are those of a mesh whose slivers have a height of a hundredth of
// their edge.
#include <gtest/gtest.h>

#include <array>
#include <glm/gtc/matrix_transform.hpp>

#include "bake/bake.h"
#include "patches/conforming_subdivision.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

constexpr size_t kQuadCorners = 4 * (4 * 8 + 2 * 4 * 8);  // of 8 x 8 squares, half of them cut

struct Result {
    std::vector<glm::vec3> light;
    double bundles = 0, error = 0, balance = 0;
};

// Bakes a floor of 8 m under a box, lit by a lamp. Everything is rotated, by a matrix or in the
// meshes.
Result bakeFloor(Mesh floor, Reconstruction reconstruction, const glm::dmat4& turn, bool inMeshes,
                 int seed = 0) {
    Scene scene;
    for (glm::vec3& v : floor.vertices) v -= glm::vec3(4, 4, 0);
    Mesh above = box("box", {-1, -1, 1}, {1, 1, 2}, false);
    if (inMeshes)
        for (Mesh* mesh : {&floor, &above})
            for (glm::vec3& v : mesh->vertices) v = glm::vec3(turn * glm::dvec4(v, 1));
    const glm::dmat4 transform = inMeshes ? glm::dmat4(1) : turn;
    place(scene, floor, grey("", 0.5f), transform);
    place(scene, above, grey("", 0.5f), transform);
    auto turned = [&](const glm::dvec3& v, double w) {
        return glm::dvec3(turn * glm::dvec4(v, w));
    };
    scene.lights.push_back(areaLight(turned({2, 1, 6}, 1), turned({2, 0, 0}, 0),
                                     turned({0, -2, 0}, 0), glm::dvec3(10)));
    Bake bake;
    bake.settings.reconstruction = reconstruction;
    bake.settings.seed = seed;
    bake.run(scene);
    const Json report = reportOf(bake);
    return {cornerLight(bake, 0, RB_OUTPUT_LIGHTING), report["bundles"].get<double>(),
            report["error"]["total"].get<double>(),
            report["energy"]["balance_error"].get<double>()};
}

TEST(Slivers, CostAndChangeNothing) {
    const glm::dmat4 turn = glm::rotate(glm::dmat4(1), 0.7, glm::dvec3(0.3, 0.5, 0.8));
    for (Reconstruction reconstruction :
         {Reconstruction::LEAST_SQUARES, Reconstruction::AREA_AVERAGE, Reconstruction::POINT})
        for (bool inMeshes : {false, true}) {
            const Result wanted =
                bakeFloor(floorWithSlivers(8, 1e-2f), reconstruction, turn, inMeshes);
            for (const float height : {1e-3f, 1e-4f, 1e-5f, 1e-6f, 1e-7f, 1e-12f, 1e-18f, 0.0f}) {
                const Result found =
                    bakeFloor(floorWithSlivers(8, height), reconstruction, turn, inMeshes);
                double square = 0, all = 0;
                for (size_t c = 0; c < kQuadCorners; ++c) {
                    const glm::vec3 off = found.light[c] - wanted.light[c];
                    square += double(glm::dot(off, off));
                    all += double(glm::dot(wanted.light[c], wanted.light[c]));
                }
                const std::string what = std::string(choiceName(reconstruction)) + ", height " +
                                         std::to_string(height) + (inMeshes ? ", in mesh" : "");
                EXPECT_LT(std::sqrt(square / all), std::max(wanted.error, 0.02)) << what;
                EXPECT_LE(found.bundles, 2 * wanted.bundles) << what;
                EXPECT_LT(found.error, 1.5 * wanted.error + 0.01) << what;
                EXPECT_LT(found.balance, 5e-3) << what;
                for (size_t c = kQuadCorners; c < found.light.size(); ++c)
                    ASSERT_TRUE(found.light[c].x > 0) << what << ": a corner without light";
            }
        }
}

TEST(Slivers, SubdividedMeshesHaveNone) {
    auto subdivided = [](float height, int seed) {
        const ConformingSubdivision cut = subdivideConforming(floorWithSlivers(8, height), 0.5f);
        std::vector<std::vector<int32_t>> faces;
        for (const auto& t : cut.triangles) faces.push_back({t[0], t[1], t[2]});
        return bakeFloor(polygons("floor", cut.vertices, faces), Reconstruction::LEAST_SQUARES,
                         glm::dmat4(1), false, seed);
    };
    // A single bake may end after one look at the noise or after two, with half or twice as many
    // bundles.
    constexpr int kSeeds = kFewBakes ? 1 : 4;
    std::array<Result, kSeeds> wanted;
    double bundlesWanted = 0;
    for (int seed = 0; seed < kSeeds; ++seed) {
        wanted[size_t(seed)] = subdivided(1e-2f, seed);
        bundlesWanted += wanted[size_t(seed)].bundles;
    }
    for (const float height : {1e-5f, 1e-6f, 1e-9f, 0.0f}) {
        double bundles = 0;
        for (int seed = 0; seed < kSeeds; ++seed) {
            const Result found = subdivided(height, seed);
            bundles += found.bundles;
            EXPECT_LT(found.error, wanted[size_t(seed)].error + 0.01) << height;
            EXPECT_LT(found.balance, 5e-3) << height;
        }
        EXPECT_LE(bundles, 2 * bundlesWanted) << height;
        if (kFewBakes) break;
    }
}

}  // namespace
}  // namespace raybundle
