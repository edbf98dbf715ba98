// SPDX-License-Identifier: GPL-3.0-or-later
//
// The depth orders of the painter against the exact order.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <random>

#include "bundles/directions.h"
#include "bundles/projector.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// The lines of a bundle, independent of the order in which a projector found them.
struct Merged {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> exchanges;
    std::vector<uint32_t> sky, touching;
    uint64_t lines;

    explicit Merged(BundleLines found)
        : sky(std::move(found.sky)), touching(std::move(found.touching)), lines(found.lines) {
        for (const Exchange& e : found.exchanges) exchanges[{e.i, e.j}] += e.lines;
        std::sort(sky.begin(), sky.end());
        std::sort(touching.begin(), touching.end());
    }
    bool operator==(const Merged& other) const {
        return exchanges == other.exchanges && sky == other.sky && touching == other.touching &&
               lines == other.lines;
    }
};

class PaintedScene {
  public:
    PaintedScene(const Scene& scene, float patchSize, float pixelSize)
        : patches(subdivide(scene, patchSize, kMany)),
          visibility(patches),
          input{patches, visibility, pixelSize} {}

    BundleLines along(ProjectorKind projector, const Bundle& bundle) const {
        BundleLines lines;
        makeProjector(projector, input)->project(bundle, lines);
        return lines;
    }

    const Patches patches;
    const Visibility visibility;
    const ProjectorInput input;
};

// Boxes and balls of triangles, rotated at random, at a distance from each other.
Scene separatedSolids() {
    Scene scene;
    std::mt19937_64 random(3);
    for (int k = 0; k < 18; ++k) {
        glm::dmat4 m = glm::translate(glm::dmat4(1), 1.5 * glm::dvec3(k % 3, k / 3 % 3, k / 9));
        m *= glm::dmat4(randomRotation(random));
        m = glm::scale(m, glm::dvec3(0.3) +
                              0.35 * glm::dvec3(uniform(random), uniform(random), uniform(random)));
        place(scene,
              k % 2 ? icosphere("ball", 1, 1, false)
                    : box("box", glm::vec3(-0.577f), glm::vec3(0.577f), false),
              grey("", 0.5f), m);
    }
    return scene;
}

TEST(PainterNewell, HasTheExchangesOfFragmentLists) {
    const struct {
        const char* name;
        Scene scene;
        float patchSize;
    } cases[] = {{"floating boxes", roomWithBoxes(0.5f), 0.1f},
                 {"floating boxes, coarse", roomWithBoxes(0.5f), 0.6f},
                 {"floating boxes, one patch a face", roomWithBoxes(0.5f), 100.0f},
                 {"standing boxes, which touch the floor", roomWithBoxes(0.5f, 0, 0), 0.15f},
                 {"solids", separatedSolids(), 0.1f},
                 {"solids, coarse", separatedSolids(), 100.0f}};
    for (const auto& c : cases) {
        const PaintedScene projection(c.scene, c.patchSize, 0.03f);
        for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 11).next(12)) {
            const BundleLines exact = projection.along(ProjectorKind::FRAGMENT_LISTS, bundle);
            const BundleLines found = projection.along(ProjectorKind::PAINTER_NEWELL, bundle);
            EXPECT_TRUE(Merged(found) == Merged(exact)) << c.name;
            EXPECT_GT(exact.lines, 1000u);
            EXPECT_EQ(found.disordered, 0u) << c.name;
            EXPECT_EQ(found.cycles, 0u) << c.name;
        }
    }
}

TEST(PainterNewell, NoLineLeavesAClosedScene) {
    Scene cube = closedCube(0.5f), ball;
    place(ball, icosphere("ball", 1, 3, true), grey("", 0.5f));
    for (const Scene* scene : {&cube, &ball}) {
        const PaintedScene projection(*scene, 0.1f, 0.01f);
        uint64_t all = 0, open = 0;
        for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 9).next(10)) {
            const BundleLines lines = projection.along(ProjectorKind::PAINTER_NEWELL, bundle);
            ASSERT_EQ(lines.sky.size(), 2 * lines.lines);
            EXPECT_EQ(exchangedLines(lines), lines.lines) << "two crossings";
            all += lines.lines;
            for (uint32_t side : lines.sky) open += side % 2 == 0;
        }
        EXPECT_GT(all, 50000u);
        EXPECT_EQ(open, 0u) << "an inner side sees the sky";
    }
}

