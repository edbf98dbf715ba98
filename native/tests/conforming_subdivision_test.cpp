// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/conforming_subdivision.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "scene/triangulation.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

glm::dvec3 corner(const ConformingSubdivision& s, size_t triangle, size_t k) {
    return s.vertices[size_t(s.triangles[triangle][k])];
}

double meshArea(const ConformingSubdivision& s) {
    double sum = 0;
    for (size_t t = 0; t < s.triangles.size(); ++t)
        sum += glm::length(vectorArea({corner(s, t, 0), corner(s, t, 1), corner(s, t, 2)}));
    return sum;
}

// Checks area, edge lengths, winding and weights, which must be right for every input.
void expectGoodSubdivision(const Mesh& mesh, const ConformingSubdivision& s, double maxEdge,
                           double area) {
    EXPECT_NEAR(meshArea(s), area, 1e-5 * area) << mesh.name;
    ASSERT_EQ(s.sourceFaces.size(), s.triangles.size());
    ASSERT_EQ(s.sourceCorners.size(), 3 * s.triangles.size());
    ASSERT_EQ(s.sourceWeights.size(), 3 * s.triangles.size());
    for (size_t t = 0; t < s.triangles.size(); ++t) {
        std::vector<glm::dvec3> face;
        const size_t f = size_t(s.sourceFaces[t]);
        for (int32_t c = mesh.faceOffsets[f]; c < mesh.faceOffsets[f + 1]; ++c)
            face.push_back(mesh.vertices[size_t(mesh.cornerVertices[size_t(c)])]);
        ASSERT_GT(glm::dot(vectorArea(face),
                           vectorArea({corner(s, t, 0), corner(s, t, 1), corner(s, t, 2)})),
                  0)
            << mesh.name << ": the winding is kept";
        for (size_t k = 0; k < 3; ++k) {
            ASSERT_LE(glm::distance(corner(s, t, k), corner(s, t, (k + 1) % 3)), maxEdge * 1.00001);
            glm::dvec3 position(0.0);
            double sum = 0;
            for (size_t j = 0; j < 3; ++j) {
                const int32_t source = s.sourceCorners[3 * t + k][j];
                ASSERT_GE(source, mesh.faceOffsets[f]);
                ASSERT_LT(source, mesh.faceOffsets[f + 1]);
                const double weight = s.sourceWeights[3 * t + k][j];
                sum += weight;
                position +=
                    weight * glm::dvec3(mesh.vertices[size_t(mesh.cornerVertices[size_t(source)])]);
            }
            ASSERT_NEAR(sum, 1, 1e-5);
            ASSERT_LT(glm::distance(position, corner(s, t, k)), 1e-5 * (1 + glm::length(position)));
        }
    }
}

// Returns the number of triangles at each edge, by the pair of its vertices.
std::map<std::pair<int32_t, int32_t>, int> edgeUse(const ConformingSubdivision& s) {
    std::map<std::pair<int32_t, int32_t>, int> use;
    for (const auto& t : s.triangles)
        for (size_t k = 0; k < 3; ++k) ++use[std::minmax(t[k], t[(k + 1) % 3])];
    return use;
}

TEST(ConformingSubdivision, AClosedMeshStaysClosed) {
    for (const Mesh& mesh :
         {box("box", {0, 0, 0}, {1, 2, 3}, false), icosphere("ball", 1, 1, true)}) {
        const double area = meshArea(subdivideConforming(mesh, 100));
        const ConformingSubdivision s = subdivideConforming(mesh, 0.21f);
        expectGoodSubdivision(mesh, s, 0.21f, area);
        for (const auto& [edge, count] : edgeUse(s))
            ASSERT_EQ(count, 2) << mesh.name << ": a T-junction leaves an edge with one face";
    }
}

TEST(ConformingSubdivision, AnOpenMeshKeepsItsBorder) {
    const Mesh mesh = grid("grid", {0, 0, 0}, {4, 0, 0}, {0, 3, 0}, 5, 2);
    const ConformingSubdivision s = subdivideConforming(mesh, 0.3f);
    expectGoodSubdivision(mesh, s, 0.3, 12);
    double border = 0;
    for (const auto& [edge, count] : edgeUse(s)) {
        ASSERT_LE(count, 2);
        if (count == 1)
            border +=
                glm::distance(s.vertices[size_t(edge.first)], s.vertices[size_t(edge.second)]);
    }
    EXPECT_NEAR(border, 14, 1e-4) << "a T-junction makes the border longer";
}

