// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/simplification.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <random>
#include <set>

#include "job/error.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace raybundle::test;

// Returns limits of one value, which is a function of the position of a corner.
SimplificationLimits limitsOf(const Mesh& mesh, const std::function<float(const glm::vec3&)>& value,
                              float tolerance, float distance) {
    SimplificationLimits limits;
    for (int32_t v : mesh.cornerVertices) limits.values.push_back(value(mesh.vertices[size_t(v)]));
    limits.tolerances = {tolerance};
    limits.distance = distance;
    return limits;
}

float none(const glm::vec3&) { return 0; }

std::vector<int32_t> verticesOf(const Mesh& source, const SimplifiedMesh& made) {
    std::vector<int32_t> result;
    for (int32_t corner : made.sourceCorners)
        result.push_back(source.cornerVertices[size_t(corner)]);
    return result;
}

size_t vertexCount(const Mesh& source, const SimplifiedMesh& made) {
    const std::vector<int32_t> all = verticesOf(source, made);
    return std::set<int32_t>(all.begin(), all.end()).size();
}

// Returns how many faces run along each edge in each direction.
std::map<std::pair<int32_t, int32_t>, int> edgesOf(const Mesh& source, const SimplifiedMesh& made) {
    const std::vector<int32_t> vertices = verticesOf(source, made);
    std::map<std::pair<int32_t, int32_t>, int> edges;
    for (size_t f = 0; f < made.sourceFaces.size(); ++f)
        for (int32_t c = made.faceOffsets[f]; c < made.faceOffsets[f + 1]; ++c) {
            const int32_t next = c + 1 == made.faceOffsets[f + 1] ? made.faceOffsets[f] : c + 1;
            ++edges[{vertices[size_t(c)], vertices[size_t(next)]}];
        }
    return edges;
}

struct Nearest {
    double distance, value;
};

// Returns the distance of a point from a simplified mesh, and the value at the nearest place, found
// by trying all triangles on a fine grid of weights.
Nearest nearestOn(const Mesh& source, const SimplifiedMesh& made, const std::vector<float>& values,
                  const glm::dvec3& p) {
    Nearest best{INFINITY, 0};
    for (size_t f = 0; f < made.sourceFaces.size(); ++f)
        for (int32_t c = made.faceOffsets[f] + 1; c + 1 < made.faceOffsets[f + 1]; ++c) {
            const std::array<int32_t, 3> corners{made.sourceCorners[size_t(made.faceOffsets[f])],
                                                 made.sourceCorners[size_t(c)],
                                                 made.sourceCorners[size_t(c + 1)]};
            constexpr int kSteps = 24;
            for (int i = 0; i <= kSteps; ++i)
                for (int j = 0; i + j <= kSteps; ++j) {
                    const std::array<double, 3> w{double(i) / kSteps, double(j) / kSteps,
                                                  double(kSteps - i - j) / kSteps};
                    glm::dvec3 at(0.0);
                    double value = 0;
                    for (size_t k = 0; k < 3; ++k) {
                        const size_t corner = size_t(corners[k]);
                        at += w[k] *
                              glm::dvec3(source.vertices[size_t(source.cornerVertices[corner])]);
                        value += w[k] * double(values[corner]);
                    }
                    if (const double d = glm::distance(at, p); d < best.distance) best = {d, value};
                }
        }
    return best;
}

TEST(Simplification, LeavesFourVerticesOfAFlatSquareOfEvenLight) {
    const Mesh mesh = grid("floor", {0, 0, 0}, {2, 0, 0}, {0, 3, 0}, 12, 17);
    const SimplifiedMesh made = simplify(mesh, limitsOf(mesh, none, 0.1f, 1e-4f));
    EXPECT_EQ(vertexCount(mesh, made), 4u);
    EXPECT_EQ(made.sourceFaces.size(), 2u);
    EXPECT_EQ(made.changes, std::vector<float>{0});
    // So does light that varies linearly.
    const auto slope = [](const glm::vec3& p) { return 3 * p.x - p.y; };
    EXPECT_EQ(vertexCount(mesh, simplify(mesh, limitsOf(mesh, slope, 1e-3f, 1e-4f))), 4u);
}

TEST(Simplification, KeepsWhatNeedsItsVertices) {
    // Light that no neighbours predict.
    const Mesh mesh = grid("floor", {0, 0, 0}, {2, 0, 0}, {0, 2, 0}, 6, 6);
    const auto rough = [](const glm::vec3& p) {
        return glm::fract(std::sin(13 * p.x + 78 * p.y) * 43758.5f);
    };
    const SimplifiedMesh made = simplify(mesh, limitsOf(mesh, rough, 1e-3f, 1e-4f));
    EXPECT_EQ(made.sourceFaces.size(), mesh.faceCount());
    EXPECT_EQ(verticesOf(mesh, made), mesh.cornerVertices);
    EXPECT_EQ(made.sourceEdges, made.sourceCorners);
}

