// SPDX-License-Identifier: GPL-3.0-or-later
//
// The closed form of emissive meshes, against the sum over their faces.
#include "transport/mesh_source.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "test_scenes.h"
#include "test_shots.h"

namespace raybundle {
namespace {

using namespace test;

// The cells of a grid of 12 x 9, turned in space, that are in no hole; only the front emits.
Scene turnedGrid(bool withHoles) {
    Mesh whole = grid("lamp", {0.3f, -0.2f, 1}, {0.9f, 0.3f, 0.2f}, {-0.2f, 0.7f, 0.3f}, 12, 9);
    std::vector<std::vector<int32_t>> faces;
    for (int32_t k = 0; k < 108; ++k) {
        const int32_t column = k % 12, row = k / 12;
        // Two holes that touch at a corner, and a notch at the border.
        const bool isHole = (column / 3 == 1 && row / 3 == 1) ||
                            (column / 3 == 2 && row / 3 == 2) || (column == 11 && row == 4);
        if (withHoles && isHole) continue;
        const int32_t a = column + 13 * row;
        faces.push_back({a, a + 1, a + 14, a + 13});
    }
    Scene scene;
    place(scene, polygons("lamp", whole.vertices, faces), grey("", 0, 5));
    return scene;
}

TEST(MeshSource, APlaneOfManyFacesHasTheClosedFormOfTheirSum) {
    for (const bool withHoles : {false, true}) {
        const ShotScene shots(turnedGrid(withHoles));
        const Patches& patches = shots.patches;
        std::vector<uint32_t> parents(patches.parents.size());
        std::iota(parents.begin(), parents.end(), 0u);
        const MeshSource source(patches, parents, {glm::vec3(5.0f), glm::vec3(0.0f)});
        std::mt19937 random(1);
        std::normal_distribution<float> normal;
        auto anywhere = [&] { return glm::vec3(normal(random), normal(random), normal(random)); };
        int cut = 0;
        for (int k = 0; k < 1000; ++k) {
            const glm::vec3 point = anywhere(), up = glm::normalize(anywhere());
            double exact = 0;
            int above = 0;
            for (const Parent& parent : patches.parents) {
                glm::dvec3 corners[4];
                for (int c = 0; c < 4; ++c) {
                    corners[c] = patches.vertices[parent.vertex[size_t(c)]];
                    above += glm::dot(corners[c] - glm::dvec3(point), glm::dvec3(up)) > 0;
                }
                if (glm::dot(point - parent.origin, parent.normal) > 0)
                    exact += 5 / kPi * polygonIrradiance(point, up, corners, 4);
            }
            cut += above > 0 && above < 4 * int(patches.parents.size()) && exact > 0;
            const auto found = source.irradiance(point, up);
            ASSERT_TRUE(found);
            // Angles are of float precision: of the sum's terms, of which some are as large as 5.
            EXPECT_NEAR(double(found->x), exact, 3e-6 + 1e-5 * exact) << k;
        }
        EXPECT_GT(cut, 100);
    }
}

}  // namespace
}  // namespace raybundle
