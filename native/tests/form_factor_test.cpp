// SPDX-License-Identifier: GPL-3.0-or-later
//
// Form factors by line counts and by Lambert's formula, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "lights/mesh_outline.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

constexpr uint32_t kManyBundles = 4096;

// One standard error of a form factor from as many independent lines as there are bundles, with the
// factor 4/3 for the cosine's weight. All lines of a bundle share a direction, so that more lines
// per bundle do not help. The low-discrepancy directions reduce the error by far more than a factor
// of 4, so that one such standard error is a safe bound.
double bound(double f) { return std::sqrt(4.0 / 3 * f * (1 - f) / kManyBundles); }

// Checks the form factor between two meshes in both directions, by reciprocity.
void expectFormFactor(const Mesh& from, const Mesh& to, double areaRatio, double exact,
                      double discretisation = 0) {
    for (float patchSize : {10.0f, 0.25f}) {
        Scene scene;
        place(scene, from, grey("", 0));
        place(scene, to, grey("", 0));
        const Patches patches = subdivide(scene, patchSize, kMany);
        const LineCounts counts = traceLines(patches, 0.05f, kManyBundles);
        EXPECT_NEAR(formFactor(patches, counts, 0, 1), exact,
                    bound(exact) + discretisation * exact);
        const double back = exact * areaRatio;
        EXPECT_NEAR(formFactor(patches, counts, 1, 0), back, bound(back) + discretisation * back);
    }
}

TEST(ClosedForms, AgreeWithTheirKnownValues) {
    EXPECT_NEAR(parallelRectangles(1, 1, 1), 0.19982489569838746, 1e-14);
    EXPECT_NEAR(parallelRectangles(1, 2, 1), 0.2858753848507147, 1e-14);
    EXPECT_NEAR(parallelRectangles(10, 10, 1), 0.8269945223972565, 1e-13);
    EXPECT_NEAR(perpendicularRectangles(1, 1, 1), 0.20004377607540316, 1e-14);
    EXPECT_NEAR(offsetRectangles({0, 1}, {0, 1}, {0.5, 1.8}, {-0.25, 0.55}, 0.7),
                0.17231218425894523, 1e-13);
    EXPECT_NEAR(offsetRectangles({0, 1}, {0, 1}, {0, 1}, {0, 1}, 1), parallelRectangles(1, 1, 1),
                1e-13);
    EXPECT_NEAR(coaxialDisks(1, 1, 1), 0.3819660, 1e-7);
    EXPECT_NEAR(parallelRectangles(1, 1, 1) + 4 * perpendicularRectangles(1, 1, 1), 1, 1e-14)
        << "a face of a cube sees the five others only";
}

TEST(FormFactor, ParallelSquares) {
    expectFormFactor(rectangle("low", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                     rectangle("high", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}), 1,
                     parallelRectangles(1, 1, 1));
}

TEST(FormFactor, ParallelRectangles) {
    expectFormFactor(rectangle("low", {0, 0, 0}, {1, 0, 0}, {0, 2, 0}),
                     rectangle("high", {0, 0, 1}, {0, 2, 0}, {1, 0, 0}), 1,
                     parallelRectangles(1, 2, 1));
}

