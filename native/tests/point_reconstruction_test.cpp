// SPDX-License-Identifier: GPL-3.0-or-later
//
// POINT: the light at the corners, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "lights/mesh_outline.h"
#include "reconstruction/corner_receivers.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// Receivers lie 1 % of the way from the corner to the centre of its face: 0.7 % of an edge. In
// these scenes the light changes by less than its own value over an edge.
constexpr double kReceiverOffset = 0.01;

struct PointBake : Bake {
    explicit PointBake(const Scene& scene, Reconstruction reconstruction = Reconstruction::POINT) {
        settings.reconstruction = reconstruction;
        settings.targetError = 0.005f;
        settings.maxBundles = 256;
        run(scene);
    }
};

// Calls check(position, corner, LIGHTING * pi) for each corner of the first instance, which has no
// transform.
template <class Check>
void forEachCorner(const Scene& scene, const Bake& bake, const Check& check) {
    const Mesh& mesh = scene.meshes[0];
    const std::vector<glm::vec3> light = cornerLight(bake, 0, RB_OUTPUT_LIGHTING);
    for (size_t c = 0; c < light.size(); ++c)
        check(mesh.vertices[size_t(mesh.cornerVertices[c])], c, double(light[c].x) * kPi);
}

// A ground of 4 x 4 faces of 1 m below a square lamp of 1 m, which is 1 m above the centre.
Scene groundBelowLamp(float reflectance = 0) {
    Scene scene;
    place(scene, grid("ground", {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 4, 4), grey("", reflectance));
    scene.addLight(areaLight({0, 0, 1}, {0, 0.5, 0}, {0.5, 0, 0}, {1, 1, 1}));
    return scene;
}

double lampIrradiance(const glm::vec3& point) {
    const glm::dvec3 lamp[4] = {{-0.5, -0.5, 1}, {0.5, -0.5, 1}, {0.5, 0.5, 1}, {-0.5, 0.5, 1}};
    return polygonIrradiance(point, {0, 0, 1}, lamp, 4);
}

TEST(PointReconstruction, SmallBoxesInVastScenesHaveNoDarkEdges) {
    // Rays start further behind their surface than the receivers of the corners lie inside it. They
    // start behind the next face of the box, which they must not meet.
    Scene scene;
    place(scene, box("box", {0, 0, 1}, {0.1f, 0.1f, 1.1f}, false), grey("", 0));
    place(scene, rectangle("plain", {-1000, -1000, 0}, {2000, 0, 0}, {0, 2000, 0}), grey("", 0),
          glm::dmat4(1), RB_ROLE_OCCLUDE);
    const glm::dvec3 sun = glm::normalize(glm::dvec3(1, 2, 3));
    scene.addLight(sunLight(sun, {4, 4, 4}));
    const Mesh& mesh = scene.meshes[0];
    forEachCorner(scene, PointBake(scene), [&](const glm::vec3&, size_t c, double found) {
        const int32_t* face = &mesh.cornerVertices[c / 4 * 4];
        const glm::dvec3 origin(mesh.vertices[size_t(face[0])]);
        const glm::dvec3 normal =
            glm::normalize(glm::cross(glm::dvec3(mesh.vertices[size_t(face[1])]) - origin,
                                      glm::dvec3(mesh.vertices[size_t(face[3])]) - origin));
        EXPECT_NEAR(found, 4 * std::max(0.0, glm::dot(normal, sun)), 1e-3) << "corner " << c;
    });
}

// At a corner of one of two plates that face each other very closely, the other plate hides a
// quarter of the surroundings: the form factor from a point to a rectangle above its corner at a
// small distance.
TEST(PointReconstruction, CornersBesideANarrowGapSeeOut) {
    Scene scene;
    place(scene, rectangle("plate", {0, 0, 0}, {0.2f, 0, 0}, {0, 0.2f, 0}), grey("", 0));
    place(scene, rectangle("other", {0, 0, 0.001f}, {0, 0.2f, 0}, {0.2f, 0, 0}), grey("", 0),
          glm::dmat4(1), RB_ROLE_OCCLUDE);
    scene.worldRadiance = glm::vec3(float(1 / kPi));
    // The receivers lie inside by 1/32 of the gap, which hides 3 % more. The final gather adds
    // noise.
    forEachCorner(scene, PointBake(scene), [](const glm::vec3&, size_t c, double found) {
        EXPECT_NEAR(found, 0.75, 0.04) << "corner " << c;
    });
}

TEST(PointReconstruction, CornersHaveTheLightAtThemselves) {
    const Scene scene = groundBelowLamp();
    forEachCorner(scene, PointBake(scene), [](const glm::vec3& at, size_t, double found) {
        EXPECT_NEAR(found, lampIrradiance(at), kReceiverOffset * lampIrradiance(at))
            << at.x << " " << at.y;
    });
}

TEST(PointReconstruction, CombinedIsWhatTheCornerReflects) {
    const Scene scene = groundBelowLamp(0.5f);
    const PointBake bake(scene);
    const auto lighting = cornerLight(bake, 0, RB_OUTPUT_LIGHTING);
    const auto combined = cornerLight(bake, 0, RB_OUTPUT_COMBINED);
    for (size_t c = 0; c < lighting.size(); ++c)
        EXPECT_NEAR(combined[c].x, 0.5f * lighting[c].x, 1e-4f * lighting[c].x);
}

TEST(PointReconstruction, FurnaceIsExact) {
    const Scene scene = roomWithBoxes(0.5f, 0.5f, 0.1f);
    forEachCorner(scene, PointBake(scene),
                  [](const glm::vec3&, size_t, double found) { EXPECT_NEAR(found, 1, 1e-4); });
}

TEST(PointReconstruction, SmoothCornersUseTheirShadingNormal) {
    Scene scene;
    Mesh ball = icosphere("ball", 1, 2, false);
    for (int32_t v : ball.cornerVertices)
        ball.cornerNormals.push_back(glm::normalize(ball.vertices[size_t(v)]));
    place(scene, ball, grey("", 0));
    const glm::vec3 sun = glm::normalize(glm::vec3(0.3f, -0.2f, 1));
    scene.addLight(sunLight(sun, {2, 2, 2}));
    forEachCorner(scene, PointBake(scene), [&](const glm::vec3& at, size_t, double found) {
        const float cosine = glm::dot(glm::normalize(at), sun);
        // Closer to the terminator some of the flat faces around the corner face away from the sun.
        if (std::abs(cosine) < 0.3f) return;
        EXPECT_NEAR(found, 2 * std::max(0.0f, cosine), 1e-4);
    });
}

TEST(PointReconstruction, CoveredCornersKeepTheLeastSquares) {
    // A box on the centre of the ground covers the faces around the centre vertex.
    Scene scene = groundBelowLamp(0.5f);
    place(scene, box("box", {-1, -1, 0}, {1, 1, 0.25f}, false), grey("", 0.5f));
    const PointBake point(scene);
    const PointBake leastSquares(scene, Reconstruction::LEAST_SQUARES);
    const auto expected = cornerLight(leastSquares, 0, RB_OUTPUT_LIGHTING);
    size_t covered = 0;
    forEachCorner(scene, point, [&](const glm::vec3& at, size_t c, double found) {
        if (at.x != 0 || at.y != 0) return;
        ++covered;
        EXPECT_NEAR(found, double(expected[c].x) * kPi, 1e-6);
    });
    EXPECT_EQ(covered, 4u);
}

TEST(PointReconstruction, ACornerUnderASmallBoxIsNotBlack) {
    // The box covers a corner of the ground and 1 % of its patch.
    Scene scene;
    place(scene, rectangle("ground", {0, 0, 0}, {4, 0, 0}, {0, 4, 0}), grey("", 0.5f));
    place(scene, box("box", {-0.1f, -0.1f, 0}, {0.1f, 0.1f, 0.2f}, false), grey("", 0.5f),
          glm::dmat4(1), RB_ROLE_OCCLUDE);
    scene.worldRadiance = glm::vec3(1);
    Bake bake;
    bake.settings.reconstruction = Reconstruction::POINT;
    bake.settings.patchSize = 1;
    bake.run(scene);
    for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_LIGHTING))
        EXPECT_NEAR(light.x, 1, 0.1f);
}

