// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/refined_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <random>
#include <set>

#include "scene/triangulation.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

const glm::dmat4 kTurned =
    glm::translate(glm::rotate(glm::dmat4(1.0), 0.7, glm::dvec3(1, 2, 3)), glm::dvec3(3, -1, 2));

std::vector<glm::dvec3> faceOf(const Mesh& mesh, size_t f) {
    std::vector<glm::dvec3> points;
    for (int32_t c = mesh.faceOffsets[f]; c < mesh.faceOffsets[f + 1]; ++c)
        points.push_back(mesh.vertices[size_t(mesh.cornerVertices[size_t(c)])]);
    return points;
}

double areaOf(const Mesh& mesh) {
    double sum = 0;
    for (size_t f = 0; f < mesh.faceCount(); ++f) sum += glm::length(vectorArea(faceOf(mesh, f)));
    return sum;
}

// Returns the smallest angle of each face, degrees.
double smallestAngle(const std::vector<glm::dvec3>& face) {
    double least = 180;
    for (size_t k = 0; k < face.size(); ++k) {
        const glm::dvec3 a = face[(k + 1) % face.size()] - face[k],
                         b = face[(k + face.size() - 1) % face.size()] - face[k];
        least =
            std::min(least, std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 180 / kPi);
    }
    return least;
}

// Returns the length of edges by how often faces use them, by the positions of their ends.
std::map<int, double> lengthByUse(const Mesh& mesh) {
    using Place = std::array<float, 3>;
    std::map<std::pair<Place, Place>, int> use;
    auto place = [&](int32_t corner) {
        const glm::vec3& p = mesh.vertices[size_t(mesh.cornerVertices[size_t(corner)])];
        return Place{p.x, p.y, p.z};
    };
    for (size_t f = 0; f < mesh.faceCount(); ++f)
        for (int32_t c = mesh.faceOffsets[f]; c < mesh.faceOffsets[f + 1]; ++c)
            ++use[std::minmax(
                place(c), place(c + 1 == mesh.faceOffsets[f + 1] ? mesh.faceOffsets[f] : c + 1))];
    std::map<int, double> lengths;
    for (const auto& [edge, count] : use) {
        double square = 0;
        for (size_t k = 0; k < 3; ++k)
            square += std::pow(double(edge.first[k]) - double(edge.second[k]), 2);
        lengths[count] += std::sqrt(square);
    }
    return lengths;
}

// Refines the triangles that contain or are next to a curve through the mesh, `rounds` times.
void refineAlong(RefinedMesh& mesh, const std::function<double(const glm::dvec3&)>& level,
                 int rounds) {
    for (int round = 0; round < rounds; ++round) {
        const size_t count = mesh.triangles().size();
        for (uint32_t t = 0; t < count; ++t) {
            const RefinedMesh::Triangle& triangle = mesh.triangles()[t];
            if (!triangle.isAlive) continue;
            std::array<double, 3> at;
            for (size_t k = 0; k < 3; ++k) at[k] = level(mesh.position(triangle, k));
            if (*std::min_element(at.begin(), at.end()) < 0 &&
                *std::max_element(at.begin(), at.end()) > 0)
                mesh.refine(t);
        }
        mesh.improve(1 << 20);
    }
}

double wave(const glm::dvec3& p) { return std::sin(2.1 * p.x + 0.3) + p.y * p.z - 0.4 * p.z; }

