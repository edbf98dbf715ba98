// SPDX-License-Identifier: GPL-3.0-or-later
//
// The thesis' estimators of form factors against closed forms: they are unbiased, have the variance
// that theory gives, and their error falls with the square root of the number of lines.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bench/form_factors.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

struct Pair {
    Pair(const Mesh& from, const Mesh& to, double exact) : exact(exact) {
        Scene scene;
        place(scene, from, grey("", 0));
        place(scene, to, grey("", 0));
        patches = subdivide(scene, 10, 1000);
        visibility = std::make_unique<Visibility>(patches);
    }
    FormFactor ends() const { return {patches, *visibility, 0, 2}; }

    double exact;
    Patches patches;
    std::unique_ptr<Visibility> visibility;
};

// Unit squares that face each other at a distance of 1.
Pair parallelSquares() {
    return {rectangle("low", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
            rectangle("high", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}), parallelRectangles(1, 1, 1)};
}

// Mean and variance of single estimates over several seeds.
struct Moments {
    double mean = 0, variance = 0;
};
Moments momentsOf(const Pair& pair, const FormFactorEstimator& estimator, uint32_t lines,
                  uint32_t seeds) {
    double first = 0, second = 0;
    for (uint32_t seed = 0; seed < seeds; ++seed) {
        std::seed_seq words{seed, lines, 17u};
        std::mt19937_64 random(words);
        const double value = estimator.estimate(pair.ends(), lines, random) - pair.exact;
        first += value / seeds;
        second += value * value / seeds;
    }
    return {pair.exact + first, (second - first * first) * seeds / (seeds - 1)};
}

TEST(FormFactorEstimators, AreUnbiased) {
    const Pair pairs[] = {
        parallelSquares(),
        {rectangle("floor", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
         rectangle("wall", {0, 0, 0}, {0, 1, 0}, {0, 0, 1}), perpendicularRectangles(1, 1, 1)},
        {rectangle("low", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
         rectangle("high", {0.5f, -0.25f, 0.7f}, {0, 0.8f, 0}, {1.3f, 0, 0}),
         offsetRectangles({0, 1}, {0, 1}, {0.5, 1.8}, {-0.25, 0.55}, 0.7)},
    };
    for (const Pair& pair : pairs)
        for (const FormFactorEstimator& estimator : formFactorEstimators()) {
            // The lines of a bundle share a direction, so the ratio has a bias of the order of one
            // over the number of bundles. There are as many bundles here as lines for the other
            // estimators.
            const uint32_t lines = estimator.name == "bundles" ? 25600 : 1024;
            constexpr uint32_t kSeeds = 60;
            const Moments m = momentsOf(pair, estimator, lines, kSeeds);
            EXPECT_NEAR(m.mean, pair.exact, 3 * std::sqrt(m.variance / kSeeds)) << estimator.name;
            EXPECT_LT(m.variance, 0.1 * pair.exact * pair.exact) << estimator.name;
        }
}

TEST(FormFactorEstimators, OccludersCount) {
    // A screen half-way between the squares hides a part of them from each other. All estimators
    // must see the same remainder.
    Scene scene;
    place(scene, rectangle("low", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0));
    place(scene, rectangle("high", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}), grey("", 0));
    place(scene, rectangle("screen", {0.5f, 0, 0.5f}, {0.5f, 0, 0}, {0, 1, 0}), grey("", 0));
    const Patches patches = subdivide(scene, 10, 1000);
    const Visibility visibility(patches);
    const FormFactor f{patches, visibility, 0, 2};
    std::vector<double> values;
    for (const FormFactorEstimator& estimator : formFactorEstimators()) {
        std::mt19937_64 random(5);
        values.push_back(
            estimator.estimate(f, estimator.name == "bundles" ? 400000 : 40000, random));
    }
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    EXPECT_LT(*high, 0.75 * parallelRectangles(1, 1, 1));
    // A form factor of 0.1 by 40000 lines, of which a fifth meets the square: at most 3 % of error
    // each.
    EXPECT_LT(*high - *low, 0.1 * *high);
}

TEST(FormFactorEstimators, HaveTheirTheoreticalVariances) {
    // With r the distance of two points, both cosines are 1 / r. The difference (u, v) of the
    // points has the density (1 - |u|) (1 - |v|).
    double area = 0, hemisphere = 0, exact = 0;
    constexpr int kSteps = 400;
    for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j) {
            const double u = (i + 0.5) / kSteps, v = (j + 0.5) / kSteps;
            const double weight = 4 * (1 - u) * (1 - v) / (kSteps * kSteps);
            const double r2 = 1 + u * u + v * v, kernel = 1 / (kPi * r2 * r2);
            exact += weight * kernel;
            area += weight * kernel * kernel;
            // pi cos sin, relative to the density of the cosine.
            hemisphere += weight * kernel * kPi * std::sqrt(1 / r2) * std::sqrt(1 - 1 / r2);
        }
    const Pair pair = parallelSquares();
    ASSERT_NEAR(exact, pair.exact, 1e-5);
    const double f2 = pair.exact * pair.exact;
    const double theory[3] = {area - f2, hemisphere - f2, pair.exact - f2};
    // For these squares the estimator by area has the least variance, because its integrand varies
    // only by a factor of 9. The cosine follows; the uniform hemisphere is last, by 5 %.
    EXPECT_LT(theory[0], theory[2]);
    EXPECT_LT(theory[2], theory[1]);
    double found[3];
    for (size_t k = 0; k < 3; ++k) {
        constexpr uint32_t kLines = 16, kSeeds = 20000;
        found[k] = kLines * momentsOf(pair, formFactorEstimators()[k], kLines, kSeeds).variance;
        // The standard error of the variance of 20000 estimates is sqrt(2 / 20000) = 1 %.
        EXPECT_NEAR(found[k], theory[k], 4 * 0.01 * theory[k]) << formFactorEstimators()[k].name;
        RecordProperty(formFactorEstimators()[k].name, std::to_string(found[k]));
    }
    EXPECT_LT(found[0], found[2]);
    EXPECT_LT(found[2], found[1]);
}

TEST(FormFactorEstimators, ErrorFallsWithTheSquareRootOfTheLines) {
    const Pair pair = parallelSquares();
    for (const FormFactorEstimator& estimator : formFactorEstimators()) {
        double sx = 0, sy = 0, sxx = 0, sxy = 0;
        int count = 0;
        for (uint32_t lines = 1 << 8; lines <= 1 << 14; lines *= 2) {
            constexpr uint32_t kSeeds = 32;
            const Moments m = momentsOf(pair, estimator, lines, kSeeds);
            const double x = std::log(double(lines)), y = 0.5 * std::log(m.variance);
            sx += x;
            sy += y;
            sxx += x * x;
            sxy += x * y;
            ++count;
        }
        const double slope = (count * sxy - sx * sy) / (count * sxx - sx * sx);
        // The logarithm of each error is known within 1 / sqrt(2 * 31) = 0.127, the slope over
        // these 7 points within 0.127 / (ln 2 sqrt 28) = 0.035. The first two points of the
        // bundles, with two and four bundles, lie off the asymptote; the bundles get twice the
        // tolerance.
        EXPECT_NEAR(slope, -0.5, (estimator.name == "bundles" ? 6 : 3) * 0.035) << estimator.name;
        RecordProperty(estimator.name, std::to_string(slope));
    }
}

}  // namespace
}  // namespace raybundle