TEST(CornerReceivers, EachCornerOfEveryShapeHasOneInsideItsFace) {
    // A quad that is no parallelogram, a concave pentagon and a sliver, far from the origin,
    // mirrored, and baked on the back.
    Scene scene;
    const Mesh mesh = polygons(
        "shapes", {{0, 0, 0}, {3, 0, 0}, {2, 1, 0}, {0, 1, 0}, {1, 0.5f, 2}, {30, 0.01f, 0}},
        {{0, 1, 2, 3}, {0, 1, 2, 4, 3}, {0, 1, 5}});
    glm::dmat4 transform(1);
    transform[0][0] = -2;
    transform[3] = {1e4, -1e4, 50, 1};
    place(scene, mesh, grey("", 0.5f), transform, RB_ROLE_BAKE, RB_SIDE_BACK);
    const Patches patches = subdivide(scene, 0.2f, 100000);
    InstanceRange range;
    range.lastCell = uint32_t(patches.cells.size());
    range.lastParent = uint32_t(patches.parents.size());
    const auto receivers = cornerReceivers(scene, patches, 0, range);
    ASSERT_EQ(receivers.size(), mesh.cornerCount());
    for (const CornerReceiver& corner : receivers) {
        const uint32_t side = corner.receiver.side;
        EXPECT_EQ(side % 2, 1u);
        const Parent& parent = patches.parents[patches.parentOf[side / 2]];
        EXPECT_GE(corner.corner, mesh.faceOffsets[size_t(parent.face)]);
        EXPECT_LT(corner.corner, mesh.faceOffsets[size_t(parent.face) + 1]);
        const glm::dvec3 vertex = mesh.vertices[size_t(mesh.cornerVertices[size_t(corner.corner)])];
        const glm::vec3 at(glm::dvec3(transform * glm::dvec4(vertex, 1)) - patches.centre);
        // 1 % of the way to the centre of a face of at most 60 m.
        EXPECT_LT(glm::length(*corner.receiver.point - at), 0.4f);
        EXPECT_LT(glm::length(corner.receiver.normal - patches.normal(side)), 1e-6f);
    }
}

}  // namespace
}  // namespace raybundle
