// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/area_average.h"

#include <gtest/gtest.h>

#include <functional>

#include "bake/bake.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

struct Corner {
    glm::vec3 position, value;
};

// Returns the averages of a light that is a function light(centroid) of the position on a mesh.
std::vector<Corner> averages(const Mesh& given, float patchSize,
                             const std::function<float(glm::vec3)>& light,
                             const std::function<float(glm::vec3)>& exposure) {
    Scene scene;
    place(scene, given, grey("", 0.5f));
    const Mesh& mesh = scene.meshes[0];
    const Patches patches = subdivide(scene, patchSize, 10000000);
    std::vector<glm::vec3> field(patches.sideCount(), glm::vec3(0));
    std::vector<float> exposed(patches.sideCount(), 1.0f);
    for (uint32_t p = 0; p < patches.count(); ++p) {
        const bool isTriangle = patches.parents[patches.parentOf[p]].isTriangle;
        const glm::vec2 uv = isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
        const glm::vec3 at(glm::dvec3(patches.point(p, uv)) + patches.centre);
        field[2 * p] = glm::vec3(light(at));
        exposed[2 * p] = exposure(at);
    }
    const InstanceRange range{0, uint32_t(patches.cells.size()), 0,
                              uint32_t(patches.parents.size())};
    const SmoothRegions regions = smoothRegions(mesh, patches.cells, 0, range.lastCell);
    const auto nodes = areaAverage({patches, exposed}, {range, regions, RB_SIDE_FRONT}, {&field});
    std::vector<Corner> corners;
    for (size_t c = 0; c < mesh.cornerCount(); ++c)
        corners.push_back(
            {mesh.vertices[size_t(mesh.cornerVertices[c])], nodes[0][regions.nodeOf[c]]});
    return corners;
}

float one(glm::vec3) { return 1; }

TEST(AreaAverage, ConstantLightStaysConstant) {
    for (const Mesh& mesh :
         {grid("plane", {0, 0, 0}, {2, 0, 0}, {0, 1, 0}, 5, 3),
          box("box", {0, 0, 0}, {1, 1, 1}, true), icosphere("ball", 1, 2, false)})
        for (const Corner& corner : averages(
                 mesh, 0.07f, [](auto) { return 3.0f; }, one))
            EXPECT_NEAR(corner.value.x, 3, 1e-5f);
}

// The mean of x over the hat function of a vertex is x inside the plane. At the border of faces of
// width h the weight is 1 - x / h on one side only, so the mean lies h / 3 further inwards.
TEST(AreaAverage, LinearLightIsTheHatsMean) {
    const float h = 0.5f;
    for (const Corner& corner : averages(
             grid("plane", {0, 0, 0}, {2, 0, 0}, {0, 2, 0}, 4, 4), 0.02f,
             [](glm::vec3 at) { return 1 + at.x; }, one)) {
        const float x = corner.position.x;
        const float wanted = x == 0 ? 1 + h / 3 : x == 2 ? 3 - h / 3 : 1 + x;
        EXPECT_NEAR(corner.value.x, wanted, 1e-3f) << "at " << x;
    }
}

TEST(AreaAverage, CoveredPartsDoNotCount) {
    auto isOpen = [](glm::vec3 at) { return at.x < 0.8f ? 1.0f : 0.0f; };
    for (const Corner& corner : averages(
             grid("plane", {0, 0, 0}, {2, 0, 0}, {0, 2, 0}, 4, 4), 0.02f,
             [&](glm::vec3 at) { return 2 * isOpen(at); }, isOpen))
        if (corner.position.x <= 1) {
            EXPECT_NEAR(corner.value.x, 2, 2e-4f) << corner.position.x;
        }
}

TEST(AreaAverage, IsASettingOfABake) {
    Bake bake, leastSquares;
    for (Bake* b : {&bake, &leastSquares}) setQuick(*b);
    bake.settings.reconstruction = Reconstruction::AREA_AVERAGE;
    bake.run(litRoom());
    leastSquares.run(litRoom());
    // The light is the same, but the two reconstructions blur it differently over walls of one face
    // each.
    const double d = noise(everything(bake), everything(leastSquares));
    EXPECT_GT(d, 0.01);
    EXPECT_LT(d, 0.6);
}

}  // namespace
}  // namespace raybundle