TEST(ConformingSubdivision, ConcaveFacesKeepTheirArea) {
    const Mesh mesh =
        polygons("L", {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}},
                 {{0, 1, 2, 3, 4, 5}});
    expectGoodSubdivision(mesh, subdivideConforming(mesh, 0.2f), 0.2, 4);
}

TEST(ConformingSubdivision, NonManifoldMeshesSurvive) {
    // Three faces at one edge, two faces with opposite winding, and two triangles joined at one
    // vertex.
    const Mesh book = polygons("book",
                               {{0, 0, 0},
                                {0, 0, 1},
                                {1, 0, 0},
                                {1, 0, 1},
                                {0, 1, 0},
                                {0, 1, 1},
                                {-1, -1, 0},
                                {-1, -1, 1}},
                               {{0, 1, 3, 2}, {0, 1, 5, 4}, {0, 1, 7, 6}});
    expectGoodSubdivision(book, subdivideConforming(book, 0.2f), 0.2, 2 + std::sqrt(2.0));
    const Mesh turned =
        polygons("turned", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {2, 1, 0}},
                 {{0, 1, 2, 3}, {2, 5, 4, 1}, {1, 4, 5, 2}});
    expectGoodSubdivision(turned, subdivideConforming(turned, 0.2f), 0.2, 3);
    const Mesh bow = polygons("bow", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}},
                              {{0, 1, 2}, {0, 3, 4}});
    expectGoodSubdivision(bow, subdivideConforming(bow, 0.2f), 0.2, 1);
}

TEST(ConformingSubdivision, SliversAreTakenOutAndTJunctionsConform) {
    for (const float height : {0.0f, 1e-9f, 1e-7f, 1e-6f}) {
        const Mesh mesh = floorWithSlivers(8, height);
        const ConformingSubdivision s = subdivideConforming(mesh, 0.3f);
        EXPECT_NEAR(meshArea(s), 64, 1e-3) << height;
        double border = 0;
        for (const auto& [edge, count] : edgeUse(s)) {
            ASSERT_LE(count, 2) << height;
            if (count == 1)
                border +=
                    glm::distance(s.vertices[size_t(edge.first)], s.vertices[size_t(edge.second)]);
        }
        EXPECT_NEAR(border, 32, 1e-2) << height << ": a T-junction makes the border longer";
        for (size_t t = 0; t < s.triangles.size(); ++t) {
            const glm::dvec3 a = corner(s, t, 0), b = corner(s, t, 1), c = corner(s, t, 2);
            const double longest =
                std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
            ASSERT_GT(glm::length(glm::cross(b - a, c - a)), 1e-2 * longest * longest) << height;
            ASSERT_LE(longest, 0.30001) << height;
        }
    }
}

TEST(ConformingSubdivision, AnyMeshOfSliversIsCutToFiniteTriangles) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> place(0, 1);
    for (int round = 0; round < 200; ++round) {
        // Triangles between points on a line, doubled points and the corners of a square.
        std::vector<glm::vec3> vertices{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
        for (int k = 0; k < 8; ++k) vertices.push_back({place(random), 0, 0});
        for (int k = 0; k < 4; ++k)
            vertices.push_back(vertices[random() % 12] + glm::vec3(0, 0, 1e-7f * place(random)));
        std::vector<std::vector<int32_t>> faces;
        for (int k = 0; k < 20; ++k) {
            const int32_t a = int32_t(random() % 16), b = int32_t(random() % 16),
                          c = int32_t(random() % 16);
            if (a != b && b != c && c != a) faces.push_back({a, b, c});
        }
        const ConformingSubdivision s =
            subdivideConforming(polygons("slivers", vertices, faces), 0.25f);
        ASSERT_LT(s.triangles.size(), 20000u) << round;
        for (size_t t = 0; t < s.triangles.size(); ++t)
            for (size_t k = 0; k < 3; ++k) {
                ASSERT_LE(glm::distance(corner(s, t, k), corner(s, t, (k + 1) % 3)), 0.25001)
                    << round;
                for (float weight : s.sourceWeights[3 * t + k]) ASSERT_TRUE(weight >= 0) << round;
            }
    }
}

}  // namespace
}  // namespace raybundle
