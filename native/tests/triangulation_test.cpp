// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/triangulation.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <string>

#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// Triangulates a polygon and checks the number of triangles, the area, and that no triangle is
// turned over.
void expectGoodTriangulation(const std::vector<glm::dvec3>& points, const std::string& what) {
    const glm::dvec3 whole = vectorArea(points);
    glm::dvec3 sum(0.0);
    double absolute = 0;
    const auto triangles = triangulate(points);
    EXPECT_EQ(triangles.size(), points.size() - 2) << what;
    for (const std::array<int, 3>& t : triangles) {
        const glm::dvec3 area =
            vectorArea({points[size_t(t[0])], points[size_t(t[1])], points[size_t(t[2])]});
        EXPECT_GE(glm::dot(area, whole), -1e-12 * glm::dot(whole, whole)) << what;
        sum += area;
        absolute += glm::length(area);
    }
    EXPECT_LT(glm::distance(sum, whole), 1e-9 * glm::length(whole)) << what;
    EXPECT_NEAR(absolute, glm::length(whole), 1e-9 * glm::length(whole)) << what << ": overlaps";
}

std::vector<glm::dvec3> tilted(const std::vector<glm::dvec2>& points) {
    const glm::dmat4 turn = glm::rotate(glm::dmat4(1), 0.8, glm::dvec3(1, -2, 0.5));
    std::vector<glm::dvec3> result;
    for (const glm::dvec2& p : points) result.push_back(glm::dvec3(turn * glm::dvec4(p, 3, 1)));
    return result;
}

TEST(Triangulation, ConcavePolygonsAreCutWithoutOverlaps) {
    std::vector<glm::dvec2> star, comb, spiral;
    for (int k = 0; k < 14; ++k)
        star.push_back((k % 2 ? 0.3 : 1.0) *
                       glm::dvec2(std::cos(kPi * k / 7), std::sin(kPi * k / 7)));
    comb = {{10, 0}, {10, 1}, {0, 1}, {0, 0}};
    for (int k = 0; k < 9; ++k) comb.insert(comb.end(), {{k + 0.5, 0.9}, {k + 1.0, 0}});
    for (int k = 0; k <= 30; ++k)
        spiral.push_back((1 + 0.1 * k) * glm::dvec2(std::cos(0.3 * k), std::sin(0.3 * k)));
    for (int k = 30; k >= 0; --k)
        spiral.push_back((0.8 + 0.1 * k) * glm::dvec2(std::cos(0.3 * k), std::sin(0.3 * k)));
    expectGoodTriangulation(tilted(star), "star");
    expectGoodTriangulation(tilted(comb), "comb");
    expectGoodTriangulation(tilted(spiral), "spiral");
    expectGoodTriangulation(
        tilted({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}),
        "square with collinear points");
    expectGoodTriangulation(tilted({{0, 0}, {4, 0}, {4, 4}, {2, 0.5}, {0, 4}}), "notch");
}

TEST(Triangulation, RandomStarShapedPolygonsAreCutWithoutOverlaps) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> radius(0.1, 1.0);
    for (int round = 0; round < 200; ++round) {
        std::vector<glm::dvec2> points;
        const int n = 3 + round % 40;
        for (int k = 0; k < n; ++k)
            points.push_back(radius(random) *
                             glm::dvec2(std::cos(2 * kPi * k / n), std::sin(2 * kPi * k / n)));
        if (n == 3 || n == 4)  // too few points for the centre to lie inside with certainty
            for (glm::dvec2& p : points) p = glm::normalize(p);
        expectGoodTriangulation(tilted(points), "polygon " + std::to_string(round));
    }
}

}  // namespace
}  // namespace raybundle
