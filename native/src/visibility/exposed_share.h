// SPDX-License-Identifier: GPL-3.0-or-later
//
// The exposed share of sides that are covered in part: by points spread over them, as the lines of
// bundles tell it only to their noise. Light that is gathered over a whole side arrives on that
// share of it, so that an error of the share is one of the light there, and one that both halves of
// the bundles have in common.
//
// Source: none; the thesis has no surfaces that lie against others.
#pragma once

#include <cstdint>
#include <vector>

#include "patches/clusters.h"
#include "visibility/visibility.h"

namespace raybundle {

// Of each of some sides of the clusters, the share that touches no other surface, 0 to 1.
// visibility: of the patches that the clusters are made of.
std::vector<float> exposedShareOf(const std::vector<uint32_t>& sides, const Visibility& visibility,
                                  const Clusters& clusters, uint32_t seed);

}  // namespace raybundle
