// SPDX-License-Identifier: GPL-3.0-or-later
//
// Walls that pass through floors or stand on them: each patch lies on one side of every wall, and
// so does the light at corners. The exact answer is known: a sealed room under a sky is dark
// inside.
#include "patches/crossings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <string>

#include "bake/bake.h"
#include "reconstruction/corner_weights.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// A room of 5 x 5 m within a floor of 8 x 8 m. Its planes are larger than the room and pass through
// each other. All are white and under a sky of radiance 1 W/(m^2 sr).
struct SealedRoom {
    const char* name = "";
    int floorCells = 16, wallCells = 12;
    double turn = 0;          // rotation of the walls about the vertical, radians
    bool isStanding = false;  // walls end at the floor, at each other and at the ceiling
    float thickness = 0;      // of the walls, m; 0: planes
    glm::dmat4 pose{1.0};     // transform of the whole scene
};

glm::dmat4 turned(double angle) { return glm::rotate(glm::dmat4(1), angle, glm::dvec3(0, 0, 1)); }

Scene sceneOf(const SealedRoom& room) {
    Scene scene;
    scene.worldRadiance = glm::vec3(1);
    const Material white = grey("white", 0.8f);
    place(scene, grid("floor", {-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, room.floorCells, room.floorCells),
          white, room.pose);
    const float half = room.isStanding ? 2.5f + room.thickness / 2 : 3.2f;
    const float low = room.isStanding ? 0.0f : -1.7f, high = room.isStanding ? 2.8f : 4.7f;
    for (int k = 0; k < 4; ++k) {
        const glm::dmat4 pose = room.pose * turned(room.turn + k * glm::radians(90.0));
        if (room.thickness > 0)
            place(scene,
                  box("wall", {-half, 2.5f - room.thickness / 2, low},
                      {half, 2.5f + room.thickness / 2, high}, false),
                  white, pose);
        else
            place(scene,
                  grid("wall", {-half, 2.5f, low}, {2 * half, 0, 0}, {0, 0, high - low},
                       room.wallCells, room.wallCells),
                  white, pose);
    }
    place(scene, grid("ceiling", {-3.2f, -3.2f, 2.8f}, {0, 6.4f, 0}, {6.4f, 0, 0}, 12, 12), white,
          room.pose * turned(room.turn));
    return scene;
}

std::vector<SealedRoom> sealedRooms() {
    const glm::dmat4 tilted = glm::rotate(glm::dmat4(1), 0.4, glm::normalize(glm::dvec3(3, 1, 2)));
    const glm::dmat4 far = glm::translate(glm::dmat4(1), glm::dvec3(300, -200, 100)) * tilted;
    return {{"aligned"},
            {"between the edges of the floor", 17},
            {"turned", 16, 12, 0.37},
            {"turned, tilted and far away", 16, 12, 0.37, false, 0, far},
            {"a thousandth of it", 16, 12, 0.37, false, 0, glm::scale(tilted, glm::dvec3(1e-3))},
            {"through a single face", 1, 1, 0.37},
            {"fine walls", 16, 60, 0.37},
            {"fine floor", 60, 12, 0.37},
            {"standing", 16, 12, 0, true},
            {"standing turned", 16, 12, 0.37, true},
            {"thick", 16, 12, 0.37, false, 0.1f},
            {"thick and standing", 16, 12, 0, true, 0.1f},
            {"thick, standing and turned", 16, 12, 0.37, true, 0.1f}};
}

// Returns the distance of a corner of the floor from the centre of the room, measured along the
// walls, m.
double fromMiddle(const SealedRoom& room, const glm::dvec3& corner) {
    const glm::dvec3 p = glm::dvec3(glm::inverse(turned(room.turn)) * glm::dvec4(corner, 1));
    return std::max(std::abs(p.x), std::abs(p.y));
}

TEST(Crossings, ASealedRoomIsDarkInside) {
    for (const SealedRoom& room : sealedRooms())
        for (Reconstruction reconstruction :
             {Reconstruction::LEAST_SQUARES, Reconstruction::AREA_AVERAGE}) {
            // Both reconstructions where the walls lie between the edges of the floor.
            if (reconstruction == Reconstruction::AREA_AVERAGE &&
                (room.turn == 0 || room.pose != glm::dmat4(1) || room.wallCells > 12))
                continue;
            if (kFewBakes && reconstruction == Reconstruction::LEAST_SQUARES) continue;
            SCOPED_TRACE(std::string(room.name) + ", " + choiceName(reconstruction));
            const Scene scene = sceneOf(room);
            Bake bake;
            setQuick(bake);
            bake.settings.patchSize = 0;
            bake.settings.reconstruction = reconstruction;
            bake.run(scene);
            const Mesh& mesh = scene.meshes.front();
            const auto light = cornerLight(bake, 0, RB_OUTPUT_LIGHTING);
            double least = INFINITY, most = 0;
            size_t inside = 0;
            for (size_t f = 0; f < mesh.faceCount(); ++f) {
                // A face that a wall crosses belongs to the side of the wall on which its centre
                // lies.
                glm::dvec3 middle(0.0);
                for (int k = 0; k < 4; ++k)
                    middle +=
                        0.25 * glm::dvec3(mesh.vertices[size_t(mesh.cornerVertices[4 * f + k])]);
                for (size_t c = 4 * f; c < 4 * f + 4; ++c) {
                    const glm::dvec3 corner(mesh.vertices[size_t(mesh.cornerVertices[c])]);
                    const double away = fromMiddle(room, corner);
                    const double value = double(light[c].x);
                    const bool isOnLine =
                        room.turn == 0 && room.thickness == 0 && fromMiddle(room, middle) < 2.5;
                    if (away < 2.4 || (away < 2.5001 && isOnLine)) {
                        ++inside;
                        most = std::max(most, value);
                    } else if (away > 2.6) {
                        least = std::min(least, value);
                    }
                }
            }
            EXPECT_EQ(inside > 0, room.floorCells > 1);
            EXPECT_LT(most, 1e-3);
            // A wall hides half of the sky. The floor below the ends of thick walls is dark.
            if (room.thickness == 0) {
                EXPECT_GT(least, 0.45);
            }
        }
}

TEST(Crossings, PatchesLieOnOneSideAndCoverTheFace) {
    for (const SealedRoom& room : sealedRooms()) {
        SCOPED_TRACE(room.name);
        const Patches patches = subdivide(sceneOf(room), 0, kMany);
        const double scale = glm::length(glm::dvec3(room.pose[0]));
        const glm::dmat4 toRoom = glm::inverse(room.pose * turned(room.turn));
        std::vector<double> area(7, 0);
        for (uint32_t patch = 0; patch < patches.count(); ++patch) {
            const Parent& parent = patches.parentAt(2 * patch);
            if (parent.instance < 7) area[parent.instance] += double(patches.area[patch]);
            if (parent.instance != 0) continue;
            double least = INFINITY, most = 0;
            for (const glm::vec2& uv : {glm::vec2(0, 0), glm::vec2(1, 0), glm::vec2(0, 1),
                                        glm::vec2(parent.isTriangle ? 0.0f : 1.0f, 1)}) {
                const glm::dvec4 at(glm::dvec3(patches.point(patch, uv)) + patches.centre, 1);
                const glm::dvec3 p = glm::dvec3(toRoom * at);
                const double away = std::max(std::abs(p.x), std::abs(p.y));
                least = std::min(least, away);
                most = std::max(most, away);
            }
            // A wall that leaves less than this share of a patch of up to half a metre does not cut
            // it.
            const double wall = 2.5 - double(room.thickness) / 2;
            ASSERT_FALSE(least < wall - 0.02 && most > wall + 0.02) << least << " to " << most;
        }
        EXPECT_NEAR(area[0], 64 * scale * scale, 1e-4 * 64 * scale * scale);
        if (room.thickness == 0 && !room.isStanding) {
            EXPECT_NEAR(area[1], 6.4 * 6.4 * scale * scale, 1e-4 * 41 * scale * scale);
        }
    }
}

TEST(Crossings, WhatAPatchCountsAtCornersIsWhole) {
    const Patches patches = subdivide(sceneOf({"turned", 5, 12, 0.37}), 0, kMany);
    const InstanceRange all{0, uint32_t(patches.cells.size()), 0, uint32_t(patches.parents.size())};
    const std::vector<float> exposed(patches.sideCount(), 1.0f);
    const CornerWeights weights({patches, exposed}, all, RB_SIDE_FRONT);
    size_t parted = 0;
    for (uint32_t p = 0; p < patches.parents.size(); ++p) {
        parted += weights.isParted(p);
        for (uint32_t k = 0; k < patches.parents[p].patchCount(); ++k) {
            float sum = 0;
            for (float weight : weights.of(p, k).corner) {
                EXPECT_GE(weight, -1e-4f);
                sum += weight;
            }
            // The weights of a patch sum to 1, or to 0 if the patch is surrounded by walls.
            EXPECT_TRUE(std::abs(sum - 1) < 1e-4f || sum == 0) << sum;
        }
    }
    EXPECT_GT(parted, 8u);
}

// In a white furnace everything that is seen has an irradiance of 1 W/m^2. A box covers a corner of
// the floor. The dark floor under the box, or inside it, must not affect the light at that corner.
TEST(Crossings, ACornerUnderABoxHasTheLightOfWhatIsSeen) {
    for (float low : {0.0f, -0.1f})
        for (double turn : {0.0, 0.3})
            for (Reconstruction reconstruction :
                 {Reconstruction::LEAST_SQUARES, Reconstruction::AREA_AVERAGE,
                  Reconstruction::POINT}) {
                SCOPED_TRACE(std::string(choiceName(reconstruction)) +
                             (low < 0 ? ", sunk" : ", standing"));
                const glm::dmat4 pose = glm::rotate(glm::dmat4(1), turn, glm::dvec3(1, 2, 3));
                Scene scene = closedCube(0.6f, 0.4f);
                scene.instances.front().transform = pose;
                place(scene, box("box", {-0.05f, -0.05f, low}, {0.4f, 0.45f, 0.5f}, false),
                      grey("", 0.6f, 0.4f), pose);
                Bake bake;
                setQuick(bake);
                bake.settings.patchSize = 0.1f;
                bake.settings.reconstruction = reconstruction;
                bake.run(scene);
                for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_LIGHTING))
                    EXPECT_NEAR(double(light.x) * kPi, 1, 1e-3);
            }
}

