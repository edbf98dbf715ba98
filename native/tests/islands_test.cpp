// SPDX-License-Identifier: GPL-3.0-or-later
//
// Distant objects, and the way in which surfaces are divided into meshes, affect neither patches,
// lines nor light.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <tuple>

#include "bundles/fragment_lists.h"
#include "patches/neighbours.h"
#include "patches/patch_size.h"
#include "patches/patches.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// Returns the mesh with separate vertices for each face.
Mesh split(const Mesh& mesh) {
    std::vector<glm::vec3> vertices;
    std::vector<std::vector<int32_t>> faces;
    for (size_t f = 0; f < mesh.faceCount(); ++f) {
        faces.emplace_back();
        for (int32_t c = mesh.faceOffsets[f]; c < mesh.faceOffsets[f + 1]; ++c) {
            faces.back().push_back(int32_t(vertices.size()));
            vertices.push_back(mesh.vertices[size_t(mesh.cornerVertices[size_t(c)])]);
        }
    }
    return polygons(mesh.name, std::move(vertices), faces);
}

// Returns the scene with split meshes; if `separate`, each face is also an instance of its own.
Scene cutApart(const Scene& scene, bool separate) {
    Scene result;
    result.lights = scene.lights;
    for (const Instance& instance : scene.instances) {
        const Mesh& mesh = scene.meshes[size_t(instance.mesh)];
        const Material& material = scene.materialOf(mesh, 0);
        const Mesh faces = split(mesh);
        if (!separate) {
            place(result, faces, material, instance.transform);
            continue;
        }
        for (size_t f = 0; f < faces.faceCount(); ++f) {
            std::vector<glm::vec3> vertices;
            std::vector<int32_t> face;
            for (int32_t c = faces.faceOffsets[f]; c < faces.faceOffsets[f + 1]; ++c) {
                face.push_back(int32_t(vertices.size()));
                vertices.push_back(faces.vertices[size_t(c)]);
            }
            place(result, polygons(mesh.name, vertices, {face}), material, instance.transform);
        }
    }
    return result;
}

// A hall with a small ball, and a table of two boxes that stand against each other.
Scene hall() {
    Scene scene;
    const Material material = grey("", 0.5f);
    place(scene, box("hall", {-5, -5, -5}, {5, 5, 5}, true), material);
    place(scene, icosphere("ball", 0.25f, 2, false), material);
    place(scene, box("low", {1, 1, -5}, {1.2f, 1.2f, -4.5f}, false), material);
    place(scene, box("high", {1, 1, -4.5f}, {1.2f, 1.2f, -4.2f}, false), material);
    return scene;
}

TEST(Welding, SplitEdgesAndSeparateFacesLeaveThePatchesAsTheyAre) {
    const Patches whole = subdivide(hall(), 0, kMany);
    for (bool separate : {false, true}) {
        const Patches cut = subdivide(cutApart(hall(), separate), 0, kMany);
        ASSERT_EQ(cut.parents.size(), whole.parents.size());
        ASSERT_EQ(cut.count(), whole.count());
        for (size_t p = 0; p < whole.parents.size(); ++p) {
            ASSERT_EQ(cut.parents[p].isSolid, whole.parents[p].isSolid) << p;
            ASSERT_EQ(cut.parents[p].countA, whole.parents[p].countA) << p;
        }
        const auto pairsOf = [](const Patches& patches) {
            return neighbouringTiles(patches, 0, uint32_t(patches.parents.size())).size();
        };
        // Where the sides of the two boxes lie in one plane, they continue each other if they are
        // cut apart.
        EXPECT_GE(pairsOf(cut), pairsOf(whole));
        EXPECT_LE(pairsOf(cut), pairsOf(whole) + 4 * 16);
        EXPECT_EQ(cut.sheets.joined, whole.sheets.joined);
    }
}

TEST(Welding, BoxesThatStandAgainstEachOtherStayTwo) {
    const Patches patches = subdivide(hall(), 1, kMany);
    for (const Parent& a : patches.parents)
        for (const Parent& b : patches.parents)
            for (uint32_t v : a.vertex)
                if (!a.isTriangle && !b.isTriangle && a.instance != b.instance) {
                    ASSERT_EQ(std::count(b.vertex.begin(), b.vertex.end(), v), 0);
                }
}

