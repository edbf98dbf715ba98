// SPDX-License-Identifier: GPL-3.0-or-later
//
// ADAPTIVE directions: weighted means equal those of uniform directions, whatever was learned.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "bundles/directions.h"

namespace raybundle {
namespace {

constexpr double kMostWeight = 1 / 0.3;

// Very uneven power: almost all flows in a narrow cone, and in half of the directions none.
double unevenPower(const glm::dvec3& d) {
    const double along = glm::dot(d, glm::normalize(glm::dvec3(1, 2, 2)));
    return along < 0 ? 0 : 1000 * std::pow(along, 60) + 0.1;
}

using Function = std::function<double(const glm::dvec3&)>;

// Runs batches of bundles and lets the directions learn the uneven power. Calls `visit` for each
// bundle.
void learnUneven(Directions& directions, uint32_t batches, uint32_t perBatch,
                 const std::function<void(const Bundle&)>& visit) {
    for (uint32_t k = 0; k < batches; ++k) {
        const std::vector<Bundle> bundles = directions.next(perBatch);
        for (const Bundle& bundle : bundles) {
            visit(bundle);
            directions.learn(bundle, unevenPower(bundle.direction));
        }
    }
}

TEST(AdaptiveDirections, AreUniformUntilTheyLearn) {
    Directions directions(DirectionKind::ADAPTIVE, 4);
    glm::dmat3 second(0.0);
    constexpr uint32_t kCount = 4096;
    for (const Bundle& b : directions.next(kCount)) {
        EXPECT_DOUBLE_EQ(b.weight, 1);
        EXPECT_GE(b.direction.z, 0);
        second += glm::outerProduct(b.direction, b.direction) / double(kCount);
    }
    // The tolerance is five standard errors of independent directions, as in
    // Directions.LinesAreUniformOverTheSphere.
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(second[i][i], 1.0 / 3, 0.0233);
}

TEST(AdaptiveDirections, WeightedMeansAreUnbiased) {
    // Functions and their means over the hemisphere, by area.
    const std::vector<std::pair<Function, double>> functions = {
        {[](const glm::dvec3&) { return 1.0; }, 1.0},
        {[](const glm::dvec3& d) { return d.z * d.z; }, 1.0 / 3},
        {[](const glm::dvec3& d) { return d.x * d.x; }, 1.0 / 3},
        {[](const glm::dvec3& d) { return d.z; }, 0.5},
        {[](const glm::dvec3& d) { return d.x * d.y; }, 0.0}};
    for (uint32_t seed : {1u, 2u, 3u}) {
        Directions directions(DirectionKind::ADAPTIVE, seed);
        std::vector<double> sum(functions.size(), 0.0), squares(sum);
        double count = 0;
        learnUneven(directions, 2000, 8, [&](const Bundle& b) {
            ++count;
            ASSERT_LE(b.weight, kMostWeight * (1 + 1e-12));
            ASSERT_GT(b.weight, 0);
            for (size_t f = 0; f < functions.size(); ++f) {
                const double x = b.weight * functions[f].first(b.direction) - functions[f].second;
                sum[f] += x;
                squares[f] += x * x;
            }
        });
        // Bundles depend on the bundles before, but each is unbiased given these, so that their
        // errors are uncorrelated. The tolerance is four measured standard errors.
        for (size_t f = 0; f < functions.size(); ++f)
            EXPECT_LT(std::abs(sum[f]), 4 * std::sqrt(squares[f])) << "function " << f;
        EXPECT_LT(4 * std::sqrt(squares[1]) / count, 0.03) << "the bound says something";
    }
}

TEST(AdaptiveDirections, WeightsReachTheirBoundWhereNoPowerFlows) {
    Directions directions(DirectionKind::ADAPTIVE, 5);
    double most = 0, least = 10;
    learnUneven(directions, 2000, 8, [&](const Bundle& b) {
        most = std::max(most, b.weight);
        least = std::min(least, b.weight);
    });
    EXPECT_LE(most, kMostWeight * (1 + 1e-12));
    EXPECT_GT(most, 0.9 * kMostWeight);
    EXPECT_LT(least, 0.2);
}

TEST(AdaptiveDirections, EstimateTheLearnedPowerWithLessNoise) {
    double wanted = 0;
    constexpr int kGrid = 1000;
    for (int i = 0; i < kGrid; ++i)
        for (int j = 0; j < kGrid; ++j)
            wanted += unevenPower(onHemisphere((i + 0.5) / kGrid, (j + 0.5) / kGrid)) /
                      (double(kGrid) * kGrid);
    double squares[2] = {0, 0}, sum = 0, count = 0;
    for (DirectionKind kind : {DirectionKind::RANDOM, DirectionKind::ADAPTIVE}) {
        const bool isAdaptive = kind == DirectionKind::ADAPTIVE;
        Directions directions(kind, 6);
        learnUneven(directions, 2000, 8, [&](const Bundle& b) {
            const double x = b.weight * unevenPower(b.direction) - wanted;
            squares[isAdaptive] += x * x;
            if (isAdaptive) {
                sum += x;
                ++count;
            }
        });
    }
    EXPECT_LT(std::abs(sum), 4 * std::sqrt(squares[1]));
    EXPECT_LT(squares[1], 0.3 * squares[0]);
}

// The light that a bundle carries between two squares of 1 m that face each other 1 m apart, by
// direction.
double betweenSquares(const glm::dvec3& d) {
    const double x = std::abs(d.x / d.z), y = std::abs(d.y / d.z);
    return d.z > 0 ? d.z * std::max(0.0, 1 - x) * std::max(0.0, 1 - y) : 0;
}

// Measured over 4000 bundles, including those that the directions learn from. The ratio of the
// variances is a fifth; 40 seeds determine it within a third of its value.
TEST(AdaptiveDirections, HaveLessThanHalfTheVarianceOfRandomOnesOnABroadLobe) {
    double variance[2];
    for (const bool isAdaptive : {false, true}) {
        double sum = 0, squares = 0;
        constexpr int kSeeds = 40;
        for (uint32_t seed = 0; seed < kSeeds; ++seed) {
            Directions directions(isAdaptive ? DirectionKind::ADAPTIVE : DirectionKind::RANDOM,
                                  seed);
            double carried = 0;
            for (int batch = 0; batch < 250; ++batch)
                for (const Bundle& b : directions.next(16)) {
                    carried += b.weight * betweenSquares(b.direction) / 4000;
                    directions.learn(b, betweenSquares(b.direction));
                }
            sum += carried / kSeeds;
            squares += carried * carried / kSeeds;
        }
        variance[isAdaptive] = squares - sum * sum;
    }
    EXPECT_LT(variance[1], 0.5 * variance[0]);
}

TEST(AdaptiveDirections, HalvesLearnByThemselves) {
    // What the second half learns does not change the first half.
    Directions alone(DirectionKind::ADAPTIVE, 7), both(DirectionKind::ADAPTIVE, 7);
    for (int k = 0; k < 50; ++k) {
        const std::vector<Bundle> a = alone.next(8), b = both.next(8);
        for (size_t i = 0; i < a.size(); ++i) {
            if (a[i].half == 0) {
                ASSERT_EQ(a[i].direction, b[i].direction);
                ASSERT_EQ(a[i].weight, b[i].weight);
                alone.learn(a[i], unevenPower(a[i].direction));
            }
            both.learn(b[i], unevenPower(b[i].direction));
        }
    }
    EXPECT_NE(alone.next(8)[7].direction, both.next(8)[7].direction);
}

TEST(AdaptiveDirections, NoPowerAtAllTeachesNothing) {
    Directions directions(DirectionKind::ADAPTIVE, 8);
    for (int k = 0; k < 4; ++k)
        for (const Bundle& b : directions.next(64)) {
            EXPECT_NEAR(b.weight, 1, 1e-12);
            directions.learn(b, 0);
        }
}

}  // namespace
}  // namespace raybundle
