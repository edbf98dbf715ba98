// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sobol points are stratified everywhere in the sequence, including indices beyond the first table.
#include "sampling/sobol.h"

#include <gtest/gtest.h>

#include <vector>

namespace raybundle {
namespace {

TEST(Sobol, AnyPowerOfTwoOfThemFromAMultipleOnAreStratified) {
    const SobolPoints points(7);
    for (const uint32_t count : {16u, 256u, 4096u})
        for (const uint32_t first : {0u, 256u, 4096u, 65536u, 3u << 16, 5u << 24, 15u << 28}) {
            if (first % count != 0) continue;
            for (int d = 0; d < 4; ++d) {
                std::vector<int> inStratum(count, 0);
                for (uint32_t i = first; i < first + count; ++i)
                    ++inStratum[size_t(points[i][d] * float(count))];
                for (uint32_t stratum = 0; stratum < count; ++stratum)
                    ASSERT_EQ(inStratum[stratum], 1) << count << " from " << first << ", " << d;
            }
        }
}

// The first dimension mirrors the bits of the index, apart from the shift by the seed.
TEST(Sobol, TheFirstDimensionIsVanDerCorputs) {
    const SobolPoints points(3);
    auto bitsOf = [&](uint32_t index) { return uint32_t(points[index].x * 0x1p24f); };
    for (const uint32_t index : {1u, 2u, 3u, 255u, 256u, 0x10203u, 0xffffffu}) {
        uint32_t mirrored = 0;
        for (int k = 0; k < 24; ++k) mirrored |= (index >> k & 1) << (23 - k);
        EXPECT_EQ(bitsOf(index) ^ bitsOf(0), mirrored) << index;
    }
}

}  // namespace
}  // namespace raybundle