TEST(FormFactor, PerpendicularRectanglesWithACommonEdge) {
    expectFormFactor(rectangle("floor", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                     rectangle("wall", {0, 0, 0}, {0, 1, 0}, {0, 0, 1}), 1,
                     perpendicularRectangles(1, 1, 1));
    expectFormFactor(rectangle("floor", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                     rectangle("wall", {0, 0, 0}, {0, 1, 0}, {0, 0, 2}), 0.5,
                     perpendicularRectangles(1, 2, 1));
}

TEST(FormFactor, OffsetParallelRectangles) {
    expectFormFactor(rectangle("low", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                     rectangle("high", {0.5f, -0.25f, 0.7f}, {0, 0.8f, 0}, {1.3f, 0, 0}), 1 / 1.04,
                     offsetRectangles({0, 1}, {0, 1}, {0.5, 1.8}, {-0.25, 0.55}, 0.7));
}

TEST(FormFactor, CoaxialDisks) {
    std::vector<glm::vec3> low, high;
    std::vector<int32_t> up, down;
    constexpr int kSides = 48;
    for (int k = 0; k < kSides; ++k) {
        const double angle = 2 * kPi * k / kSides;
        low.emplace_back(std::cos(angle), std::sin(angle), 0);
        high.emplace_back(std::cos(angle), std::sin(angle), 1);
        up.push_back(k);
        down.insert(down.begin(), k);
    }
    // A regular 48-gon has 0.3 % less area than its circle, and its form factor is smaller by about
    // as much.
    expectFormFactor(polygons("low", low, {up}), polygons("high", high, {down}), 1,
                     coaxialDisks(1, 1, 1), 0.004);
}

TEST(FormFactor, RowsOfAClosedSceneSumToOne) {
    const Patches patches = subdivide(closedCube(0.5f), 10, kMany);
    const LineCounts counts = traceLines(patches, 0.05f, kManyBundles);
    for (uint32_t i = 0; i < counts.sideCount(); i += 2) {
        double sum = 0;
        for (const LineCount& c : counts.row(i)) {
            const double f = (c.lines[0] + c.lines[1]) / linesOf(counts, i);
            const bool opposite = patches.normal(i) == -patches.normal(c.side);
            const double exact =
                opposite ? parallelRectangles(1, 1, 1) : perpendicularRectangles(1, 1, 1);
            EXPECT_NEAR(f, exact, bound(exact));
            sum += f;
        }
        EXPECT_NEAR(sum, 1, 1e-12);
    }
}

const glm::dvec3 kUp(0, 0, 1);
constexpr double kLambert = 1e-6;  // relative to angles in single precision

double irradianceFrom(const std::vector<glm::dvec3>& polygon, const glm::dvec3& normal = kUp,
                      const glm::dvec3& point = glm::dvec3(0)) {
    return polygonIrradiance(point, normal, polygon.data(), int(polygon.size()));
}

TEST(PolygonIrradiance, ASquareOverItsCorner) {
    EXPECT_NEAR(irradianceFrom({{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}),
                kPi * 0.138531605994893, kLambert);
    EXPECT_NEAR(irradianceFrom({{0, 1, 1}, {1, 1, 1}, {1, 0, 1}, {0, 0, 1}}),
                kPi * 0.138531605994893, kLambert)
        << "the winding does not matter";
}

TEST(PolygonIrradiance, AnEndlessPlaneGivesPi) {
    EXPECT_NEAR(irradianceFrom({{-1e6, -1e6, 1}, {1e6, -1e6, 1}, {1e6, 1e6, 1}, {-1e6, 1e6, 1}}),
                kPi, 1e-6);
}

TEST(PolygonIrradiance, AFarPolygonGivesItsSolidAngleTimesTheCosine) {
    const glm::dvec3 towards = glm::normalize(glm::dvec3(0.3, -0.5, 0.8));
    const double distance = 1000, size = 0.5;
    const glm::dvec3 u = size * glm::normalize(glm::cross(towards, glm::dvec3(1, 0, 0)));
    const glm::dvec3 v = glm::cross(towards, u), p = distance * towards;
    const double exact = size * size * towards.z / (distance * distance);
    // The solid angle of 2.5e-7 sr is the sum of angles a thousand times as large, which nearly
    // cancel.
    EXPECT_NEAR(irradianceFrom({p, p + u, p + u + v, p + v}), exact, 2 * size / distance * exact);
}

TEST(PolygonIrradiance, APolygonIsCutAtTheHorizon) {
    const glm::dvec3 wall(1, 0, 0);
    const double half = irradianceFrom({{0, -1, 1}, {1, -1, 1}, {1, 1, 1}, {0, 1, 1}}, wall);
    EXPECT_GT(half, 0.1);
    EXPECT_NEAR(irradianceFrom({{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}, wall), half,
                kLambert);
    EXPECT_EQ(irradianceFrom({{-3, -1, 1}, {-1, -1, 1}, {-1, 1, 1}, {-3, 1, 1}}, wall), 0);
    // A triangle with one corner above the horizon, and one with two corners above.
    EXPECT_NEAR(irradianceFrom({{-1, 0, 1}, {1, 0, 1}, {-1, 1, 1}}, wall),
                irradianceFrom({{0, 0, 1}, {1, 0, 1}, {0, 0.5, 1}}, wall), kLambert);
    EXPECT_NEAR(irradianceFrom({{1, 0, 1}, {-1, 0, 1}, {1, 1, 1}}, wall),
                irradianceFrom({{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 0.5, 1}}, wall), kLambert);
}

TEST(PolygonIrradiance, TheWallsOfACubeFillTheHemisphere) {
    const Mesh cube = box("cube", {-1, -1, -1}, {1, 1, 1}, true);
    for (glm::dvec3 normal : {kUp, glm::normalize(glm::dvec3(0.2, 0.5, -0.9))})
        for (glm::dvec3 point : {glm::dvec3(0), glm::dvec3(0.3, -0.8, 0.5)}) {
            double sum = 0;
            for (size_t f = 0; f < cube.faceCount(); ++f) {
                std::vector<glm::dvec3> face;
                for (size_t k = 0; k < 4; ++k)
                    face.push_back(cube.vertices[size_t(cube.cornerVertices[4 * f + k])]);
                sum += irradianceFrom(face, normal, point);
            }
            EXPECT_NEAR(sum, kPi, kLambert);
        }
}

TEST(PolygonIrradiance, NoPolygonGivesALightThatIsNotANumber) {
    // A receiver on a corner, on an edge and in the plane, and a polygon without area.
    const std::vector<glm::dvec3> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    for (glm::dvec3 point :
         {glm::dvec3(0, 0, 0), glm::dvec3(0.5, 0, 0), glm::dvec3(0.5, 0.5, 0), glm::dvec3(2, 2, 0)})
        for (glm::dvec3 normal : {kUp, glm::dvec3(1, 0, 0)})
            EXPECT_TRUE(std::isfinite(irradianceFrom(square, normal, point)));
    EXPECT_NEAR(irradianceFrom({{1, 0, 1}, {1, 0, 1}, {1, 0, 1}}), 0, kLambert);
}

}  // namespace
}  // namespace raybundle