size_t patchesOf(const Patches& patches, uint32_t instance) {
    size_t count = 0;
    for (const Parent& parent : patches.parents)
        if (parent.instance == instance) count += parent.patchCount();
    return count;
}

TEST(Crossings, WhatIsNarrowerThanAPatchCutsNothing) {
    const Material white = grey("white", 0.5f);
    Scene scene;
    place(scene, rectangle("floor", {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}), white);
    place(scene, box("leg", {-1, -1, -0.1f}, {-0.95f, -0.95f, 1}, false), white);
    EXPECT_EQ(patchesOf(subdivide(scene, 0.25f, kMany), 0), 256u);
    place(scene, box("cupboard", {0.1f, 0.1f, 0}, {1.1f, 1.2f, 1.8f}, false), white);
    EXPECT_GT(patchesOf(subdivide(scene, 0.25f, kMany), 0), 256u);
}

TEST(Crossings, AThousandLeavesThatCrossAreWhole) {
    Scene scene;
    std::vector<glm::vec3> vertices;
    std::vector<std::vector<int32_t>> faces;
    for (int32_t k = 0; k < 1000; ++k) {
        const float turn = float(k), x = 0.1f * float(k % 10), y = 0.1f * float(k / 10 % 10);
        const glm::vec3 at(x, y, 0.1f * float(k / 100)), a(std::cos(turn), std::sin(turn), 0.3f);
        const glm::vec3 b = glm::cross(a, glm::vec3(0, 0.2f, 1));
        for (const glm::vec3& v : {at, at + 0.2f * a, at + 0.2f * (a + b), at + 0.2f * b})
            vertices.push_back(v);
        faces.push_back({4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3});
    }
    place(scene, polygons("leaves", vertices, faces), grey("green", 0.5f));
    EXPECT_EQ(subdivide(scene, 1, kMany).count(), 1000u);
    // Faces that are large compared with the patches are cut, but only up to a limit, and a warning
    // states that not all were cut.
    const Patches cut = subdivide(scene, 0.05f, kMany);
    EXPECT_LT(cut.parents.size(), 60000u);
}

}  // namespace
}  // namespace raybundle
