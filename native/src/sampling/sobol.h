// SPDX-License-Identifier: GPL-3.0-or-later
//
// The first four dimensions of the Sobol sequence (direction numbers of Joe and Kuo, 2008),
// randomised by a digital shift (Kollig and Keller, "Efficient Multidimensional Sampling", 2002).
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace raybundle {

// The points of a seed. Any 2^k consecutive ones from a multiple of 2^k on are stratified.
class SobolPoints {
  public:
    explicit SobolPoints(uint32_t seed);

    // In [0, 1)^4.
    glm::vec4 operator[](uint32_t index) const {
        Bits bits = tables[index % kTableSize];
        // The bits of an index each add their own: exclusive or.
        for (const Bits* next = tables; index >= kTableSize;) {
            index /= kTableSize;
            next += kTableSize;
            for (size_t d = 0; d < 4; ++d) bits[d] ^= next[index % kTableSize][d];
        }
        glm::vec4 point;
        // The top 24 bits fit a float and stay below 1.
        for (int d = 0; d < 4; ++d) point[d] = float((bits[d] ^ shift[d]) >> 8) * 0x1p-24f;
        return point;
    }

  private:
    using Bits = std::array<uint32_t, 4>;
    // Tables one after the other: of the lowest bits of an index, of as many next ones, and so on.
    static constexpr uint32_t kTableBits = 8, kTableSize = 1 << kTableBits;
    static constexpr uint32_t kTables = 32 / kTableBits;
    static const Bits* allTables();

    Bits shift;
    const Bits* tables;
};

// A single point of a seed's.
inline glm::vec4 sobolPoint(uint32_t index, uint32_t seed) { return SobolPoints(seed)[index]; }

// A well-mixed hash, to make seeds from indices.
uint32_t hash(uint32_t a, uint32_t b);

}  // namespace raybundle
