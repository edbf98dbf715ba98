// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/sheets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "bundles/fragment_lists.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

Patches patchesOf(Mesh mesh, float patchSize) {
    Scene scene;
    place(scene, std::move(mesh), grey("", 0.5f));
    return subdivide(scene, patchSize, kMany);
}

// Starts each face at a random corner, as in subdivided meshes.
Mesh turned(Mesh mesh, uint32_t seed) {
    std::mt19937 random(seed);
    for (size_t f = 0; f < mesh.faceCount(); ++f) {
        const auto first = mesh.cornerVertices.begin() + mesh.faceOffsets[f];
        std::rotate(first, first + random() % 4,
                    mesh.cornerVertices.begin() + mesh.faceOffsets[f + 1]);
    }
    return mesh;
}

// Returns the mesh without the faces for which isDropped(face) is true.
template <class Drop>
Mesh without(const Mesh& mesh, const Drop& isDropped) {
    std::vector<std::vector<int32_t>> faces;
    for (size_t f = 0; f < mesh.faceCount(); ++f)
        if (!isDropped(f))
            faces.emplace_back(mesh.cornerVertices.begin() + mesh.faceOffsets[f],
                               mesh.cornerVertices.begin() + mesh.faceOffsets[f + 1]);
    return polygons(mesh.name, mesh.vertices, faces);
}

// Checks that every patch is in one sheet or in one loose parent, and that the sheets have the
// right positions.
void expectWhole(const Patches& patches) {
    std::vector<int> found(patches.count(), 0);
    for (uint32_t parent : patches.sheets.loose)
        for (uint32_t k = 0; k < patches.parents[parent].patchCount(); ++k)
            ++found[patches.parents[parent].firstPatch + k];
    for (const Sheet& sheet : patches.sheets.sheets) {
        ASSERT_EQ(sheet.patches.size(), size_t(sheet.columns) * sheet.rows);
        for (size_t k = 0; k < sheet.outline.size(); ++k)
            ASSERT_EQ(sheet.outline[k][1], sheet.outline[(k + 1) % sheet.outline.size()][0]);
        for (uint32_t row = 0; row < sheet.rows; ++row)
            for (uint32_t column = 0; column < sheet.columns; ++column) {
                const float s = (float(column) + 0.3f) / float(sheet.columns);
                const float t = (float(row) + 0.6f) / float(sheet.rows);
                const uint32_t patch = sheet.grid().patchAt(s, t);
                if (patch >= Sheet::kUneven) continue;
                ++found[patch];
                const glm::vec3 point = sheet.origin + s * sheet.a + t * sheet.b;
                ASSERT_EQ(patches.patchAt(patches.parentOf[patch], point), patch);
                // The point lies inside the patch; patchAt alone would clamp an outside point.
                const glm::vec3 middle = patches.point(patch, {0.5f, 0.5f});
                const float reach = glm::length(sheet.a) / float(sheet.columns) +
                                    glm::length(sheet.b) / float(sheet.rows);
                ASSERT_LT(glm::distance(point, middle), 0.5f * reach);
            }
        for (size_t place = 0; place + 1 < sheet.firstPart.size(); ++place)
            for (uint32_t k = sheet.firstPart[place]; k < sheet.firstPart[place + 1]; ++k) {
                const Parent& parent = patches.parents[sheet.parts[k].parent];
                for (uint32_t p = 0; p < parent.patchCount(); ++p) {
                    ++found[parent.firstPatch + p];
                    // The sheet returns the patch at the centre of the patch.
                    const glm::vec2 middle(parent.isTriangle ? 1.0f / 3 : 0.5f);
                    const glm::dvec3 d(parent.position(parent.pointOn(p, middle)) - sheet.origin);
                    const glm::dvec3 a(sheet.a), b(sheet.b), n = glm::cross(a, b);
                    const double square = glm::dot(n, n);
                    const float s = float(glm::dot(glm::cross(d, b), n) / square);
                    const float t = float(glm::dot(glm::cross(a, d), n) / square);
                    const uint32_t uneven = Sheet::kUneven + uint32_t(place);
                    ASSERT_EQ(sheet.grid().patchAt(s, t), uneven);
                    ASSERT_EQ(sheet.patchIn(uneven, patches, s, t), parent.firstPatch + p);
                }
            }
    }
    for (int count : found) ASSERT_EQ(count, 1);
}

TEST(Sheets, AGridIsOne) {
    // 7 x 5 faces of 2 x 3 patches, in an inclined plane.
    const Mesh mesh = grid("grid", {1, 2, 3}, {1.3f, 0.2f, 0.4f}, {-0.3f, 1.5f, 0.2f}, 7, 5);
    for (uint32_t seed : {1u, 2u, 3u}) {
        const Patches patches = patchesOf(turned(mesh, seed), 0.1f);
        ASSERT_EQ(patches.sheets.sheets.size(), 1u);
        EXPECT_TRUE(patches.sheets.loose.empty());
        EXPECT_EQ(patches.sheets.sheets[0].outline.size(), 2u * (7 + 5));
        expectWhole(patches);
    }
}

