// SPDX-License-Identifier: GPL-3.0-or-later
//
// ROULETTE: where it is right, and by how much it is wrong elsewhere.
#include "bundles/roulette.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <set>

#include "bundles/projector.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// Returns the number of fragments of a bundle. Each fragment is once the far end of a line and once
// the near end.
double fragmentCount(const BundleLines& lines) {
    return 0.5 * double(2 * exchangedLines(lines) + lines.sky.size() + lines.touching.size());
}

class RouletteScene {
  public:
    RouletteScene(const Scene& scene, float patchSize, float pixelSize)
        : patches(subdivide(scene, patchSize, kMany)), visibility(patches), pixelSize(pixelSize) {}

    std::unique_ptr<Projector> projector(
        SmallPatches kind, ProjectorKind projector = ProjectorKind::FRAGMENT_LISTS) const {
        return makeProjector(projector, {patches, visibility, pixelSize, kind});
    }
    // Returns the expected number of fragments in n bundles, by Crofton's formula.
    double expectedFragments(uint32_t n) const {
        return n * patches.totalArea / (2 * double(pixelSize) * double(pixelSize));
    }
    double fragments(SmallPatches kind, uint32_t n) const {
        const auto lists = projector(kind);
        double sum = 0;
        for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 21).next(n)) {
            BundleLines lines;
            lists->project(bundle, lines);
            sum += fragmentCount(lines);
        }
        return sum;
    }

    const Patches patches;
    const Visibility visibility;
    const float pixelSize;
};

// Rectangles a x b, rotated at random, a metre apart.
Scene scattered(int count, float a, float b) {
    Scene scene;
    std::mt19937_64 random(5);
    for (int k = 0; k < count; ++k) {
        const glm::dmat4 m = glm::translate(glm::dmat4(1), glm::dvec3(k % 6, k / 6 % 6, k / 36)) *
                             glm::dmat4(randomRotation(random));
        place(scene, rectangle("leaf", {0, 0, 0}, {a, 0, 0}, {0, b, 0}), grey("", 0.5f), m);
    }
    return scene;
}

TEST(PolygonFiller, MakesPolygonsAtLeastAPixelWideAndHigh) {
    PolygonFiller filler;
    std::mt19937_64 random(7);
    for (int k = 0; k < 500; ++k) {
        const glm::dvec2 at(5 + uniform(random), 5 + uniform(random));
        auto fill = [&](glm::dvec2 a, glm::dvec2 b) {
            const glm::dvec2 corners[4] = {at, at + a, at + a + b, at + b};
            const std::vector<Pixel>& pixels = filler.fill(corners, 4);
            std::set<std::pair<int, int>> unique;
            for (const Pixel& p : pixels) unique.emplace(p.x, p.y);
            EXPECT_EQ(unique.size(), pixels.size());
            return pixels.size();
        };
        EXPECT_EQ(fill({0.01, 0}, {0, 0.02}), 1u) << "dust";
        EXPECT_EQ(fill({6, 0}, {0, 0.1}), 6u) << "a lying sliver";
        EXPECT_EQ(fill({0, 6}, {0.1, 0}), 6u) << "a standing sliver";
        EXPECT_EQ(fill({20, 0}, {0, 20}), 400u) << "a square has its area";
        // Each row and each column within the extent of the polygon has a pixel.
        EXPECT_GE(fill({8, 3}, {0.03, 0.01}), 8u);
        EXPECT_GE(fill({3, -8}, {0.03, 0.01}), 8u);
        // A large polygon has its area, except at its border.
        EXPECT_NEAR(double(fill({40, 9}, {-9, 40})), 41.0 * 41.0, 40);
    }
}

TEST(Roulette, LinesOfSmallPatchesAreUnbiased) {
    // Squares of a fifth of a pixel's edge, and slivers of six pixel edges by a twentieth. Their
    // area is less than that of a pixel.
    const float pixel = 0.05f;
    const struct {
        const char* name;
        Scene scene;
        uint32_t bundles;
    } cases[] = {{"dust", scattered(216, 0.2f * pixel, 0.2f * pixel), 1000},
                 {"slivers", scattered(216, 6 * pixel, 0.05f * pixel), 200}};
    for (const auto& c : cases) {
        const RouletteScene projection(c.scene, 10, pixel);
        const double expected = projection.expectedFragments(c.bundles);
        EXPECT_GT(expected, 4000);
        // A patch is drawn or not, so the variance is at most the mean. The variance of the
        // directions is at most a twentieth of it. The tolerance is four standard errors.
        const double tolerance = 4 * std::sqrt(1.05 * expected);
        for (SmallPatches kind : {SmallPatches::ROULETTE, SmallPatches::CENTRE_SAMPLING}) {
            EXPECT_NEAR(projection.fragments(kind, c.bundles), expected, tolerance)
                << c.name << (kind == SmallPatches::ROULETTE ? ", roulette" : ", centres");
        }
    }
}