TEST(Welding, RoundingOfTransformsDoesNotMatter) {
    // Two halves of a strip, one of which is moved by its matrix, a kilometre away.
    Scene scene;
    const Material material = grey("", 0.5f);
    place(scene, rectangle("left", {1000.1f, 0, 0}, {1, 0, 0}, {0, 1, 0}), material);
    place(scene, rectangle("right", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), material,
          glm::dmat4(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1001.1, 0, 0, 1));
    const Patches patches = subdivide(scene, 1, kMany);
    ASSERT_EQ(patches.count(), 2u);
    EXPECT_EQ(neighbouringTiles(patches, 0, 2).size(), 1u);
}

// --- automaticPatchSizes ---

Surface surfaceOf(const glm::dvec3& low, const glm::dvec3& size, uint32_t object,
                  bool seesItself = true, size_t faces = 6) {
    Surface surface;
    surface.extent.add(low);
    surface.extent.add(low + size);
    surface.area = 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
    surface.faces = faces;
    surface.object = object;
    surface.seesItself = seesItself;
    return surface;
}

// A room with a table and a cup.
std::vector<Surface> furnishedRoom(const glm::dvec3& at = glm::dvec3(0)) {
    return {surfaceOf(at, {16, 10, 5}, 0), surfaceOf(at + glm::dvec3(3, 3, 0), {0.6, 0.4, 0.7}, 1),
            surfaceOf(at + glm::dvec3(3.2, 3.2, 0.7), {0.08, 0.08, 0.1}, 2)};
}

double patchesOf(const PatchSizes& sizes, const std::vector<Surface>& surfaces, size_t first = 0) {
    double count = 0;
    for (size_t s = first; s < surfaces.size(); ++s)
        count +=
            std::max(double(surfaces[s].faces), surfaces[s].area / (sizes.size[s] * sizes.size[s]));
    return count;
}

TEST(PatchSizes, AnotherThingFarAwayDoesNotMatter) {
    const std::vector<Surface> room = furnishedRoom();
    const PatchSizes alone = automaticPatchSizes(room);
    ASSERT_EQ(alone.extent.size(), 1u);
    EXPECT_LT(alone.size[1], alone.size[0]);
    const double count = patchesOf(alone, room);
    for (double distance : {20.0, 100.0, 1000.0, 10000.0})
        for (const glm::dvec3& direction :
             {glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0.6, 0, -0.8)})
            for (double size : {0.01, 1.0, 15.0, 0.3 * distance}) {
                std::vector<Surface> both = room;
                const glm::dvec3 middle = glm::dvec3(8, 5, 2.5) + (distance + size + 8) * direction;
                both.push_back(surfaceOf(middle - size / 2, glm::dvec3(size), 3, false));
                const PatchSizes sizes = automaticPatchSizes(both);
                ASSERT_EQ(sizes.extent.size(), 2u) << distance << " " << size;
                for (size_t s = 0; s < room.size(); ++s) {
                    EXPECT_EQ(sizes.size[s], alone.size[s]);
                    EXPECT_EQ(sizes.island[s], 0u);
                }
                // The other object adds at most a quarter to the patches if it does not see itself.
                // One that is huge compared with the room may triple them, so that lines can be
                // dense enough for both.
                EXPECT_LE(patchesOf(sizes, both), (size > 100 ? 3 : 1.25) * count + 6);
            }
}

TEST(PatchSizes, DustFarAwayHasFewPatches) {
    std::vector<Surface> all = furnishedRoom();
    const PatchSizes alone = automaticPatchSizes(all);
    const double count = patchesOf(alone, all);
    for (int k = 0; k < 5000; ++k)
        all.push_back(surfaceOf({300 + 0.7 * (k * 37 % 101), 0.9 * (k * 53 % 97), 0.8 * (k % 89)},
                                {0.01, 0.02, 0}, 3, false, 1));
    const PatchSizes sizes = automaticPatchSizes(all);
    for (size_t s = 0; s < 3; ++s) EXPECT_EQ(sizes.size[s], alone.size[s]);
    EXPECT_LE(patchesOf(sizes, all, 3), 0.25 * count + 5000);
}

TEST(PatchSizes, ACopyHasTheSameSizes) {
    std::vector<Surface> both = furnishedRoom();
    const PatchSizes alone = automaticPatchSizes(both);
    for (const Surface& surface : furnishedRoom({0, 200, 0})) both.push_back(surface);
    const PatchSizes sizes = automaticPatchSizes(both);
    for (size_t s = 0; s < 3; ++s) {
        EXPECT_NEAR(sizes.size[s], alone.size[s], 1e-9);
        EXPECT_NEAR(sizes.size[s + 3], alone.size[s], 1e-9);
        // The copy at the origin belongs to the first island.
        EXPECT_EQ(sizes.island[s], 0u);
    }
}

