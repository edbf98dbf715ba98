// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "bundles/directions.h"
#include "bundles/fragment_lists.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

Bundle alongZ(glm::vec2 shift) { return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, shift, 0, 0}; }

TEST(FragmentLists, AStackExchangesBetweenNeighboursInOrderOfDepth) {
    // The instances are not added in the order of depth. The middle one faces down.
    Scene scene;
    place(scene, rectangle("top", {0, 0, 2}, {1, 0, 0}, {0, 1, 0}), grey("", 0));
    place(scene, rectangle("bottom", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0));
    place(scene, rectangle("middle", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}), grey("", 0));
    const Patches patches = subdivide(scene, 10, kMany);
    constexpr uint32_t kTop = 0, kBottom = 2, kMiddle = 4;  // their fronts
    for (glm::vec2 shift :
         {glm::vec2(0.11f, 0.93f), glm::vec2(0.4f, 0.25f), glm::vec2(0.999f, 0.001f)}) {
        BundleLines lines;
        FragmentLists(patches, 0.1f).project(alongZ(shift), lines);
        EXPECT_EQ(lines.lines, 100u)
            << "a square metre holds a hundred pixels wherever the grid lies";
        for (const Exchange& e : lines.exchanges)
            EXPECT_TRUE((e.i == kBottom && e.j == kMiddle) ||
                        (e.i == kTop + 1 && e.j == kMiddle + 1))
                << e.i << " and " << e.j;
        EXPECT_EQ(exchangedLines(lines), 200u);
        ASSERT_EQ(lines.sky.size(), 200u);
        EXPECT_EQ(std::count(lines.sky.begin(), lines.sky.end(), kBottom + 1), 100);
        EXPECT_EQ(std::count(lines.sky.begin(), lines.sky.end(), kTop), 100);
        EXPECT_TRUE(lines.touching.empty());
    }
}

TEST(FragmentLists, NoLineLeavesAClosedScene) {
    Scene cube = closedCube(0.5f), room = roomWithBoxes(0.5f), ball;
    place(ball, icosphere("ball", 1, 3, true), grey("", 0.5f),
          glm::translate(glm::dmat4(1), glm::dvec3(3)));
    for (const Scene* scene : {&cube, &room, &ball}) {
        const Patches patches = subdivide(*scene, 0.2f, kMany);
        FragmentLists projector(patches, 0.01f * patches.radius);
        uint64_t all = 0, open = 0, disordered = 0;
        for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 9).next(200)) {
            BundleLines lines;
            projector.project(bundle, lines);
            // A line that enters closed surfaces also leaves them, so the number of its crossings
            // is even.
            ASSERT_EQ(lines.sky.size(), 2 * lines.lines);
            ASSERT_EQ((exchangedLines(lines) + lines.lines) % 2, 0u);
            if (scene != &room) {
                ASSERT_EQ(exchangedLines(lines), lines.lines) << "two crossings";
            }
            all += lines.lines;
            // The line enters through the back of a wall and leaves through the back of another.
            for (uint32_t side : lines.sky) open += side % 2 == 0;
            // Between them fronts see fronts, and backs see backs.
            for (const Exchange& e : lines.exchanges)
                disordered += e.i % 2 != e.j % 2 ? e.lines : 0;
        }
        // If a line passes an edge within a rounding error, a micrometre, the order of the two
        // faces at the edge is undefined. This affects a few lines in a million.
        EXPECT_LE(double(open), 2e-6 * double(all)) << "an inner side sees the sky";
        EXPECT_LE(double(disordered), 5e-6 * double(all)) << "the order of depth is wrong";
    }
}

TEST(FragmentLists, ClosedScenesSeenAlongTheirAxesAreWatertight) {
    const Patches patches = subdivide(closedCube(0.5f), 0.1f, kMany);
    FragmentLists projector(patches, 0.01f);
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (int k = 0; k < 20; ++k) {
        BundleLines lines;
        projector.project(alongZ({uniform(random), uniform(random)}), lines);
        // Walls are seen edge-on. They may give no line or a chain of lines, but never an open end.
        EXPECT_NEAR(double(lines.lines), 1e4, 300);
        for (uint32_t side : lines.sky) EXPECT_EQ(side % 2, 1u);
    }
}

// A square whose inside is divided at random points, three triangles for one, so that only the four
// edges of its border remain those of the original square.
Mesh cutSquare(int rounds) {
    std::mt19937 random(17);
    std::uniform_real_distribution<float> uniform(0.05f, 1);
    std::vector<glm::vec3> vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    std::vector<std::vector<int32_t>> faces = {{0, 1, 2}, {0, 2, 3}};
    for (int round = 0; round < rounds; ++round) {
        std::vector<std::vector<int32_t>> finer;
        for (const auto& f : faces) {
            glm::vec3 w(uniform(random), uniform(random), uniform(random));
            w /= w.x + w.y + w.z;
            const int32_t middle = int32_t(vertices.size());
            vertices.push_back(w.x * vertices[size_t(f[0])] + w.y * vertices[size_t(f[1])] +
                               w.z * vertices[size_t(f[2])]);
            finer.insert(finer.end(),
                         {{f[0], f[1], middle}, {f[1], f[2], middle}, {f[2], f[0], middle}});
        }
        faces = std::move(finer);
    }
    return polygons("cut", vertices, faces);
}

TEST(FragmentLists, CommonEdgesNeitherDoubleNorMissAPixel) {
    Scene uncut, cut;
    place(uncut, rectangle("square", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0.5f));
    place(cut, cutSquare(6), grey("", 0.5f));
    const Patches one = subdivide(uncut, 10, kMany);
    // With small patches long triangles are bisected too. Their neighbours may not be.
    for (float size : {10.0f, 0.05f}) {
        const Patches many = subdivide(cut, size, kMany);
        ASSERT_EQ(many.degenerateFaces, 0u);
        FragmentLists projectOne(one, 0.003f), projectMany(many, 0.003f);
        for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 4).next(40)) {
            BundleLines wanted, found;
            projectOne.project(bundle, wanted);
            projectMany.project(bundle, found);
            EXPECT_TRUE(found.exchanges.empty());
            // The midpoint of a bisected edge is rounded and lies 1e-7 m off its neighbour's whole
            // edge or the border of the square. With pixels of 3 mm this may change one line.
            const size_t most = size < 1 ? 1 : 0;
            EXPECT_LE(found.touching.size(), 2 * most)
                << "a pixel is taken twice, patch size " << size;
            const double difference = double(found.lines) - double(wanted.lines);
            EXPECT_LE(std::abs(difference), double(most))
                << "a pixel is missed, patch size " << size;
        }
    }
}

}  // namespace
}  // namespace raybundle
