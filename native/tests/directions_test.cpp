// SPDX-License-Identifier: GPL-3.0-or-later
//
// Properties that every sequence of directions must have.
#include "bundles/directions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace raybundle {
namespace {

TEST(Directions, FramesAreOrthonormalAndRightHanded) {
    for (const DirectionRow& kind : kDirectionKinds)
        for (const Bundle& b : Directions(kind.value, 3).next(1000)) {
            EXPECT_NEAR(glm::length(b.right), 1, 1e-6);
            EXPECT_NEAR(glm::length(b.up), 1, 1e-6);
            EXPECT_NEAR(glm::length(b.direction), 1, 1e-6);
            EXPECT_NEAR(glm::dot(b.right, b.up), 0, 1e-6);
            EXPECT_LT(glm::distance(glm::cross(b.right, b.up), b.direction), 1e-6f);
            EXPECT_TRUE(b.shift.x >= 0 && b.shift.x < 1 && b.shift.y >= 0 && b.shift.y < 1);
        }
}

TEST(Directions, LinesAreUniformOverTheSphere) {
    constexpr uint32_t kCount = 4096;
    for (const DirectionRow& kind : kDirectionKinds)
        for (uint32_t seed : {0u, 1u, 2u}) {
            glm::dmat3 second(0.0);
            glm::dvec3 fourth(0.0), rightSecond(0.0);
            glm::dvec2 shift(0.0);
            for (const Bundle& b : Directions(kind.value, seed).next(kCount)) {
                const glm::dvec3 d(b.direction), r(b.right);
                second += b.weight * glm::outerProduct(d, d) / double(kCount);
                fourth += b.weight * d * d * d * d / double(kCount);
                rightSecond += b.weight * r * r / double(kCount);
                shift += glm::dvec2(b.shift) / double(kCount);
            }
            // The tolerance is five standard errors of independent directions: sqrt(4/45) of x^2,
            // sqrt(16/225) of x^4 and sqrt(1/12) of a shift, over sqrt(4096). A low-discrepancy set
            // is at least ten times better in the directions. Rolls and shifts are random in both.
            const double better = kind.isIndependent ? 1.0 : 0.1;
            for (int i = 0; i < 3; ++i) {
                for (int j = 0; j < 3; ++j)
                    EXPECT_NEAR(second[i][j], i == j ? 1.0 / 3 : 0.0, better * 0.0233);
                EXPECT_NEAR(fourth[i], 0.2, better * 0.0208);
                EXPECT_NEAR(rightSecond[i], 1.0 / 3, 0.0233);
            }
            EXPECT_NEAR(shift.x, 0.5, 0.0226);
            EXPECT_NEAR(shift.y, 0.5, 0.0226);
        }
}

TEST(Directions, TheSequenceDoesNotDependOnHowItIsRequested) {
    for (const DirectionRow& kind : kDirectionKinds) {
        std::vector<Bundle> parts = Directions(kind.value, 7).next(4);
        for (const Bundle& b : Directions(kind.value, 7, 4).next(4)) parts.push_back(b);
        std::stable_sort(parts.begin(), parts.end(),
                         [](const Bundle& a, const Bundle& b) { return a.half < b.half; });
        const std::vector<Bundle> whole = Directions(kind.value, 7).next(8);
        ASSERT_EQ(whole.size(), parts.size());
        for (size_t k = 0; k < whole.size(); ++k) {
            EXPECT_EQ(whole[k].half, k / 4);
            EXPECT_EQ(whole[k].half, parts[k].half);
            EXPECT_EQ(whole[k].direction, parts[k].direction);
            EXPECT_EQ(whole[k].right, parts[k].right);
            EXPECT_EQ(whole[k].shift, parts[k].shift);
        }
        EXPECT_NE(Directions(kind.value, 8).next(8)[0].direction, whole[0].direction)
            << "another seed";
        EXPECT_NE(whole[0].direction, whole[4].direction) << "the halves are independent";
    }
}

}  // namespace
}  // namespace raybundle