TEST(Painter, IsRightButForAFewLinesWherePatchesAreSmall) {
    uint64_t disordered = 0, all = 0;
    for (const Scene& scene : {roomWithBoxes(0.5f), separatedSolids()}) {
        const PaintedScene projection(scene, 0.1f, 0.03f);
        for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 11).next(10)) {
            const BundleLines exact = projection.along(ProjectorKind::FRAGMENT_LISTS, bundle);
            const BundleLines found = projection.along(ProjectorKind::PAINTER, bundle);
            EXPECT_EQ(Merged(found) == Merged(exact), found.disordered == 0)
                << "the count tells whether the order is right";
            EXPECT_EQ(found.lines, exact.lines) << "coverage is the same";
            EXPECT_EQ(found.cycles, 0u);
            disordered += found.disordered;
            all += exchangedLines(found);
        }
    }
    // Surfaces are a patch or more apart here. The thesis calls the error negligible too.
    EXPECT_LT(double(disordered), 1e-3 * double(all));
}

TEST(Painter, IsWrongWhereALongPatchReachesBehindASmallOne) {
    // The lines meet the slope first, at a height of 1 to 1.5, but its centroid is at a height of
    // 5.
    Scene scene;
    place(scene, rectangle("slope", {0, 0, 0}, {10, 0, 10}, {0, 1, 0}), grey("", 0.5f));
    place(scene, rectangle("small", {1, 0.25f, 3}, {0.5f, 0, 0}, {0, 0.5f, 0}), grey("", 0.5f));
    const PaintedScene projection(scene, 100, 0.05f);
    const Bundle upwards{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.3, 0.7}, 0, 0};
    const BundleLines centroid = projection.along(ProjectorKind::PAINTER, upwards);
    const BundleLines newell = projection.along(ProjectorKind::PAINTER_NEWELL, upwards);
    constexpr uint32_t kSlope = 0, kSmall = 2;  // their fronts, which face up
    EXPECT_EQ(centroid.disordered, 100u) << "all lines through the small patch";
    EXPECT_EQ(Merged(centroid).exchanges.count({kSlope + 1, kSmall}), 1u);
    EXPECT_EQ(newell.disordered, 0u);
    EXPECT_EQ(newell.cycles, 0u);
    EXPECT_EQ(Merged(newell).exchanges.at({kSlope, kSmall + 1}), 100u);
}

// Each of the three bars lies over the next at one end and under the previous one at the other.
Scene interlockedBars() {
    Scene scene;
    for (int k = 0; k < 3; ++k) {
        glm::dmat4 m = glm::rotate(glm::dmat4(1), 2 * kPi / 3 * k, glm::dvec3(0, 0, 1));
        m = glm::rotate(glm::translate(m, glm::dvec3(0, 1, 0)), 0.2, glm::dvec3(0, 1, 0));
        place(scene, box("bar", {-2.3f, -0.2f, -0.05f}, {2.3f, 0.2f, 0.05f}, false), grey("", 0.5f),
              m);
    }
    return scene;
}

TEST(PainterNewell, CountsTheCyclesOfInterlockedClosedObjects) {
    const PaintedScene whole(interlockedBars(), 100, 0.02f), cut(interlockedBars(), 0.3f, 0.02f);
    // A direction near the axis of the three bars. Along this axis they form a ring.
    const glm::dvec3 direction = glm::normalize(glm::dvec3(0.05, 0.03, 1));
    const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), direction));
    const Bundle bundle{right, glm::cross(direction, right), direction, {0.4, 0.6}, 0, 0};

    const BundleLines broken = whole.along(ProjectorKind::PAINTER_NEWELL, bundle);
    EXPECT_GT(broken.cycles, 0u);
    EXPECT_GT(broken.disordered, 0u) << "one of the three overlaps must come out wrong";
    EXPECT_FALSE(Merged(broken) == Merged(whole.along(ProjectorKind::FRAGMENT_LISTS, bundle)));

    const BundleLines parted = cut.along(ProjectorKind::PAINTER_NEWELL, bundle);
    EXPECT_EQ(parted.cycles, 0u) << "no patch reaches from one overlap to the next";
    EXPECT_EQ(parted.disordered, 0u);
    EXPECT_TRUE(Merged(parted) == Merged(cut.along(ProjectorKind::FRAGMENT_LISTS, bundle)));
}

TEST(PainterNewell, ABakeReportsBrokenCycles) {
    Scene scene = interlockedBars();
    scene.worldRadiance = {1, 1, 1};
    for (ProjectorKind projector : {ProjectorKind::PAINTER_NEWELL, ProjectorKind::AUTO}) {
        Bake bake;
        bake.settings.projector = projector;
        bake.settings.patchSize = 100;
        bake.settings.maxBundles = 64;
        bake.run(scene);
        EXPECT_EQ(warns(reportOf(bake), WarningId::BROKEN_CYCLES),
                  projector == ProjectorKind::PAINTER_NEWELL);
    }
}

