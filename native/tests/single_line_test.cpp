// SPDX-License-Identifier: GPL-3.0-or-later
//
// Single global lines: Crofton's formulas, and the same expected exchanges as the fragment lists.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "bundles/projector.h"
#include "test_bakes.h"
#include "test_scenes.h"
#include "visibility/visibility.h"

namespace raybundle {
namespace {

using namespace test;

struct LineScenery {
    explicit LineScenery(const Scene& scene, float patchSize = 0.3f)
        : patches(subdivide(scene, patchSize, kMany)), visibility(patches) {}

    std::unique_ptr<Projector> singleLines() const {
        ProjectorInput input{patches, visibility, 0};
        input.singleLine = true;
        return makeProjector(ProjectorKind::AUTO, input);
    }
    // Returns the area that one line per bundle represents: the cross-section of the bounding
    // sphere.
    double lineArea() const { return kPi * double(patches.radius) * double(patches.radius); }

    const Patches patches;
    const Visibility visibility;
};

TEST(LineHits, ALineThroughADiagonalCrossesItOnce) {
    // Both triangles of a quad, and a plate divided into many quads and triangles with common
    // vertices.
    Scene scene;
    place(scene, grid("plate", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 4, 4), grey("", 0));
    for (float patchSize : {10.0f, 0.1f}) {
        const Patches patches = subdivide(scene, patchSize, kMany);
        const Visibility visibility(patches);
        std::vector<LineHit> hits;
        for (int k = 0; k < 2000; ++k) {
            const double x = 1.9 * (k / 2000.0 - 0.5);
            const std::array<glm::dvec3, 4> points = {
                {{x, x, 0}, {x, -x, 0}, {0.5, x, 0}, {x, 0, 0}}};  // diagonals, edges
            for (const glm::dvec3& point : points)
                for (const glm::dvec3& direction :
                     {glm::dvec3(0, 0, 1), glm::dvec3(0, 0, -1),
                      glm::normalize(glm::dvec3(1, 1, 1)), glm::normalize(glm::dvec3(1, 0, 2))}) {
                    visibility.lineHits(point, direction, hits);
                    ASSERT_EQ(hits.size(), 1u) << point.x << " " << point.y;
                    EXPECT_NEAR(hits[0].depth, 0, 1e-6);
                    EXPECT_EQ(hits[0].side % 2, direction.z < 0 ? 0u : 1u);
                }
        }
    }
}

TEST(LineHits, AreInOrderOfDepthAndNameTheSideAgainstTheLine) {
    Scene scene;
    place(scene, rectangle("top", {0, 0, 2}, {1, 0, 0}, {0, 1, 0}), grey("", 0));
    place(scene, rectangle("bottom", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0));
    place(scene, rectangle("middle", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}), grey("", 0));
    const Patches patches = subdivide(scene, 10, kMany);
    std::vector<LineHit> hits;
    Visibility(patches).lineHits(glm::dvec3(0.5, 0.5, 0.25) - patches.centre, {0, 0, 1}, hits);
    ASSERT_EQ(hits.size(), 3u);
    const double depths[] = {-0.25, 0.75, 1.75};
    const uint32_t sides[] = {2 + 1, 4, 0 + 1};  // bottom and top face up, the middle one down
    for (size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(hits[k].depth, depths[k], 1e-6);
        EXPECT_EQ(hits[k].side, sides[k]);
    }
}

TEST(SingleLines, NoLineLeavesAClosedScene) {
    Scene ball;
    place(ball, icosphere("ball", 1, 3, true), grey("", 0.5f));
    for (const Scene& scene : {closedCube(0.5f), roomWithBoxes(0.5f), ball}) {
        const LineScenery scenery(scene);
        const auto projector = scenery.singleLines();
        uint64_t met = 0;
        for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 9).next(20000)) {
            BundleLines lines;
            projector->project(bundle, lines);
            ASSERT_EQ(lines.sky.size(), 2 * lines.lines);
            ASSERT_EQ((lines.exchanges.size() + lines.lines) % 2, 0u) << "parity";
            met += lines.lines;
            for (uint32_t side : lines.sky) ASSERT_EQ(side % 2, 1u);
            for (const Exchange& e : lines.exchanges) ASSERT_EQ(e.i % 2, e.j % 2);
        }
        EXPECT_GT(met, 5000u);
    }
}

TEST(SingleLines, CrossAreasAsCroftonSays) {
    const LineScenery scenery(roomWithBoxes(0.5f));
    const auto projector = scenery.singleLines();
    constexpr uint32_t kLines = 40000;
    std::array<double, 3> crossings{}, areas{};  // per instance, on fronts
    uint64_t met = 0;
    auto instanceOf = [&](uint32_t side) {
        return scenery.patches.parents[scenery.patches.parentOf[side / 2]].instance;
    };
    for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 1).next(kLines)) {
        BundleLines lines;
        projector->project(bundle, lines);
        met += lines.lines;
        for (const Exchange& e : lines.exchanges)
            for (uint32_t side : {e.i, e.j}) crossings[instanceOf(side)] += side % 2 == 0;
    }
    for (uint32_t patch = 0; patch < scenery.patches.count(); ++patch)
        areas[instanceOf(2 * patch)] += double(scenery.patches.area[patch]);
    for (size_t i = 0; i < 3; ++i) {
        // E = n A / (2 pi R^2), with two crossings of each convex body per line. The tolerance is
        // four standard errors of the number of bodies met.
        const double wanted = kLines * areas[i] / (2 * scenery.lineArea());
        EXPECT_NEAR(crossings[i], wanted, 4 * 2 * std::sqrt(wanted / 2)) << "instance " << i;
    }
    // All lines meet the sphere around the scene. A line meets the room in it with a probability
    // proportional to half the room's area.
    const double wanted = kLines * areas[0] / (4 * scenery.lineArea());
    EXPECT_NEAR(double(met), wanted, 4 * std::sqrt(wanted * (1 - wanted / kLines)));
}

