// SPDX-License-Identifier: GPL-3.0-or-later
//
// AREA_AVERAGE: reconstruction from patch sides to the corners of the user's mesh by weighted
// means. The value at a node v (the value that the corners of a smooth region share) is the mean of
// the light on the patches p around it. Each patch is weighted by its area A_p and by the node's
// own weight w_v(p) in the interpolation over the faces (the hat function, which is 1 at the corner
// and 0 at the corners around it):
//
//   f_v = sum_p A_p w_v(p) H_p / sum_p A_p w_v(p)
//
// Source: Kavan, Bargteil and Sloan, "Least Squares Vertex Baking" (EGSR 2011), who compare their
// method with this average. It is the solution of their normal equations with the matrix lumped to
// its diagonal.
// Differs:
// - The data are means over patches, not point samples.
// - The parts of patches that another surface covers do not count.
//
// The average never overshoots and needs no solve, but it blurs. Light that is linear over the
// surface becomes flatter at the border of the mesh and at sharp edges, because the region lies on
// only one side of the corner there.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/lit_surfaces.h"
#include "reconstruction/instance_side.h"
#include "reconstruction/least_squares.h"

namespace raybundle {

// Reconstructs several fields of light on one side of an instance. Each of the `fields` is per
// patch side. Returns for each field a value per node of `surface.regions`, in the unit of the
// field. A node without patches has the value 0.
std::vector<std::vector<glm::vec3>> areaAverage(
    const LitSurfaces& surfaces, const InstanceSide& surface,
    const std::vector<const std::vector<glm::vec3>*>& fields);

}  // namespace raybundle
