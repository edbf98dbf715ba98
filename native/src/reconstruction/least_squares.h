// SPDX-License-Identifier: GPL-3.0-or-later
//
// LEAST_SQUARES: from patch sides to the corners of the user's mesh. The corner values are those
// whose linear interpolation over the faces has, patch by patch, the mean that transport found:
//
//   minimise  sum_p A_p (mean_p(f) - H_p)^2  +  alpha sum_e area_e height_e^2 (slope change at e)^2
//
// Source: Kavan, Bargteil and Sloan, "Least Squares Vertex Baking" (EGSR 2011), also for the
// regulariser, which leaves linear light alone.
// Differs:
// - The data are means over patches, not point samples, so that light that is linear comes out
//   exactly up to the mesh's border.
// - A twist term for quads takes the place of their diagonal.
// - Shares of patches that lie against another surface, which nobody sees, do not count, so that
//   contacts are neither dark nor leaking.
// - Values keep to the range of the light around them, by fluxes that keep the mean
//   (reconstruction/fit_terms.h): no wall near a lamp gets more than arrives there.
// - The slope change is taken times the harmonic mean of the heights of both faces, not divided by
//   each, so that faces almost without height make no matrix that cannot be solved.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/lit_surfaces.h"
#include "reconstruction/corner_weights.h"
#include "reconstruction/instance_side.h"
#include "scene/scene.h"

namespace raybundle {

// Weight that even a wholly covered patch keeps, so that every node has a value.
constexpr float kLeastExposure = 1e-5f;

struct LeastSquaresFit {
    std::vector<std::vector<glm::vec3>> fields;  // each per node of the regions, none negative
    // Else the iteration came to no solution, and what it was for has the means at the nodes.
    bool isSolved = true;
};

// exposed: per side, the share of it that counts. Reconstructs several fields (each per side) on
// one side of an instance.
LeastSquaresFit leastSquares(const LitSurfaces& surfaces, const InstanceSide& surface,
                             float regularization,
                             const std::vector<const std::vector<glm::vec3>*>& fields);

}  // namespace raybundle
