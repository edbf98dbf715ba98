// SPDX-License-Identifier: GPL-3.0-or-later
//
// AREA_AVERAGE: from patch sides to the corners of the user's mesh. A corner's value is the mean of
// the light on its smooth region around it, weighted by area and by the corner's own share in the
// interpolation over the faces (the hat function, 1 at the corner and 0 at those around it):
//
//   f_v = sum_p A_p w_v(p) H_p / sum_p A_p w_v(p)
//
// Source: Kavan, Bargteil and Sloan, "Least Squares Vertex Baking" (EGSR 2011), who compare with
// this average; it is their normal equations with the matrix lumped to its diagonal.
// Differs:
// - The data are means over patches, not point samples.
// - Shares of patches that lie against another surface do not count.
//
// It never overshoots and needs no solve, but blurs: light that is linear over the surface comes
// out flatter at the mesh's border and at sharp edges, where the region lies on one side only.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/lit_surfaces.h"
#include "reconstruction/instance_side.h"
#include "reconstruction/least_squares.h"

namespace raybundle {

// Arguments and result as in leastSquares.
std::vector<std::vector<glm::vec3>> areaAverage(
    const LitSurfaces& surfaces, const InstanceSide& surface,
    const std::vector<const std::vector<glm::vec3>*>& fields);

}  // namespace raybundle