TEST(Sheets, HolesAndCornersAreLeftOut) {
    // A wall with a window, a step at its corner, and a single face beside it.
    const Mesh wall = grid("wall", {0, 0, 0}, {10, 0, 0}, {0, 0, 6}, 10, 6);
    const Mesh cut = without(wall, [](size_t f) {
        const size_t x = f % 10, y = f / 10;
        return (x >= 3 && x < 6 && y >= 2 && y < 4) || (x == 0 && y > 3);
    });
    const Patches patches = patchesOf(turned(cut, 4), 0.5f);
    expectWhole(patches);
    EXPECT_LE(patches.sheets.sheets.size() + patches.sheets.loose.size(), 6u);
}

TEST(Sheets, FacesOfSeveralSizesAreSeveral) {
    // Columns of two widths form two sheets, each with its own patches.
    std::vector<glm::vec3> vertices;
    std::vector<std::vector<int32_t>> faces;
    const float x[] = {0, 1, 2, 3, 3.5f, 4, 4.5f};
    for (int j = 0; j < 4; ++j)
        for (float at : x) vertices.emplace_back(at, float(j), 0);
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 6; ++i)
            faces.push_back({7 * j + i, 7 * j + i + 1, 7 * j + i + 8, 7 * j + i + 7});
    const Patches patches = patchesOf(polygons("", vertices, faces), 0.25f);
    EXPECT_EQ(patches.sheets.sheets.size(), 2u);
    expectWhole(patches);
}

TEST(Sheets, BentSurfacesAreNone) {
    Mesh tube = grid("tube", {0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 16, 4);
    for (glm::vec3& v : tube.vertices) {
        const float angle = 3.0f * v.x;
        v = {std::cos(angle), std::sin(angle), v.z};
    }
    const Patches strips = patchesOf(tube, 0.1f);
    EXPECT_EQ(strips.sheets.sheets.size(), 16u) << "only along the axis it is straight";
    expectWhole(strips);

    // Bent so little that neighbours are congruent, but in all by more than the touch distance.
    Mesh sagging = grid("sagging", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 32, 1);
    for (glm::vec3& v : sagging.vertices) v.z = 2e-5f * std::sin(3.14159265f * v.x);
    const Patches sagged = patchesOf(sagging, 0.1f);
    EXPECT_TRUE(sagged.sheets.sheets.empty());
    expectWhole(sagged);

    const Patches ball = patchesOf(icosphere("ball", 1, 2, false), 0.1f);
    EXPECT_TRUE(ball.sheets.sheets.empty()) << "triangles";
    expectWhole(ball);
}

TEST(Sheets, WhatTouchesItselfIsNotProjectedTwice) {
    // Two faces in the same place at one edge, with both windings.
    const std::vector<glm::vec3> v{{0, 0, 0}, {1, 0, 0}, {2, 0, 0},
                                   {0, 1, 0}, {1, 1, 0}, {2, 1, 0}};
    const Patches patches =
        patchesOf(polygons("", v, {{0, 1, 4, 3}, {1, 2, 5, 4}, {1, 2, 5, 4}, {4, 5, 2, 1}}), 0.25f);
    expectWhole(patches);
}

// A closed room whose walls are grids with common vertices at the edges, and a box of grids in the
// room.
Scene roomOfGrids() {
    auto cube = [](const std::string& name, float size, int n, bool inward) {
        std::map<std::array<int, 3>, int32_t> numbers;
        std::vector<glm::vec3> vertices;
        std::vector<std::vector<int32_t>> faces;
        auto vertex = [&](const std::array<int, 3>& at) {
            const auto [found, isNew] = numbers.emplace(at, int32_t(vertices.size()));
            if (isNew)
                vertices.push_back(size * (glm::vec3(at[0], at[1], at[2]) / float(n) - 0.5f));
            return found->second;
        };
        for (int axis = 0; axis < 3; ++axis)
            for (int high = 0; high < 2; ++high)
                for (int i = 0; i < n; ++i)
                    for (int j = 0; j < n; ++j) {
                        auto at = [&](int di, int dj) {
                            std::array<int, 3> p;
                            p[size_t(axis)] = high * n;
                            p[size_t(axis + 1) % 3] = i + di;
                            p[size_t(axis + 2) % 3] = j + dj;
                            return vertex(p);
                        };
                        std::vector<int32_t> face{at(0, 0), at(1, 0), at(1, 1), at(0, 1)};
                        if ((high == 0) != inward) std::reverse(face.begin(), face.end());
                        faces.push_back(face);
                    }
        return polygons(name, vertices, faces);
    };
    Scene scene;
    const glm::dmat4 tilt = glm::dmat4(glm::dmat3(
        glm::dvec3(0.8, 0.6, 0), glm::dvec3(-0.48, 0.64, 0.6), glm::dvec3(0.36, -0.48, 0.8)));
    place(scene, turned(cube("room", 2, 9, true), 5), grey("", 0.5f), tilt);
    place(scene, turned(cube("box", 0.7f, 4, false), 6), grey("", 0.5f));
    return scene;
}

// Two neighbouring objects whose vertices have rounding errors. Some of the vertices at the common
// edge are welded and some are not.
TEST(Sheets, PartlyWeldedObjectsHaveClosedOutlines) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> off(-1e-6f, 1e-6f);
    size_t joined = 0;
    for (int k = 0; k < 50; ++k) {
        Scene scene;
        for (float x : {-2.0f, 0.0f}) {
            Mesh mesh = grid("half", {x, 0, 1}, {2, 0, 0}, {0, 3, 0}, 8, 12);
            for (glm::vec3& vertex : mesh.vertices)
                vertex += glm::vec3(off(random), off(random), off(random));
            place(scene, std::move(mesh), grey("", 0.5f));
        }
        place(scene, rectangle("floor", {-8, -8, 0}, {16, 0, 0}, {0, 16, 0}), grey("", 0.5f));
        const Patches patches = subdivide(scene, 1, kMany);
        expectWhole(patches);
        joined += patches.sheets.joined;
    }
    EXPECT_GT(joined, 0u);
}