TEST(Simplification, ChangesNoVertexByMoreThanTheTolerance) {
    const Mesh mesh = grid("floor", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 24, 24);
    const auto spot = [](const glm::vec3& p) { return std::exp(-6 * glm::dot(p, p)); };
    size_t last = mesh.vertices.size();
    for (const float tolerance : {0.01f, 0.04f, 0.16f}) {
        const SimplificationLimits limits = limitsOf(mesh, spot, tolerance, 1e-4f);
        const SimplifiedMesh made = simplify(mesh, limits);
        double most = 0, squares = 0;
        for (const glm::vec3& v : mesh.vertices) {
            // The grid of weights misses the vertex by up to a 24th of a triangle.
            const Nearest there = nearestOn(mesh, made, limits.values, v);
            most = std::max(most, std::abs(there.value - spot(v)));
            squares += std::pow(there.value - spot(v), 2) / double(mesh.vertices.size());
        }
        EXPECT_LT(most, 1.05 * tolerance + 0.05);
        EXPECT_NEAR(made.changes[0], std::sqrt(squares), 0.1 * std::sqrt(squares) + 0.01);
        EXPECT_LT(made.changes[0], tolerance);
        EXPECT_LT(vertexCount(mesh, made), 0.75 * double(last));
        last = vertexCount(mesh, made);
    }
    EXPECT_LT(last, 40u);
}

TEST(Simplification, StaysNearACurvedSurfaceAndClosed) {
    const Mesh mesh = icosphere("ball", 1, 4, false);
    constexpr float kDistance = 0.02f;
    const SimplifiedMesh made = simplify(mesh, limitsOf(mesh, none, 1, kDistance));
    EXPECT_LT(vertexCount(mesh, made), mesh.vertices.size() / 8);
    for (size_t v = 0; v < mesh.vertices.size(); v += 7)
        EXPECT_LT(nearestOn(mesh, made, std::vector<float>(mesh.cornerCount()), mesh.vertices[v])
                      .distance,
                  kDistance + 0.02);
    size_t edges = 0;
    for (const auto& [edge, count] : edgesOf(mesh, made)) {
        EXPECT_EQ(count, 1);
        edges += edgesOf(mesh, made).count({edge.second, edge.first});
    }
    // A closed surface without a handle (Euler).
    EXPECT_EQ(edges / 2 + 2, vertexCount(mesh, made) + made.sourceFaces.size());
}

TEST(Simplification, TurnedMeshesGetAsFewVertices) {
    const Mesh mesh = icosphere("ball", 1, 3, false);
    Mesh turned = mesh;
    const glm::mat4 turn = glm::rotate(glm::mat4(1), 1.1f, glm::normalize(glm::vec3(1, 2, 3)));
    for (glm::vec3& v : turned.vertices) v = glm::vec3(turn * glm::vec4(v, 1));
    const auto counted = [](const Mesh& one) {
        return double(vertexCount(one, simplify(one, limitsOf(one, none, 1, 0.03f))));
    };
    EXPECT_NEAR(counted(turned), counted(mesh), 0.15 * counted(mesh));
}