// Checks what must be right for every input: area, winding, attributes, and that edges have as many
// faces as in the source, so that there is neither a T-junction nor a crack.
void expectSame(const Mesh& source, const FinerMesh& finer) {
    const Mesh mesh = finer.withAttributesOf(source);
    EXPECT_NEAR(areaOf(mesh), areaOf(source), 1e-5 * areaOf(source)) << source.name;
    const std::map<int, double> before = lengthByUse(source), after = lengthByUse(mesh);
    for (const auto& [use, length] : before) {
        if (use == 2) continue;
        EXPECT_NEAR(length, after.count(use) ? after.at(use) : 0, 1e-4 * (1 + length))
            << source.name << ": length of edges with " << use << " faces";
    }
    for (const auto& [use, length] : after)
        EXPECT_TRUE(use == 2 || before.count(use)) << source.name << ": " << use << " faces";
    for (size_t f = 0; f < finer.faceCount(); ++f) {
        const size_t face = size_t(finer.sourceFaces[f]);
        const glm::dvec3 was = vectorArea(faceOf(source, face));
        const glm::dvec3 now = vectorArea(faceOf(mesh, f));
        ASSERT_GT(glm::dot(was, now), 0) << source.name << ": the winding is kept";
    }
    for (size_t c = 0; c < finer.cornerVertices.size(); ++c) {
        glm::vec3 place(0.0f);
        for (size_t k = 0; k < 3; ++k)
            place +=
                finer.sourceWeights[c][k] *
                source.vertices[size_t(source.cornerVertices[size_t(finer.sourceCorners[c][k])])];
        ASSERT_LT(glm::distance(place, finer.vertices[size_t(finer.cornerVertices[c])]),
                  1e-5f * (1 + glm::length(place)))
            << source.name;
    }
}

TEST(RefinedMesh, StaysWithoutGapsAndTJunctions) {
    for (const Mesh& mesh : {box("box", {0, 0, 0}, {1, 2, 3}, false), icosphere("ball", 1, 1, true),
                             grid("grid", {0, 0, 0}, {4, 0.5f, 0}, {0.3f, 3, 1}, 3, 2)}) {
        RefinedMesh refined(mesh, kTurned);
        refineAlong(refined, wave, 8);
        EXPECT_GT(refined.vertexCount(), mesh.vertices.size() + 100);
        expectSame(mesh, refined.result());
    }
}

TEST(RefinedMesh, KeepsItsAnglesAboveTwentyDegrees) {
    const Mesh plane = rectangle("plane", {-3, -2, 0}, {6, 0, 0}, {0, 4, 0});
    const Mesh longer = rectangle("longer", {-3, -0.5f, 0}, {7, 0, 0}, {0, 1, 0});
    const Mesh ball = icosphere("ball", 1, 1, true);
    const Mesh cube = box("cube", {0, 0, 0}, {1, 1.3f, 1.7f}, false);
    for (const Mesh& mesh : {plane, longer, ball, cube}) {
        RefinedMesh refined(mesh, kTurned);
        refineAlong(refined, wave, 12);
        const Mesh result = refined.result().withAttributesOf(mesh);
        double least = 180;
        for (size_t f = 0; f < result.faceCount(); ++f)
            least = std::min(least, smallestAngle(faceOf(result, f)));
        EXPECT_GE(least, 20) << mesh.name << ", " << refined.vertexCount() << " vertices";
    }
}

TEST(RefinedMesh, LeavesFacesAloneThatNoBisectionReaches) {
    const Mesh mesh = grid("grid", {0, 0, 0}, {8, 0, 0}, {0, 8, 0}, 8, 8);
    RefinedMesh refined(mesh, glm::dmat4(1.0));
    refined.refine(0);
    refined.improve(1000);
    const FinerMesh result = refined.result();
    size_t quads = 0;
    for (size_t f = 0; f < result.faceCount(); ++f)
        quads += result.faceOffsets[f + 1] - result.faceOffsets[f] == 4;
    EXPECT_GE(quads, 60u);
    expectSame(mesh, result);
}

