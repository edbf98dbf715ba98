// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/line_rows.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace raybundle {
namespace {

// Returns the number of lines in row i by the other side.
std::map<uint32_t, uint64_t> row(const LineRows& rows, uint32_t i) {
    std::map<uint32_t, uint64_t> result;
    for (const uint32_t* e = rows.first(i); e < rows.last(i); ++e)
        result[LineRows::sideOf(*e)] += LineRows::linesOf<uint32_t>()[*e & 255];
    return result;
}

// Returns a bundle with `pairs` exchanges of one line between `sides` sides.
BundleLines everyPair(uint32_t sides, uint32_t pairs) {
    BundleLines bundle;
    for (uint32_t k = 0; k < pairs; ++k) {
        const uint32_t i = k % sides, j = (i + 1 + k / sides % (sides - 1)) % sides;
        bundle.exchanges.push_back({std::min(i, j), std::max(i, j), 1});
    }
    return bundle;
}

TEST(LineRows, BothEndsHaveTheLines) {
    BundleLines a, b;
    a.exchanges = {{1, 700, 3}, {0, 1, 2}};
    b.exchanges = {{1, 700, 4}};
    LineRows rows(1000);
    const std::vector<uint32_t> got = rows.append({&a, &b});
    EXPECT_EQ(got[1], 9u);
    EXPECT_EQ(got[700], 7u);
    EXPECT_EQ(row(rows, 1), (std::map<uint32_t, uint64_t>{{0, 2}, {700, 7}}));
    EXPECT_EQ(row(rows, 700), (std::map<uint32_t, uint64_t>{{1, 7}}));
    EXPECT_EQ(rows.append({&b})[1], 4u) << "the new ones alone";
    EXPECT_EQ(row(rows, 1), (std::map<uint32_t, uint64_t>{{0, 2}, {700, 11}}));
}

TEST(LineRows, AnyNumberOfLinesIsKept) {
    BundleLines bundle;
    bundle.exchanges = {{0, 1, 1000000}};
    bundle.densities = {{64, 1, 0, 0}};  // a line of a coarse view counts as 64
    LineRows rows(2);
    EXPECT_EQ(rows.append({&bundle})[0], 64000000u);
    EXPECT_EQ(row(rows, 0)[1], 64000000u);
    for (int k = 0; k < 8; ++k) rows.append({&bundle});  // some additions are joined
    EXPECT_EQ(row(rows, 1)[0], 9 * 64000000u);
}

TEST(LineRows, RepeatedPairsAreJoined) {
    // There are 20 x 19 / 2 pairs, whatever the number of lines.
    LineRows rows(20);
    const BundleLines bundle = everyPair(20, 380);
    for (int k = 0; k < 100; ++k) rows.append({&bundle});
    EXPECT_LE(rows.entryCount(), 4 * 380u);
    for (const auto& [side, lines] : row(rows, 7)) EXPECT_EQ(lines, 200u) << side;
    constexpr size_t kEntries = 4 * 380;
    EXPECT_LE(rows.byteCount(), 4 * kEntries + 21 * sizeof(size_t) + 4 * (kEntries / 64 + 1));
}

TEST(LineRows, RepeatedPairsAreJoinedWhereOneSideOfAllPatchesSeesNothing) {
    // Of 256 sides those of one parity exchange 20 lines each with other sides of this parity,
    // repeatedly.
    for (const uint32_t parity : {0u, 1u}) {
        LineRows rows(256);
        BundleLines bundle;
        for (const Exchange& e : everyPair(128, 128 * 10).exchanges)
            bundle.exchanges.push_back({2 * e.i + parity, 2 * e.j + parity, 1});
        for (int k = 0; k < 100; ++k) rows.append({&bundle});
        EXPECT_LE(rows.entryCount(), 4 * 128 * 20u) << parity;
    }
}

// Some lines represent all lines of a row that has 400 sides with one line each and one side with
// 200. All lines are met equally often, and the 200 lines count with their number each time, within
// one step.
TEST(LineRows, SomeLinesStandForAll) {
    constexpr uint32_t kOthers = 400, kMany = 200, kEnough = 60, kTimes = 2000;
    BundleLines bundle;
    for (uint32_t side = 2; side < kOthers + 2; ++side) bundle.exchanges.push_back({0, side, 1});
    bundle.exchanges.push_back({0, 1, kMany});
    bundle.exchanges.push_back({5, 6, 3});
    LineRows rows(kOthers + 2);
    rows.append({&bundle});
    std::mt19937 random;
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    auto within = [&](size_t) { return unit(random); };
    constexpr double kStep = double(kOthers + kMany) / kEnough;
    std::vector<double> sum(kOthers + 2, 0);
    for (uint32_t k = 0; k < kTimes; ++k) {
        double all = 0, ofMany = 0;
        size_t visits = 0;
        rows.visitSome(0, kEnough, within, [&](uint32_t side, float lines) {
            ++visits;
            all += double(lines);
            if (side == 1) ofMany += double(lines);
            sum[side] += double(lines) / kTimes;
        });
        EXPECT_LE(visits, kEnough);
        EXPECT_NEAR(all, kOthers + kMany, 0.01);
        EXPECT_NEAR(ofMany, kMany, kStep);
    }
    EXPECT_NEAR(sum[1], kMany, 0.05 * kStep);
    // Each line is met once in ten times and then counts ten: over 2000 times the mean is 1 +-
    // 0.07.
    for (uint32_t side = 2; side < sum.size(); ++side) EXPECT_NEAR(sum[side], 1, 0.3) << side;

    double exact = 0;
    rows.visitSome(0, kOthers + 200, within, [&](uint32_t side, float lines) {
        exact += double(lines);
        EXPECT_TRUE(side == 1 || lines == 1) << side;
    });
    EXPECT_EQ(exact, kOthers + kMany);
}

}  // namespace
}  // namespace raybundle