TEST(Simplification, VerticesMoveAlongFeaturesOnly) {
    const Mesh mesh = grid("floor", {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, 8, 8);
    // The border between two kinds of faces is a straight line, with light of its own on each side.
    SimplificationLimits limits = limitsOf(mesh, none, 0.1f, 1e-4f);
    for (size_t f = 0; f < mesh.faceCount(); ++f) {
        float middle = 0;
        for (int32_t c = mesh.faceOffsets[f]; c < mesh.faceOffsets[f + 1]; ++c)
            middle += mesh.vertices[size_t(mesh.cornerVertices[size_t(c)])].x / 4;
        limits.faceKinds.push_back(middle < 2);
    }
    const SimplifiedMesh two = simplify(mesh, limits);
    EXPECT_EQ(vertexCount(mesh, two), 6u);
    EXPECT_EQ(two.sourceFaces.size(), 4u);
    // Light that differs across the same line does what kinds do.
    SimplificationLimits step = limitsOf(mesh, none, 0.1f, 1e-4f);
    for (size_t f = 0; f < mesh.faceCount(); ++f)
        for (int32_t c = mesh.faceOffsets[f]; c < mesh.faceOffsets[f + 1]; ++c)
            step.values[size_t(c)] = float(limits.faceKinds[f]);
    EXPECT_EQ(vertexCount(mesh, simplify(mesh, step)), 6u);
    // So do edges that are kept. What is kept of them is that of an edge of the source on the line.
    SimplificationLimits seam = limitsOf(mesh, none, 0.1f, 1e-4f);
    const auto isOnLine = [&](int32_t corner) {
        return mesh.vertices[size_t(mesh.cornerVertices[size_t(corner)])].x == 2;
    };
    for (size_t f = 0; f < mesh.faceCount(); ++f)
        for (int32_t c = mesh.faceOffsets[f]; c < mesh.faceOffsets[f + 1]; ++c)
            seam.keptEdges.push_back(
                isOnLine(c) &&
                isOnLine(c + 1 == mesh.faceOffsets[f + 1] ? mesh.faceOffsets[f] : c + 1));
    const SimplifiedMesh kept = simplify(mesh, seam);
    EXPECT_EQ(vertexCount(mesh, kept), 6u);
    size_t onLine = 0;
    for (int32_t corner : kept.sourceEdges) onLine += corner >= 0 && seam.keptEdges[size_t(corner)];
    EXPECT_EQ(onLine, 2u);
}

TEST(Simplification, KeepsFacesWithThreeAtAnEdge) {
    // A grid with a fin on one of its inner edges.
    Mesh mesh = grid("floor", {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, 4, 4);
    const int32_t a = mesh.cornerVertices[size_t(mesh.faceOffsets[5])],
                  b = mesh.cornerVertices[size_t(mesh.faceOffsets[5]) + 1];
    mesh.vertices.push_back(mesh.vertices[size_t(a)] + glm::vec3(0, 0, 1));
    mesh.cornerVertices.insert(mesh.cornerVertices.end(),
                               {a, b, int32_t(mesh.vertices.size()) - 1});
    mesh.faceOffsets.push_back(int32_t(mesh.cornerVertices.size()));
    const SimplifiedMesh made = simplify(mesh, limitsOf(mesh, none, 0.1f, 1e-4f));
    EXPECT_LT(made.sourceFaces.size(), 16u);
    const auto edges = edgesOf(mesh, made);
    EXPECT_EQ(edges.count({a, b}) + edges.count({b, a}), 2u);
    EXPECT_EQ(std::count(made.sourceFaces.begin(), made.sourceFaces.end(), 16), 1);
    // No crack: each edge has a partner, or lies on the border.
    for (const auto& [edge, count] : edges) {
        if (edges.count({edge.second, edge.first})) continue;
        const glm::vec3 &p = mesh.vertices[size_t(edge.first)],
                        &q = mesh.vertices[size_t(edge.second)];
        const bool isBorder = (p.x == q.x && (p.x == 0 || p.x == 4)) ||
                              (p.y == q.y && (p.y == 0 || p.y == 4)) || p.z + q.z > 0;
        EXPECT_TRUE(isBorder) << p.x << " " << p.y << " to " << q.x << " " << q.y;
    }
}

// Random holes, flipped faces, doubled faces, faces that share only a vertex, and degenerate faces:
// whatever a mesh is, what is left of it is made of its corners and lies within the limits.
TEST(Simplification, RandomMeshesSurvive) {
    for (uint32_t seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random{seed};
        const auto upTo = [&](size_t count) { return int32_t(random() % count); };
        Mesh mesh = grid("floor", {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, 7, 6);
        for (glm::vec3& v : mesh.vertices) v.z = seed % 3 ? 0 : 0.02f * float(upTo(3));
        std::vector<std::vector<int32_t>> faces;
        for (size_t f = 0; f < mesh.faceCount(); ++f) {
            std::vector<int32_t> face(mesh.cornerVertices.begin() + mesh.faceOffsets[f],
                                      mesh.cornerVertices.begin() + mesh.faceOffsets[f + 1]);
            const int32_t fate = upTo(12);
            if (fate == 0) continue;
            if (fate == 1) std::reverse(face.begin(), face.end());
            if (fate == 2) faces.push_back(face);
            if (fate == 3) face[0] = upTo(mesh.vertices.size());
            if (fate == 4) face.pop_back();
            faces.push_back(face);
        }
        mesh = polygons("random", mesh.vertices, faces);
        constexpr float kDistance = 0.03f;
        const SimplificationLimits limits = limitsOf(
            mesh, [](const glm::vec3& p) { return std::sin(p.x) * p.y; }, 0.3f, kDistance);
        const SimplifiedMesh made = simplify(mesh, limits);
        ASSERT_EQ(made.sourceCorners.size(), made.sourceEdges.size());
        ASSERT_EQ(size_t(made.faceOffsets.back()), made.sourceCorners.size());
        for (int32_t corner : made.sourceCorners)
            ASSERT_TRUE(corner >= 0 && size_t(corner) < mesh.cornerCount());
        std::set<int32_t> used(mesh.cornerVertices.begin(), mesh.cornerVertices.end());
        if (seed % 5) continue;  // the search takes long
        for (int32_t v : used)
            EXPECT_LT(nearestOn(mesh, made, limits.values, mesh.vertices[size_t(v)]).distance,
                      kDistance + 0.05)
                << v;
    }
}

TEST(Simplification, LimitsMustFitTheMesh) {
    const Mesh mesh = rectangle("floor", {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    const SimplificationLimits good = limitsOf(mesh, none, 0.1f, 0.1f);
    const auto refuses = [&](const std::function<void(SimplificationLimits&)>& spoil) {
        SimplificationLimits bad = good;
        spoil(bad);
        EXPECT_THROW(simplify(mesh, bad), Error);
    };
    refuses([](auto& l) { l.distance = 0; });
    refuses([](auto& l) { l.tolerances[0] = NAN; });
    refuses([](auto& l) { l.values.pop_back(); });
    refuses([](auto& l) { l.values[0] = INFINITY; });
    refuses([](auto& l) { l.faceKinds = {1, 2}; });
    refuses([](auto& l) { l.keptEdges = {1}; });
}

}  // namespace
}  // namespace raybundle
