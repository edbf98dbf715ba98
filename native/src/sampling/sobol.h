// SPDX-License-Identifier: GPL-3.0-or-later
//
// The first four dimensions of the Sobol sequence.
//
// Sources: direction numbers of Joe and Kuo, "Constructing Sobol Sequences with Better
// Two-Dimensional Projections" (2008); randomisation by a digital shift from Kollig and Keller,
// "Efficient Multidimensional Sampling" (2002).
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace raybundle {

// A four-dimensional Sobol sequence, randomised by a seed. Every aligned block of 2^k points (one
// whose first index is a multiple of 2^k) is stratified. Copies are cheap, since all share static
// tables.
class SobolPoints {
  public:
    // Constructs the sequence of `seed`. Different seeds shift the points differently.
    explicit SobolPoints(uint32_t seed);

    // Returns the point of an index, in [0, 1)^4. Every 32-bit index is valid.
    glm::vec4 operator[](uint32_t index) const {
        Bits bits = tables[index % kTableSize];
        // A Sobol point is the exclusive or of the columns of the set bits of its index. Each table
        // entry holds that sum for 8 bits of the index.
        for (const Bits* next = tables; index >= kTableSize;) {
            index /= kTableSize;
            next += kTableSize;
            for (size_t d = 0; d < 4; ++d) bits[d] ^= next[index % kTableSize][d];
        }
        glm::vec4 point;
        // Keep the top 24 bits: a float represents them exactly, so that the coordinate stays below
        // 1.
        for (int d = 0; d < 4; ++d) point[d] = float((bits[d] ^ shift[d]) >> 8) * 0x1p-24f;
        return point;
    }

  private:
    using Bits = std::array<uint32_t, 4>;
    // Each table has kTableSize entries, one for each value of kTableBits bits of the index. The
    // tables lie one after the other, from the lowest bits of the index to the highest.
    static constexpr uint32_t kTableBits = 8, kTableSize = 1 << kTableBits;
    static constexpr uint32_t kTables = 32 / kTableBits;
    // Returns the tables. The first call computes them; they live until the program ends.
    static const Bits* allTables();

    Bits shift;
    const Bits* tables;
};

// Returns the point `index` of the sequence of `seed`, in [0, 1)^4. For several points of one seed,
// construct a SobolPoints once instead.
inline glm::vec4 sobolPoint(uint32_t index, uint32_t seed) { return SobolPoints(seed)[index]; }

// Returns a well-mixed 32-bit hash of two numbers, such as a seed and an index. Used to derive a
// seed for each item.
uint32_t hash(uint32_t a, uint32_t b);

}  // namespace raybundle
