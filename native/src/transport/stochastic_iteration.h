// SPDX-License-Identifier: GPL-3.0-or-later
//
// Declarations that the two operators of stochastic iteration share, and the test whether the
// iteration by bundles converges.
#pragma once

#include <memory>
#include <vector>

#include "transport/transport.h"

namespace raybundle {

// Share of the light that the first iterate in the mean may lack.
constexpr double kMissing = 1e-3;

// Returns the largest channel of the reflectances of all sides.
double largestReflectance(const Patches& patches);

// Returns the number of iterates that are left out of the mean: as many as it takes until the
// bounces that an iterate lacks are at most `missing` of the light, but at most `most`.
// `reflectance` is that of all surfaces, below 1.
uint32_t warmUpIterates(double reflectance, double missing, uint32_t most);

// Returns the factor by which the mean square of the deviation of the iterates grows from bundle to
// bundle. The iteration converges if it is below 1. The form factors are estimated from the bundles
// in `traced`, some lines of which must carry light.
double meanSquareGrowth(const TransportInput& input, const std::vector<TracedBundle>& traced);

// Returns the transport of stochastic iteration with single rays.
std::unique_ptr<Transport> singleRayIteration(const TransportInput& input);

}  // namespace raybundle