// Expects that bundles through the sheets equal bundles through the separate parents.
void expectSameBundles(const Patches& patches) {
    Patches single = patches;
    single.sheets = withoutSheets(single);
    FragmentLists bySheet(patches, 0.02f), byParent(single, 0.02f);
    uint64_t all = 0, different = 0;
    for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 7).next(100)) {
        BundleLines a, b;
        bySheet.project(bundle, a);
        byParent.project(bundle, b);
        ASSERT_EQ(a.lines, b.lines);
        ASSERT_EQ(a.sky.size(), b.sky.size());
        for (uint32_t side : a.sky) ASSERT_EQ(side % 2, 1u) << "a line left the closed room";
        std::map<std::pair<uint32_t, uint32_t>, int> balance;
        for (const Exchange& e : a.exchanges) {
            balance[{e.i, e.j}] += int(e.lines);
            all += e.lines;
        }
        for (const Exchange& e : b.exchanges) balance[{e.i, e.j}] -= int(e.lines);
        for (const auto& [pair, lines] : balance) different += uint64_t(std::abs(lines));
    }
    // A line that meets the border of two patches within rounding (1e-6 of a patch) may count for
    // either patch.
    EXPECT_LT(double(different), 1e-4 * double(all));
}

TEST(Sheets, BundlesAreTheSame) {
    const Patches patches = subdivide(roomOfGrids(), 0.08f, kMany);
    ASSERT_EQ(patches.sheets.sheets.size(), 12u);
    expectSameBundles(patches);
}

// The faces of a floor below a box are cut along the outline of the box, and some tiles are cut.
// The floor remains one sheet.
TEST(Sheets, WhatWallsAndLightCutStaysOne) {
    Scene scene = roomOfGrids();
    const Patches room = subdivide(scene, 0.08f, kMany);
    place(scene, box("box", {-0.33f, -0.21f, -1}, {0.33f, 0.21f, -0.8f}, false), grey("box", 0.5f),
          scene.instances[0].transform * glm::rotate(glm::dmat4(1), 0.3, glm::dvec3(0, 0, 1)));
    Patches patches = subdivide(scene, 0.08f, kMany);
    ASSERT_GT(patches.crossedCells.size(), 3u);
    std::vector<uint8_t> levels(patches.tileCount);
    for (size_t k = 0; k < levels.size(); ++k) levels[k] = k % 11 == 0 ? 1 : k % 37 == 0 ? 2 : 0;
    for (bool isCut : {false, true}) {
        SCOPED_TRACE(isCut);
        if (isCut) cutTiles(scene, patches, levels);
        EXPECT_EQ(patches.sheets.sheets.size(), room.sheets.sheets.size());
        EXPECT_EQ(patches.sheets.loose.size(), 6u) << "the box";
        expectWhole(patches);
        expectSameBundles(patches);
    }
}

TEST(Sheets, NothingThatExchangesMakesNoLines) {
    Scene scene = closedCube(0.5f);
    scene.instances[0].exchanges = false;
    const Patches patches = subdivide(scene, 0.25f, kMany);
    EXPECT_TRUE(patches.sheets.sheets.empty());
    EXPECT_TRUE(patches.sheets.loose.empty());
    BundleLines lines;
    FragmentLists(patches, 0.1f)
        .project(Directions(DirectionKind::RANDOM, 3).next(2).front(), lines);
    EXPECT_EQ(lines.lines, 0u);
    EXPECT_TRUE(lines.sky.empty());
}

}  // namespace
}  // namespace raybundle
