// SPDX-License-Identifier: GPL-3.0-or-later
//
// What the two operators of stochastic iteration have in common, and whether that of bundles
// converges.
#pragma once

#include <memory>
#include <vector>

#include "transport/transport.h"

namespace raybundle {

// Share of the light that the first iterate in the mean may lack.
constexpr double kMissing = 1e-3;

// Largest channel of all reflectances.
double largestReflectance(const Patches& patches);

// Iterates until light that lacks all bounces lacks only the share `missing`, but at most `most`.
uint32_t warmUpIterates(double reflectance, double missing, uint32_t most);

// By what factor the mean square of the iterates' deviation grows from bundle to bundle; it
// converges below 1. `traced`: bundles to judge by, not all of them dark.
double meanSquareGrowth(const TransportInput& input, const std::vector<TracedBundle>& traced);

std::unique_ptr<Transport> singleRayIteration(const TransportInput& input);

}  // namespace raybundle
