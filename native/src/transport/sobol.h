// SPDX-License-Identifier: GPL-3.0-or-later
//
// The first four dimensions of the Sobol sequence (direction numbers of Joe and Kuo, 2008),
// randomised by a digital shift (Kollig and Keller, "Efficient Multidimensional Sampling", 2002).
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace raybundle {

// Point `index` in [0, 1)^4 of the set with the given seed. Any 2^k consecutive points from a
// multiple of 2^k on are stratified.
glm::vec4 sobolPoint(uint32_t index, uint32_t seed);

// A well-mixed hash, to make seeds from indices.
uint32_t hash(uint32_t a, uint32_t b);

}  // namespace raybundle