TEST(SingleLines, ExchangeAsInTheLists) {
    // With standing boxes the rules for contacts are tested too.
    for (float gap : {0.1f, 0.0f}) {
        const LineScenery scenery(roomWithBoxes(0.5f, 0, gap));
        auto groupOf = [&](uint32_t i, uint32_t j) {
            auto instanceOf = [&](uint32_t side) {
                return scenery.patches.parents[scenery.patches.parentOf[side / 2]].instance;
            };
            return i % 2 || j % 2 ? -1 : int(instanceOf(i) + instanceOf(j));
        };
        // Per group, relative to the area of a line or a pixel, in both directions.
        std::array<double, 4> lines{}, wanted{};
        double touching = 0, wantedTouching = 0;
        constexpr uint32_t kFewer = kFewBakes ? 5 : 1, kLines = 40000 / kFewer,
                           kBundles = 1000 / kFewer;
        constexpr float kPixel = 0.08f;
        const auto single = scenery.singleLines();
        for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 2).next(kLines)) {
            BundleLines found;
            single->project(bundle, found);
            touching += double(found.touching.size());
            for (const Exchange& e : found.exchanges)
                if (const int g = groupOf(e.i, e.j); g >= 0) lines[size_t(g)] += e.lines;
        }
        const auto lists = fragmentLists({scenery.patches, scenery.visibility, kPixel});
        for (const Bundle& bundle : Directions(DirectionKind::LOW_DISCREPANCY, 2).next(kBundles)) {
            BundleLines found;
            lists->project(bundle, found);
            wantedTouching += double(found.touching.size());
            for (const Exchange& e : found.exchanges)
                if (const int g = groupOf(e.i, e.j); g >= 0) wanted[size_t(g)] += e.lines;
        }
        const double perLine =
            double(kLines) * kPixel * kPixel / (scenery.lineArea() * double(kBundles));
        // The tolerance is four standard errors of independent lines; that of the lists is at most
        // a tenth of it. A line exchanges at most twice within one group.
        for (size_t g : {0u, 1u, 2u, 3u})
            EXPECT_NEAR(lines[g], wanted[g] * perLine,
                        4 * std::sqrt(2 * wanted[g] * perLine) + 0.01 * wanted[g] * perLine)
                << "group " << g << ", gap " << gap;
        if (gap > 0)
            EXPECT_EQ(touching, 0);
        else
            EXPECT_NEAR(touching, wantedTouching * perLine,
                        4 * 2 * std::sqrt(wantedTouching * perLine));
    }
}

TEST(SingleLines, FurnacesAreExact) {
    const Scene scene = roomWithBoxes(0.5f, 0.5f);
    Bake bake;
    setQuick(bake, 4000);
    bake.settings.linesPerBundle = 1;
    bake.run(scene);
    double worst = 0;
    for (int32_t i = 0; i < 3; ++i)
        for (const glm::vec3& v : cornerLight(bake, i, RB_OUTPUT_LIGHTING))
            worst = std::max(worst, std::abs(double(v.x) * kPi - 1));
    EXPECT_LT(worst, 1e-4);
}

TEST(SingleLines, GiveTheSameLightAsBundles) {
    const Scene scene = litRoom();
    Bake bundles, lines;
    setQuick(bundles, 512);
    setQuick(lines, 100000);
    lines.settings.linesPerBundle = 1;
    for (Bake* bake : {&bundles, &lines}) {
        bake->settings.targetError = 1e-5f;
        bake->run(scene);
    }
    auto meanOf = [](const Bake& bake) {
        double sum = 0, n = 0;
        for (int32_t i = 0; i < 3; ++i)
            for (const glm::vec3& v : cornerLight(bake, i, RB_OUTPUT_INDIRECT)) {
                sum += double(v.x);
                n += 1;
            }
        return sum / n;
    };
    // 100 000 lines, half of which meet the room: some 50 crossings per side, which leaves some per
    // cent of noise on each side and less in the mean.
    EXPECT_NEAR(meanOf(lines) / meanOf(bundles), 1, 0.02);
}

TEST(SingleLines, AnEmptySceneIsNoError) {
    Bake bake;
    bake.settings.linesPerBundle = 1;
    bake.run(Scene());
    EXPECT_TRUE(warns(reportOf(bake), WarningId::NO_FACES));
}

}  // namespace
}  // namespace raybundle