TEST(PainterNewell, CountsIntersectingPatchesAsACycle) {
    Scene scene;
    place(scene, rectangle("one", {-1, -1, -1}, {2, 0, 2}, {0, 2, 0}), grey("", 0.5f));
    place(scene, rectangle("other", {-1, -1, 1}, {2, 0, -2}, {0, 2, 0}), grey("", 0.5f));
    const PaintedScene projection(scene, 100, 0.05f);
    const Bundle upwards{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.3, 0.7}, 0, 0};
    const BundleLines lines = projection.along(ProjectorKind::PAINTER_NEWELL, upwards);
    EXPECT_EQ(lines.cycles, 1u);
    EXPECT_NEAR(double(lines.disordered), 0.5 * double(lines.lines), 41) << "one side of the cut";
}

TEST(PainterNewell, OrdersPatchesThatCutEachOthersPlanesApart) {
    // Neither patch lies on one side of the other's plane, but they do not intersect: the lower one
    // turns up at its end, beside the upper one, which turns down.
    Scene scene;
    place(scene, rectangle("low", {-2, -0.5f, -1}, {4, 0, 1.6f}, {0, 1, 0}), grey("", 0.5f));
    place(scene, rectangle("high", {-0.4f, -3, 1.4f}, {0.8f, 0, 0}, {0, 6, -2.2f}), grey("", 0.5f));
    const PaintedScene projection(scene, 100, 0.05f);
    const Bundle upwards{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.3, 0.7}, 0, 0};
    const BundleLines lines = projection.along(ProjectorKind::PAINTER_NEWELL, upwards);
    EXPECT_EQ(lines.cycles, 0u);
    EXPECT_EQ(lines.disordered, 0u);
    EXPECT_TRUE(Merged(lines) == Merged(projection.along(ProjectorKind::FRAGMENT_LISTS, upwards)));
    EXPECT_EQ(exchangedLines(lines), 16u * 20u) << "0.8 m by 1 m of overlap";
}

struct FurnaceError {
    double worst;   // largest error of all corners
    double mean;    // root mean square over the area
    double stated;  // error stated by the bake
};

FurnaceError furnace(const Scene& scene, ProjectorKind projector, bool boxesStand) {
    Bake bake;
    setQuick(bake);
    bake.settings.projector = projector;
    bake.run(scene);
    double worst = 0, squares = 0, area = 0;
    for (const Cell& cell : bake.patches().cells) {
        // No light reaches the bottom of a standing box.
        if (boxesStand && cell.instance > 0 && cell.face == 0) continue;
        const std::vector<glm::vec3> light =
            cornerLight(bake, int32_t(cell.instance), RB_OUTPUT_LIGHTING);
        // All cells are quads.
        const double cellArea = double(glm::length(glm::cross(cell.a, cell.b)));
        area += cellArea;
        for (int32_t corner : cell.corner) {
            const double error = std::abs(double(light[size_t(corner)].x) * kPi - 1);
            worst = std::max(worst, error);
            squares += 0.25 * cellArea * error * error;
        }
    }
    return {worst, std::sqrt(squares / area), reportOf(bake)["estimated_error"].get<double>()};
}

TEST(PainterFurnace, IsExactInTheOrderOfNewell) {
    EXPECT_LT(furnace(closedCube(0.7f, 0.3f), ProjectorKind::PAINTER_NEWELL, false).worst, 1e-4);
    for (float gap : {0.1f, 0.0f})
        EXPECT_LT(
            furnace(roomWithBoxes(0.5f, 0.5f, gap), ProjectorKind::PAINTER_NEWELL, gap == 0).worst,
            1e-4)
            << gap;
}

TEST(PainterFurnace, IsExactInTheOrderOfCentroidsWherePatchesAreFarApart) {
    EXPECT_LT(furnace(closedCube(0.7f, 0.3f), ProjectorKind::PAINTER, false).worst, 1e-4);
    EXPECT_LT(furnace(roomWithBoxes(0.5f, 0.5f, 0.6f), ProjectorKind::PAINTER, false).worst, 1e-4);
}

TEST(PainterFurnace, StatesTheErrorOfTheOrderOfCentroidsWherePatchesAreClose) {
    // With patches of 0.25 m some lines let the dark inside of a box see the room if the box is 0.1
    // m above the floor, and half of the lines do if it stands on the floor.
    for (float gap : {0.1f, 0.0f}) {
        const FurnaceError error =
            furnace(roomWithBoxes(0.5f, 0.5f, gap), ProjectorKind::PAINTER, gap == 0);
        EXPECT_GT(error.mean, 1e-4) << gap;
        EXPECT_LT(error.mean, error.stated) << gap;
        EXPECT_LT(error.stated, 0.03) << gap;
    }
}

TEST(PainterSameness, TheNumberOfThreadsDoesNotMatter) {
    for (ProjectorKind projector : {ProjectorKind::PAINTER, ProjectorKind::PAINTER_NEWELL}) {
        SCOPED_TRACE(choiceName(projector));
        expectSameForThreads([&](Bake& bake) {
            setQuick(bake, 32);
            bake.settings.projector = projector;
        });
    }
}

}  // namespace
}  // namespace raybundle