TEST(Roulette, ThinPatchesOfMoreThanAPixelGetTooManyLines) {
    const float pixel = 0.04f;
    const RouletteScene projection(scattered(108, 16 * pixel, 0.4f * pixel), 10, pixel);
    const double expected = projection.expectedFragments(100);
    EXPECT_NEAR(projection.fragments(SmallPatches::CENTRE_SAMPLING, 100), expected,
                0.03 * expected);
    EXPECT_GT(projection.fragments(SmallPatches::ROULETTE, 100), 1.5 * expected)
        << "the filler makes them a pixel wide";
}

TEST(Roulette, ClosedSurfacesOfSmallPatchesLeak) {
    // Patches of at most a sixteenth of a pixel. A pixel holds the centroids of 1 / p patches, each
    // drawn with the probability p. The probability that none is drawn is (1 - p)^(1/p), which is
    // 0.356 to 1/e.
    const RouletteScene projection(closedCube(0.5f), 0.01f, 0.04f);
    const auto exact = projection.projector(SmallPatches::CENTRE_SAMPLING);
    const auto roulette = projection.projector(SmallPatches::ROULETTE);
    double crossed = 0, met = 0, inside = 0, all = 0;
    for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 2).next(20)) {
        BundleLines closed, leaking;
        exact->project(bundle, closed);
        roulette->project(bundle, leaking);
        for (uint32_t side : closed.sky) EXPECT_EQ(side % 2, 1u) << "centre sampling is watertight";
        EXPECT_EQ(closed.disordered, 0u) << "which is counted with ROULETTE only";
        crossed += double(closed.lines);
        met += double(leaking.lines);
        for (uint32_t side : leaking.sky) inside += side % 2 == 0;
        all += double(leaking.sky.size());
        EXPECT_LE(leaking.disordered, exchangedLines(leaking));
        EXPECT_GT(leaking.disordered, 0u);
    }
    // A line meets the cube if at least one of its two walls is drawn: 1 - 0.36^2. Pixels at the
    // silhouette, and the draws, scatter by a per cent.
    EXPECT_NEAR(met / crossed, 0.87, 0.02);
    // If only one wall is drawn, its inner side sees the sky: 2 * 0.36 * 0.64 of 0.87 lines. The
    // order of several patches of a wall that are drawn on one pixel does not matter here.
    EXPECT_NEAR(inside / all, 0.5 * 2 * 0.36 * 0.64 / 0.87, 0.03);
}

TEST(Roulette, AllProjectorsHaveTheSameFragments) {
    const RouletteScene projection(roomWithBoxes(0.5f), 0.1f, 0.06f);
    for (const Bundle& bundle : Directions(DirectionKind::RANDOM, 6).next(4)) {
        std::vector<double> counts;
        std::vector<uint64_t> lines;
        for (ProjectorKind projector : {ProjectorKind::FRAGMENT_LISTS, ProjectorKind::PAINTER,
                                        ProjectorKind::PAINTER_NEWELL}) {
            BundleLines found, again;
            projection.projector(SmallPatches::ROULETTE, projector)->project(bundle, found);
            projection.projector(SmallPatches::ROULETTE, projector)->project(bundle, again);
            counts.push_back(fragmentCount(found));
            lines.push_back(found.lines);
            EXPECT_EQ(found.sky, again.sky)
                << choiceName(projector) << ": chance is that of the bundle";
            EXPECT_EQ(found.sky.size(), 2 * found.lines) << choiceName(projector);
            EXPECT_GT(found.disordered, 0u) << choiceName(projector);
        }
        for (double count : counts) EXPECT_EQ(count, counts[0]);
        for (uint64_t count : lines) EXPECT_EQ(count, lines[0]);
    }
}

TEST(Roulette, BakesAndIsTheSameForAnyNumberOfThreads) {
    std::vector<glm::vec3> light[2];
    for (int threads : {1, 2}) {
        Bake bake;
        setQuick(bake, 32);
        bake.settings.smallPatches = SmallPatches::ROULETTE;
        bake.settings.threads = threads;
        bake.run(litRoom());
        light[threads - 1] = everything(bake);
        EXPECT_GT(reportOf(bake)["estimated_error"].get<double>(), 0.01)
            << "the leaks are part of the stated error";
    }
    EXPECT_LT(difference(light[0], light[1]), 1e-5);
}

}  // namespace
}  // namespace raybundle
