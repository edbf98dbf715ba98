// SPDX-License-Identifier: GPL-3.0-or-later
//
// Directions of bundles. Sources: thesis sections 4.2.1 (uniform random) and 7.3.1 (quasi-Monte
// Carlo); the low-discrepancy sequence is R2 (Roberts, "The Unreasonable Effectiveness of
// Quasirandom Sequences", 2018).
// Differs:
// - The sequence covers a hemisphere, since a line serves both ways, and is turned by a random
//   rotation: each direction is then uniform, so any number of bundles is unbiased, and two
//   independent halves give an error estimate.
// - Spherical Fibonacci sets (Marques et al., 2013) are better for one fixed number of bundles. As
//   a union of sets made while the number doubles they are not: on cornell_box (3 seeds) the noise
//   of 64, 128, 256, 512 bundles was 3.5, 2.4, 1.6, 1.04 % against 4.8, 2.4, 1.6, 0.94 % for R2,
//   which also serves any number in between.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

enum class DirectionKind { LOW_DISCREPANCY, RANDOM };

// One bundle: all lines along `direction`. The orthonormal frame (right, up, direction) carries the
// random roll; shift in [0, 1)^2 moves the pixel grid, in pixels.
struct Bundle {
    glm::dvec3 right, up, direction;
    glm::dvec2 shift;
    uint32_t half;  // 0 or 1: of the two independent sets, for the error estimate
};

// The bundles first .. first + count - 1 of an endless sequence given by the seed; first and count
// are even, and half of the bundles belong to each half.
std::vector<Bundle> bundles(DirectionKind kind, uint32_t seed, uint32_t first, uint32_t count);

}  // namespace raybundle