TEST(PatchSizes, WhatObjectsAreCalledDoesNotMatter) {
    std::vector<Surface> room = furnishedRoom();
    const PatchSizes before = automaticPatchSizes(room);
    room[1].object = 2;
    room[2].object = 1;
    std::swap(room[0], room[2]);
    const PatchSizes after = automaticPatchSizes(room);
    EXPECT_EQ(after.size[0], before.size[2]);
    EXPECT_EQ(after.size[1], before.size[1]);
    EXPECT_EQ(after.size[2], before.size[0]);
}

TEST(PatchSizes, ManyTinyThingsHaveNoMoreThanTheirSurroundingsAreWorth) {
    std::vector<Surface> all = {surfaceOf({0, 0, 0}, {50, 50, 0.1}, 0, false)};
    const double count = patchesOf(automaticPatchSizes(all), all);
    for (int k = 0; k < 1000; ++k)
        all.push_back(surfaceOf({1.5 * (k % 32), 1.5 * (k / 32), 0.1}, glm::dvec3(0.05), 1, false));
    EXPECT_LE(patchesOf(automaticPatchSizes(all), all), 3 * (count + 6000));
}

// --- lines ---

using Pairs = std::map<std::tuple<uint32_t, uint32_t>, uint32_t>;

Pairs pairsOf(const BundleLines& lines) {
    Pairs pairs;
    for (const Exchange& e : lines.exchanges)
        pairs[{std::min(e.i, e.j), std::max(e.i, e.j)}] += e.lines;
    return pairs;
}

TEST(Islands, LinesAreThoseOfTheWholePlane) {
    Scene scene = roomWithBoxes(0.5f);
    const Material material = grey("", 0.5f);
    place(scene, box("far", {40, 0, 0}, {41, 1, 1}, false), material);
    place(scene, box("behind it", {60, 0, 0}, {61, 1, 1}, false), material);
    place(scene, icosphere("near", 0.5f, 1, false), material,
          glm::dmat4(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 2, -30, 1, 1));
    const Patches patches = subdivide(scene, 0.3f, kMany);
    ASSERT_EQ(patches.islands.size(), 4u);
    Patches one = patches;
    one.islands.resize(1);
    one.islands[0].reach = one.islands[0].radius = one.radius;
    for (Parent& parent : one.parents) parent.island = 0;
    FragmentLists apart(patches, 0.1f), together(one, 0.1f);
    Directions directions(DirectionKind::LOW_DISCREPANCY, 1);
    std::vector<Bundle> bundles = directions.next(64);
    // One bundle along the two boxes, one of which is behind the other.
    bundles[0].direction = glm::dvec3(1, 0, 0);
    bundles[0].right = glm::dvec3(0, 1, 0);
    bundles[0].up = glm::dvec3(0, 0, 1);
    for (const Bundle& bundle : bundles) {
        BundleLines a, b;
        apart.project(bundle, a);
        together.project(bundle, b);
        ASSERT_EQ(a.lines, b.lines);
        ASSERT_EQ(pairsOf(a), pairsOf(b));
        std::sort(a.sky.begin(), a.sky.end());
        std::sort(b.sky.begin(), b.sky.end());
        ASSERT_EQ(a.sky, b.sky);
    }
}

// --- bakes ---

TEST(Islands, ARoomHasItsLightWhateverIsFarAway) {
    Bake alone;
    alone.settings.targetError = 0.02f;
    alone.run(litRoom());
    const Json report = reportOf(alone);
    const std::vector<glm::vec3> light = everything(alone);
    struct Case {
        const char* name;
        float size, distance, emission;
    };
    for (const Case& far : {Case{"small", 1, 300, 0},
                            {"large", 200, 5000, 0},
                            {"lit", 1, 40, 5},
                            {"bright", 50, 2000, 100}}) {
        if (kFewBakes && far.emission == 0) continue;
        Scene scene = litRoom();
        const glm::vec3 low(2, 2 - far.distance, 0);
        place(scene, box("far", low, low + far.size, false), grey("far", 0.5f, far.emission));
        Bake bake;
        bake.settings.targetError = 0.02f;
        bake.run(scene);
        const Json with = reportOf(bake);
        EXPECT_LE(int(with["bundles"]), 2 * int(report["bundles"])) << far.name;
        EXPECT_LE(double(with["patches"]), 1.3 * double(report["patches"]) + 100) << far.name;
        EXPECT_LT(std::abs(double(with["energy"]["balance_error"])), 5e-3) << far.name;
        // Two bakes with 2 % of noise and different lines: three times the noise of independent
        // ones.
        EXPECT_LT(noise(everything(bake), light), 0.06) << far.name;
    }
}

}  // namespace
}  // namespace raybundle
