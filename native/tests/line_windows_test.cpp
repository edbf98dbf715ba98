// SPDX-License-Identifier: GPL-3.0-or-later
//
// Lines whose density follows the detail have the expected counts of uniform lines.
#include "bundles/line_windows.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bundles/bundle_tracer.h"
#include "bundles/line_counts.h"
#include "test_scenes.h"
#include "transport/line_reuse.h"
#include "visibility/visibility.h"

namespace raybundle {
namespace {

using namespace test;

constexpr float kPixel = 0.5f;

// A closed hall of 10 m with a small ball and a pair of small boxes.
Scene hallWithSmallThings(float reflectance, float emission = 0) {
    Scene scene;
    const Material material = grey("", reflectance, emission);
    place(scene, box("hall", {-5, -5, -5}, {5, 5, 5}, true), material);
    place(scene, icosphere("ball", 0.25f, 2, false), material);
    place(scene, box("left", {0.5f, -0.2f, -0.2f}, {0.8f, 0.2f, 0.2f}, false), material);
    place(scene, box("right", {0.9f, -0.2f, -0.2f}, {1.2f, 0.2f, 0.2f}, false), material);
    return scene;
}

// Windows that overlap and are nested, one around each of the small objects.
std::vector<LineWindow> smallWindows() {
    return {{{-0.4f, -0.4f, -0.4f}, {1.3f, 0.4f, 0.4f}, 2},
            {{-0.25f, -0.25f, -0.25f}, {0.25f, 0.25f, 0.25f}, 4},
            {{0.5f, -0.2f, -0.2f}, {1.2f, 0.2f, 0.2f}, 3},
            {{0.4f, -0.3f, -0.3f}, {0.85f, 0.3f, 0.3f}, 3}};
}
constexpr double kFinest = double(kPixel) / 16;  // edge of a pixel of the finest window

struct Traced {
    LineCounts counts;
    uint64_t lines;
};

Traced trace(const Patches& patches, float pixelSize, const std::vector<LineWindow>& windows,
             uint32_t count, uint32_t seed = 1) {
    const Visibility visibility(patches);
    ProjectorInput input{patches, visibility, pixelSize};
    input.windows = windows;
    BundleTracer tracer(ProjectorKind::FRAGMENT_LISTS, input, DirectionKind::LOW_DISCREPANCY, seed);
    LineCounts counts(patches.sideCount());
    for (uint32_t done = 0; done < count; done += 64)
        counts.add(tracer.trace(std::min(64u, count - done)));
    return {std::move(counts), tracer.lineCount()};
}

TEST(LineWindows, CountsFollowTheAreasInsideAndOutside) {
    const Patches patches = subdivide(hallWithSmallThings(0.5f), 2, kMany);
    constexpr uint32_t kCount = 2048;
    const LineCounts counts = trace(patches, kPixel, smallWindows(), kCount).counts;
    double small = 0, large = 0, smallWanted = 0, largeWanted = 0;
    for (uint32_t p = 0; p < patches.count(); ++p) {
        ASSERT_EQ(counts.total[2 * p], counts.total[2 * p + 1]) << "a line has two ends";
        const double wanted = kCount * double(patches.area[p]) / (2 * kFinest * kFinest);
        const double lines = counts.linesMet(2 * p);
        // Single patches: four standard deviations of as many independent lines.
        EXPECT_NEAR(linesOf(counts, 2 * p) / wanted, 1, 4 / std::sqrt(lines)) << "patch " << p;
        const bool isHall = patches.parents[patches.parentOf[p]].instance == 0;
        (isHall ? large : small) += linesOf(counts, 2 * p);
        (isHall ? largeWanted : smallWanted) += wanted;
    }
    // All patches together: 60,000 and 800,000 lines, with far less noise than independent lines.
    EXPECT_NEAR(small / smallWanted, 1, 0.005);
    EXPECT_NEAR(large / largeWanted, 1, 0.001);
}

TEST(LineWindows, ExchangesHaveTheMeanOfUniformLines) {
    const Patches patches = subdivide(hallWithSmallThings(0.5f), 5, kMany);
    auto betweenInstances = [&](const LineCounts& counts) {
        std::array<std::array<double, 4>, 4> lines{};
        for (uint32_t i = 0; i < counts.sideCount(); ++i) {
            auto& from = lines[patches.parents[patches.parentOf[i / 2]].instance];
            for (const LineCount& c : counts.row(i))
                from[patches.parents[patches.parentOf[c.side / 2]].instance] +=
                    double(c.lines[0]) + c.lines[1];
        }
        return lines;
    };
    constexpr int kSeeds = 24;
    double sum[4][4] = {}, squares[4][4] = {};
    for (int seed = 0; seed < kSeeds; ++seed) {
        const auto lines =
            betweenInstances(trace(patches, kPixel, smallWindows(), 64, uint32_t(seed)).counts);
        for (uint32_t i = 0; i < 4; ++i)
            for (uint32_t j = 0; j < 4; ++j) {
                sum[i][j] += lines[i][j];
                squares[i][j] += lines[i][j] * lines[i][j];
            }
    }
    // Uniform lines as dense as in the finest window, with hardly any noise.
    const uint32_t kCount = 512;
    const auto uniform = betweenInstances(trace(patches, float(kFinest), {}, kCount, 99).counts);
    for (uint32_t i = 0; i < 4; ++i)
        for (uint32_t j = 0; j < 4; ++j) {
            const double mean = sum[i][j] / kSeeds;
            const double exact = uniform[i][j] * 64 / kCount;
            const double error =
                std::sqrt(std::max(0.0, squares[i][j] / kSeeds - mean * mean) / (kSeeds - 1));
            EXPECT_NEAR(mean, exact, 4 * error + 0.004 * exact) << i << " and " << j;
        }
}

TEST(LineWindows, CountsAreSymmetricAndAddUp) {
    const Patches patches = subdivide(hallWithSmallThings(0.5f), 2, kMany);
    const LineCounts counts = trace(patches, kPixel, smallWindows(), 16).counts;
    for (uint32_t i = 0; i < counts.sideCount(); ++i) {
        std::array<uint32_t, 2> sum = counts.sky[i];
        for (const LineCount& c : counts.row(i)) {
            for (size_t h = 0; h < 2; ++h) sum[h] += c.lines[h];
            ASSERT_EQ(linesBetween(counts, c.side, i), double(c.lines[0]) + c.lines[1]);
        }
        ASSERT_EQ(sum, counts.total[i]);
    }
}

// A wall of 10 m with 10^8 lines per bundle, or four times as many in windows with pixels of half
// the edge. Each half of the bundles can count up to 2^32 lines.
TEST(LineWindows, NoMoreBundlesAreTracedThanCanBeCounted) {
    Scene scene;
    place(scene, rectangle("wall", {0, 0, 0}, {10, 0, 0}, {0, 10, 0}), grey("", 0.5f));
    const Patches patches = subdivide(scene, 100, kMany);
    LineDensity density;
    density.pixelSize = 1e-3f;
    EXPECT_NEAR(mostBundles(patches, density), 0x1p32 / 1e8, 1.5);
    density.windows = {{{0, 0, 0}, {1, 1, 1}, 1}};
    EXPECT_NEAR(mostBundles(patches, density), 0x1p32 / 4e8, 1.5);
    density.windows.clear();
    density.pixelSize = 0.1f;
    EXPECT_GT(mostBundles(patches, density), 100000u);
}

TEST(LineWindows, TheNumberOfThreadsDoesNotMatter) {
    const Patches patches = subdivide(hallWithSmallThings(0.5f), 2, kMany);
    auto traceWith = [&](int threads) {
        tbb::task_arena arena(threads);
        return arena.execute([&] { return trace(patches, kPixel, smallWindows(), 32).counts; });
    };
    const LineCounts one = traceWith(1), two = traceWith(2);
    EXPECT_EQ(one.total, two.total);
    EXPECT_EQ(one.sky, two.sky);
    EXPECT_EQ(one.exchangeCount(), two.exchangeCount());
}

TEST(LineWindows, AFurnaceIsExact) {
    const Patches patches = subdivide(hallWithSmallThings(0.7f, 0.3f), 1, kMany);
    for (uint32_t bundles : {2u, 32u}) {
        const LineCounts counts = trace(patches, kPixel, smallWindows(), bundles).counts;
        FirstShot shot;
        shot.irradiance.assign(patches.sideCount(), glm::vec3(0));
        shot.emission = patches.emission;
        const std::vector<float> exposed;
        const LineReuse solver(patches, counts, shot, glm::vec3(0), exposed);
        std::vector<glm::vec3> reflected(patches.sideCount(), glm::vec3(0));
        const Irradiance h = solver.solve(Half::BOTH, 1e-6f, reflected);
        for (uint32_t i = 0; i < patches.sideCount(); i += 2)
            if (counts.total[i][0] + counts.total[i][1] > 0) {
                ASSERT_NEAR(h.direct[i].x + h.indirect[i].x, 1, 1e-5) << "side " << i;
            }
    }
}

TEST(LineWindows, DensityFollowsThePatches) {
    const Patches patches = subdivide(hallWithSmallThings(0.5f), 1, kMany);
    const LineDensity density = densityByDetail(patches, {0.5f}, 2, {0.001f});
    ASSERT_FALSE(density.windows.empty());
    ASSERT_EQ(density.windowOf.size(), patches.parents.size());
    for (size_t p = 0; p < patches.parents.size(); ++p) {
        const Parent& parent = patches.parents[p];
        if (parent.instance == 0) {
            EXPECT_LT(density.windowOf[p], 0) << "the hall's walls";
            continue;
        }
        if (parent.instance != 1) continue;
        ASSERT_GE(density.windowOf[p], 0) << "the ball";
        const LineWindow& window = density.windows[size_t(density.windowOf[p])];
        const double pixel = std::ldexp(double(density.pixelSize), -window.level);
        const double pixels = double(patches.area[parent.firstPatch]) / (pixel * pixel);
        EXPECT_GT(pixels, 0.24);
        EXPECT_LT(pixels, 4);
        for (int k = 0; k < 3; ++k) {
            const glm::vec3& v = patches.vertices[parent.vertex[size_t(k)]];
            EXPECT_TRUE(glm::all(glm::greaterThanEqual(v, window.low)) &&
                        glm::all(glm::lessThanEqual(v, window.high)));
        }
    }
}

TEST(LineWindows, PatchesOfOneSizeNeedNone) {
    const Patches patches = subdivide(roomWithBoxes(0.5f), 0.2f, kMany);
    const LineDensity density = densityByDetail(patches, {0.14f}, 2, {0.001f});
    EXPECT_TRUE(density.windows.empty());
    EXPECT_EQ(density.pixelSize, 0.14f);
}

TEST(LineWindows, SmallThingsHaveLessNoiseThanOfAsManyUniformLines) {
    const Patches patches = subdivide(hallWithSmallThings(0.5f), 1, kMany);
    auto light = [&](const LineCounts& counts) {
        FirstShot shot;
        shot.irradiance.assign(patches.sideCount(), glm::vec3(0));
        shot.emission.assign(patches.sideCount(), glm::vec3(0));
        for (uint32_t i = 0; i < patches.sideCount(); i += 2)  // one wall emits
            if (patches.parents[patches.parentOf[i / 2]].face == 0 &&
                patches.parents[patches.parentOf[i / 2]].instance == 0)
                shot.emission[i] = glm::vec3(1);
        const std::vector<float> exposed;
        const LineReuse solver(patches, counts, shot, glm::vec3(0), exposed);
        std::vector<glm::vec3> reflected(patches.sideCount(), glm::vec3(0));
        const Irradiance h = solver.solve(Half::BOTH, 1e-6f, reflected);
        std::vector<double> ball;
        for (uint32_t i = 0; i < patches.sideCount(); i += 2)
            if (patches.parents[patches.parentOf[i / 2]].instance == 1)
                ball.push_back(double(h.direct[i].x + h.indirect[i].x));
        return ball;
    };
    const LineDensity density = densityByDetail(patches, {0.5f}, 2, {0.001f});
    const Traced dense = trace(patches, density.pixelSize, density.windows, 128);
    // Uniform lines with as many lines in all, which means finer pixels everywhere.
    const float finer =
        density.pixelSize *
        std::sqrt(float(trace(patches, density.pixelSize, {}, 128).lines) / float(dense.lines));
    const Traced uniform = trace(patches, finer, {}, 128);
    EXPECT_NEAR(double(uniform.lines) / double(dense.lines), 1, 0.05);
    const std::vector<double> exact =
        light(trace(patches, density.pixelSize, density.windows, 4096, 7).counts);
    auto noise = [&](const std::vector<double>& found) {
        double squares = 0, signal = 0;
        for (size_t k = 0; k < exact.size(); ++k) {
            squares += (found[k] - exact[k]) * (found[k] - exact[k]);
            signal += exact[k] * exact[k];
        }
        return std::sqrt(squares / signal);
    };
    EXPECT_LT(noise(light(dense.counts)), 0.3 * noise(light(uniform.counts)));
}

}  // namespace
}  // namespace raybundle