TEST(RefinedMesh, SplitEdgesAndEdgesWithManyFacesAreBisectedTogether) {
    // Five pages at one spine, of which two have vertices of their own.
    std::vector<glm::vec3> vertices{{0, 0, 0}, {0, 0, 1}};
    std::vector<std::vector<int32_t>> faces;
    for (int page = 0; page < 5; ++page) {
        const float angle = 1.1f * float(page);
        const glm::vec3 out(std::cos(angle), std::sin(angle), 0);
        const int32_t first = int32_t(vertices.size());
        vertices.push_back(out);
        vertices.push_back(out + glm::vec3(0, 0, 1));
        int32_t low = 0, high = 1;
        if (page >= 3) {
            low = int32_t(vertices.size());
            high = low + 1;
            vertices.push_back({0, 0, 0});
            vertices.push_back({0, 0, 1});
        }
        faces.push_back({low, first, first + 1, high});
    }
    const Mesh book = polygons("book", vertices, faces);
    RefinedMesh refined(book, kTurned);
    for (int k = 0; k < 6; ++k) {
        const size_t count = refined.triangles().size();
        for (uint32_t t = 0; t < count; ++t)
            if (refined.triangles()[t].face == 0) refined.refine(t);
        refined.improve(10000);
    }
    expectSame(book, refined.result());
    EXPECT_NEAR(lengthByUse(refined.result().withAttributesOf(book))[5], 1, 1e-5);
}

TEST(RefinedMesh, DoublesOfAFaceAreDividedAsItIs) {
    // A square, a copy of it from another corner on, a reversed one, and one with own vertices.
    const Mesh mesh = polygons(
        "doubles",
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
        {{0, 1, 2, 3}, {2, 3, 0, 1}, {0, 3, 2, 1}, {4, 5, 6, 7}});
    RefinedMesh refined(mesh, kTurned);
    for (int round = 0; round < 5; ++round) {
        const size_t count = refined.triangles().size();
        for (uint32_t t = 0; t < count; t += 3)
            if (refined.triangles()[t].face == 0) refined.refine(t);
        refined.improve(1000);
    }
    const FinerMesh finer = refined.result();
    const Mesh result = finer.withAttributesOf(mesh);
    std::map<int32_t, std::set<std::array<float, 3>>> middles;  // per face of the source
    for (size_t f = 0; f < result.faceCount(); ++f) {
        const std::vector<glm::dvec3> points = faceOf(result, f);
        const glm::vec3 middle((points[0] + points[1] + points[2]) / 3.0);
        middles[finer.sourceFaces[f]].insert({middle.x, middle.y, middle.z});
        EXPECT_EQ(vectorArea(points).z > 0, finer.sourceFaces[f] != 2);
    }
    EXPECT_GT(middles[0].size(), 10u);
    for (int32_t face = 1; face < 4; ++face)
        EXPECT_EQ(middles[face].size(), middles[0].size()) << face;
}

TEST(RefinedMesh, AttributesAreThoseOfTheSource) {
    Mesh mesh = box("box", {0, 0, 0}, {1, 2, 3}, false);
    for (size_t c = 0; c < mesh.cornerCount(); ++c) {
        const glm::vec3& p = mesh.vertices[size_t(mesh.cornerVertices[c])];
        mesh.uvs.push_back({0.3f * p.x + p.y, p.z - 0.2f * p.y});
        mesh.cornerColors.push_back(p);
    }
    mesh.faceMaterials = {5, 4, 3, 2, 1, 0};
    std::set<uint64_t> edges;
    for (size_t c = 0; c < mesh.cornerCount(); ++c)
        edges.insert(edgeKey(mesh.cornerVertices[c], mesh.cornerVertices[c / 4 * 4 + (c + 1) % 4]));
    mesh.sharpEdges.assign(edges.begin(), edges.end());
    RefinedMesh refined(mesh, kTurned);
    refineAlong(refined, wave, 6);
    const FinerMesh finer = refined.result();
    const Mesh result = finer.withAttributesOf(mesh);
    for (size_t f = 0; f < result.faceCount(); ++f)
        EXPECT_EQ(result.faceMaterials[f], mesh.faceMaterials[size_t(finer.sourceFaces[f])]);
    for (size_t c = 0; c < result.cornerCount(); ++c) {
        const glm::vec3& p = result.vertices[size_t(result.cornerVertices[c])];
        EXPECT_NEAR(result.uvs[c].x, 0.3f * p.x + p.y, 1e-5);
        EXPECT_NEAR(result.uvs[c].y, p.z - 0.2f * p.y, 1e-5);
        EXPECT_NEAR(glm::distance(result.cornerColors[c], p), 0, 1e-5);
    }
    double length = 0;
    for (uint64_t key : result.sharpEdges)
        length += double(glm::distance(result.vertices[size_t(key >> 32)],
                                       result.vertices[size_t(key & 0xffffffffu)]));
    EXPECT_NEAR(length, 4 * (1 + 2 + 3), 1e-4);
    EXPECT_GT(result.sharpEdges.size(), 12u);
}

