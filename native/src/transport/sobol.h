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
        const Bits bits = index < kTableSize ? table[index] : bitsOf(index);
        glm::vec4 point;
        // The top 24 bits fit a float and stay below 1.
        for (int d = 0; d < 4; ++d) point[d] = float((bits[d] ^ shift[d]) >> 8) * 0x1p-24f;
        return point;
    }

  private:
    using Bits = std::array<uint32_t, 4>;
    // Most points are taken from the beginning of the sequence.
    static constexpr uint32_t kTableSize = 1024;
    static const std::array<Bits, kTableSize>& firstPoints();
    static Bits bitsOf(uint32_t index);

    Bits shift;
    const Bits* table;  // of the first points
};

// A single point of a seed's.
inline glm::vec4 sobolPoint(uint32_t index, uint32_t seed) { return SobolPoints(seed)[index]; }

// A well-mixed hash, to make seeds from indices.
uint32_t hash(uint32_t a, uint32_t b);

}  // namespace raybundle
