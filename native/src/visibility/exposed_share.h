// SPDX-License-Identifier: GPL-3.0-or-later
//
// The exposed share of sides that are partly covered, measured at points spread over each side. The
// lines of bundles would give the share only with their noise. Light gathered over a whole side
// arrives on its exposed share only. An error of the share is therefore an error of the light
// there, and one that both halves of the bundles have in common.
//
// Source: none; the thesis has no surfaces that touch others.
#pragma once

#include <cstdint>
#include <vector>

#include "patches/clusters.h"
#include "visibility/visibility.h"

namespace raybundle {

// Returns for each of the given cluster sides the share of its area, 0 to 1, that no other surface
// touches. `visibility` must be that of the patches that form the clusters.
std::vector<float> exposedShareOf(const std::vector<uint32_t>& sides, const Visibility& visibility,
                                  const Clusters& clusters, uint32_t seed);

}  // namespace raybundle