TEST(RefinedMesh, PointsStayInTheirTriangles) {
    const Mesh plane = rectangle("plane", {-3, -2, 0}, {6, 0, 0}, {0, 4, 0});
    RefinedMesh refined(plane, glm::dmat4(1.0));
    std::mt19937 random(3);
    std::uniform_real_distribution<double> at(-1, 1);
    auto contains = [&](const RefinedMesh::Triangle& triangle, const glm::dvec3& p) {
        for (size_t k = 0; k < 3; ++k) {
            const glm::dvec3 &a = refined.position(triangle, k),
                             &b = refined.position(triangle, (k + 1) % 3);
            if (glm::cross(b - a, p - a).z < -1e-9) return false;
        }
        return true;
    };
    for (int k = 0; k < 500; ++k) {
        const glm::dvec3 p(3 * at(random), 2 * at(random), 0);
        for (uint32_t t = 0; t < refined.triangles().size(); ++t)
            if (refined.triangles()[t].isAlive && contains(refined.triangles()[t], p)) {
                refined.addPoint(t, p);
                break;
            }
    }
    refineAlong(refined, wave, 10);
    std::set<uint32_t> found;
    for (const RefinedMesh::Triangle& triangle : refined.triangles()) {
        if (!triangle.isAlive) continue;
        for (uint32_t p : triangle.points) {
            EXPECT_TRUE(contains(triangle, refined.point(p)));
            EXPECT_TRUE(found.insert(p).second);
        }
    }
    EXPECT_EQ(found.size(), 500u);
}

// Returns lines between random points of the faces of a mesh, in the world.
std::vector<RefinedMesh::Line> randomLines(const Mesh& mesh, const glm::dmat4& toWorld, int count,
                                           double accuracy, std::mt19937& random) {
    std::uniform_real_distribution<double> share(0, 1);
    auto pointOn = [&](const std::vector<glm::dvec3>& face) {
        double sum = 0;
        glm::dvec3 point(0.0);
        for (const glm::dvec3& corner : face) {
            // Corners and edges are as likely as the inside.
            const double weight = share(random) < 0.5 ? 0 : share(random);
            point += weight * corner;
            sum += weight;
        }
        return glm::dvec3(toWorld * glm::dvec4(sum > 0 ? point / sum : face[0], 1));
    };
    std::vector<RefinedMesh::Line> lines;
    for (int k = 0; k < count; ++k) {
        RefinedMesh::Line line;
        line.face = int32_t(random() % uint32_t(mesh.faceCount()));
        line.accuracy = accuracy;
        const std::vector<glm::dvec3> face = faceOf(mesh, size_t(line.face));
        for (int p = 0; p < 2 + k % 3; ++p) line.points.push_back(pointOn(face));
        lines.push_back(line);
    }
    return lines;
}

TEST(RefinedMesh, LinesBecomeEdges) {
    const Mesh plane = rectangle("plane", {-3, -2, 0}, {6, 0, 0}, {0, 4, 0});
    RefinedMesh refined(plane, kTurned);
    std::vector<glm::dvec3> corners{{-2.9, -1, 0}, {1.3, -1.4, 0}, {2, 1.1, 0}, {-0.7, 0.9, 0}};
    double length = 0;
    for (size_t k = 1; k < corners.size(); ++k) length += glm::distance(corners[k - 1], corners[k]);
    for (glm::dvec3& corner : corners) corner = kTurned * glm::dvec4(corner, 1);
    refined.addLines({{0, corners, 1e-3}}, SIZE_MAX);
    auto shown = [&] {
        double sum = 0;
        const Mesh mesh = refined.result().withAttributesOf(plane);
        for (const uint64_t key : mesh.sharpEdges)
            sum += double(glm::distance(mesh.vertices[size_t(key >> 32)],
                                        mesh.vertices[size_t(key & 0xffffffffu)]));
        return sum;
    };
    EXPECT_NEAR(shown(), length, 1e-5);
    EXPECT_LT(refined.vertexCount(), 12u);
    expectSame(plane, refined.result());
    refineAlong(refined, wave, 8);
    EXPECT_NEAR(shown(), length, 1e-5);
    expectSame(plane, refined.result());
}

