// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/line_counts.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "bundles/directions.h"
#include "bundles/fragment_lists.h"
#include "reconstruction/least_squares.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

bool sameCounts(const LineCounts& a, const LineCounts& b) {
    if (a.sideCount() != b.sideCount() || a.bundles != b.bundles || a.sky != b.sky ||
        a.total != b.total || a.touching != b.touching)
        return false;
    for (uint32_t i = 0; i < a.sideCount(); ++i)
        if (a.row(i) != b.row(i)) return false;
    return true;
}

// Checks E[m_i] = n A_i / (2 s^2). The standard deviation of m_i is at most that of as many
// independent lines (Poisson). The tolerance of four standard deviations also holds for the worst
// of a thousand patches.
void expectCrofton(const Patches& patches, const LineCounts& counts, uint32_t count,
                   float pixelSize) {
    double squares = 0;
    for (uint32_t p = 0; p < patches.count(); ++p) {
        const double wanted = count * double(patches.area[p]) / (2 * double(pixelSize) * pixelSize);
        ASSERT_EQ(counts.total[2 * p], counts.total[2 * p + 1]) << "a line has two ends";
        const double deviation = (linesOf(counts, 2 * p) - wanted) / std::sqrt(wanted);
        EXPECT_LT(std::abs(deviation), 4) << "patch " << p << ", expected lines " << wanted;
        squares += deviation * deviation;
    }
    EXPECT_LT(std::sqrt(squares / double(patches.count())), 1.2);
}

TEST(LineCounts, LinesOfAPatchFollowItsAreaAtAnySize) {
    Scene scene;
    place(scene, icosphere("ball", 1, 3, true), grey("", 0.5f));
    const Patches patches = subdivide(scene, 10, kMany);
    for (double perPatch : {4.66, 0.26, 0.05}) {  // mean patch area over pixel area
        const float pixelSize =
            float(std::sqrt(patches.totalArea / double(patches.count()) / perPatch));
        constexpr uint32_t kCount = 2048;
        expectCrofton(patches, traceLines(patches, pixelSize, kCount), kCount, pixelSize);
    }
}

TEST(LineCounts, LinesOfSliversFollowTheirArea) {
    Scene scene;
    place(scene, rectangle("strip", {0, 0, 0}, {1, 0, 0}, {0, 0.001f, 0}), grey("", 0.5f));
    place(scene, polygons("needle", {{0, 0, 1}, {1, 0, 1}, {0.5f, 0.002f, 1}}, {{0, 1, 2}}),
          grey("", 0.5f));
    const Patches patches = subdivide(scene, 10, kMany);
    constexpr uint32_t kCount = 4096;
    expectCrofton(patches, traceLines(patches, 0.05f, kCount), kCount, 0.05f);
}

TEST(LineCounts, CountsAreSymmetricAndAddUp) {
    const Patches patches = subdivide(roomWithBoxes(0.5f), 0.3f, kMany);
    const LineCounts counts = traceLines(patches, 0.1f, 64);
    size_t pairs = 0;
    for (uint32_t i = 0; i < counts.sideCount(); ++i) {
        std::array<uint32_t, 2> sum = counts.sky[i];
        for (const LineCount& c : counts.row(i)) {
            ++pairs;
            for (size_t h = 0; h < 2; ++h) sum[h] += c.lines[h];
            ASSERT_EQ(linesBetween(counts, c.side, i), c.lines[0] + c.lines[1]);
        }
        ASSERT_EQ(sum, counts.total[i]);
    }
    EXPECT_LE(pairs, 2 * counts.exchangeCount());
}

TEST(LineCounts, CoplanarPatchesNeverMeet) {
    const Patches patches = subdivide(closedCube(0.5f), 0.2f, kMany);
    const LineCounts counts = traceLines(patches, 0.05f, 64);
    for (uint32_t i = 0; i < counts.sideCount(); ++i)
        for (const LineCount& c : counts.row(i))
            ASSERT_NE(patches.parentOf[i / 2], patches.parentOf[c.side / 2]);
}

TEST(LineCounts, ManyAdditionsGiveTheSameAsOne) {
    const Patches patches = subdivide(roomWithBoxes(0.5f), 0.3f, kMany);
    FragmentLists projector(patches, 0.1f);
    LineCounts once(patches.sideCount()), often(patches.sideCount());
    std::vector<TracedBundle> all;
    for (const Bundle& bundle : Directions(DirectionKind::LOW_DISCREPANCY, 1).next(32)) {
        TracedBundle traced{bundle, {}};
        projector.project(bundle, traced.lines);
        often.add({traced});
        all.push_back(std::move(traced));
    }
    once.add(all);
    EXPECT_TRUE(sameCounts(once, often));
}

TEST(LineCounts, TheNumberOfThreadsDoesNotMatter) {
    const Patches patches = subdivide(roomWithBoxes(0.5f), 0.2f, kMany);
    auto traceWith = [&](int threads) {
        tbb::task_arena arena(threads);
        return arena.execute([&] { return traceLines(patches, 0.1f, 64); });
    };
    EXPECT_TRUE(sameCounts(traceWith(1), traceWith(2)));
}

TEST(Touching, TheFloorUnderABoxIsCoveredAndNothingElseIs) {
    // Exactly on the floor, or off it by a rounding error.
    for (double height : {0.0, 1e-7, -1e-7, 1e-6, -1e-6}) {
        SCOPED_TRACE("height " + std::to_string(1e9 * height) + " nm");
        Scene scene;
        place(scene, rectangle("floor", {0, 0, 0}, {4, 0, 0}, {0, 4, 0}), grey("", 0.5f));
        place(scene, box("box", {1, 1, 0}, {2, 3, 1}, false), grey("", 0.5f),
              glm::translate(glm::dmat4(1), glm::dvec3(0, 0, height)));
        const Patches patches = subdivide(scene, 0.5f, kMany);
        const LineCounts counts = traceLines(patches, 0.05f, 64);
        const std::vector<float> exposed = counts.exposedShare();
        size_t covered = 0;
        float worst = 0, worstBack = 0;
        for (uint32_t p = 0; p < patches.count(); ++p) {
            const glm::dvec3 at = patches.centre + glm::dvec3(patches.point(p, {0.5f, 0.5f}));
            const Parent& parent = patches.parents[patches.parentOf[p]];
            const bool under = parent.instance == 0 ? at.x > 1 && at.x < 2 && at.y > 1 && at.y < 3
                                                    : patches.normal(2 * p).z < -0.9f;
            worst = std::max(worst, under ? exposed[2 * p] : 1 - exposed[2 * p]);
            worstBack = std::max(worstBack, 1 - exposed[2 * p + 1]);
            covered += under;
        }
        // Lines exactly through a common border may meet either side: 1 %.
        EXPECT_LT(worst, 0.01f);
        EXPECT_LT(worstBack, 0.01f);
        EXPECT_EQ(covered, 16u);
        // A covered side exchanges lines only with the surface that covers it, so no light leaks
        // in.
        double leak = 0;
        for (uint32_t i = 0; i < counts.sideCount(); i += 2) {
            if (exposed[i] > 0.5f) continue;
            double leaked = counts.sky[i][0] + counts.sky[i][1];
            for (const LineCount& c : counts.row(i))
                if (exposed[c.side] > 0.5f) leaked += c.lines[0] + c.lines[1];
            leak = std::max(leak, leaked / linesOf(counts, i));
        }
        EXPECT_LT(leak, 0.01);
    }
}

}  // namespace
}  // namespace raybundle