// Lines are given up where they meet each other, or an edge of the source, at a small angle. Random
// lines are a harder test than shadows: they run close beside edges. Few angles then stay small.
TEST(RefinedMesh, LinesLeaveFewSmallAngles) {
    std::mt19937 random(5);
    for (const Mesh& mesh : {rectangle("plane", {-3, -2, 0}, {6, 0, 0}, {0, 4, 0}),
                             box("cube", {0, 0, 0}, {1, 1.3f, 1.7f}, false)}) {
        size_t small = 0, all = 0;
        for (int trial = 0; trial < 20; ++trial) {
            RefinedMesh refined(mesh, kTurned);
            refined.addLines(randomLines(mesh, kTurned, 6, 0.02, random), SIZE_MAX);
            refined.improve(1 << 20);
            refineAlong(refined, wave, 4);
            expectSame(mesh, refined.result());
            const Mesh result = refined.result().withAttributesOf(mesh);
            for (size_t f = 0; f < result.faceCount(); ++f)
                small += smallestAngle(faceOf(result, f)) < 20;
            all += result.faceCount();
        }
        std::printf("[ figures  ] %s: %zu of %zu triangles\n", mesh.name.c_str(), small, all);
        EXPECT_LT(double(small), 0.05 * double(all)) << mesh.name;
    }
}

TEST(RefinedMesh, LinesKeepTheLimitOfVertices) {
    const Mesh plane = rectangle("plane", {-3, -2, 0}, {6, 0, 0}, {0, 4, 0});
    std::mt19937 random(5);
    const std::vector<RefinedMesh::Line> lines = randomLines(plane, kTurned, 30, 0.01, random);
    for (size_t most : {4, 5, 9, 10, 30}) {
        RefinedMesh refined(plane, kTurned);
        refined.addLines(lines, most);
        EXPECT_LE(refined.vertexCount(), most);
        EXPECT_GE(refined.vertexCount() + 1, most);
    }
}

TEST(RefinedMesh, AnyMeshSurvives) {
    std::mt19937 random(7);
    for (int trial = 0; trial < 200; ++trial) {
        auto number = [&](int most) { return int(random() % uint32_t(most)); };
        std::vector<glm::vec3> vertices;
        const int count = 4 + number(20);
        for (int v = 0; v < count; ++v)
            // Few different coordinates: faces that coincide, cross and have no area.
            vertices.push_back(0.25f * glm::vec3(number(5), number(5), number(3)));
        std::vector<std::vector<int32_t>> faces;
        for (int f = 0; f < 1 + number(12); ++f) {
            std::vector<int32_t> face;
            for (int k = 0; k < 3 + number(4); ++k) face.push_back(number(count));
            faces.push_back(face);
        }
        const Mesh mesh = polygons("any", vertices, faces);
        RefinedMesh refined(mesh, kTurned);
        if (trial % 2)
            refined.addLines(randomLines(mesh, kTurned, 5, 0.01 * (1 + number(3)), random), 5000);
        for (int round = 0; round < 4; ++round) {
            const size_t triangles = refined.triangles().size();
            for (uint32_t t = 0; t < triangles; ++t)
                if (number(3) == 0) refined.refine(t);
            refined.improve(5000);
        }
        const Mesh result = refined.result().withAttributesOf(mesh);
        for (const glm::vec3& v : result.vertices)
            ASSERT_TRUE(std::isfinite(v.x + v.y + v.z)) << trial;
        for (int32_t v : result.cornerVertices) ASSERT_LT(size_t(v), result.vertices.size());
    }
}

}  // namespace
}  // namespace raybundle
