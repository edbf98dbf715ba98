// SPDX-License-Identifier: GPL-3.0-or-later
//
// LEAST_SQUARES: reconstruction from patch sides to the corners of the user's mesh by a
// least-squares fit. The corner values f are those whose linear interpolation over the faces has
// means over the patches p (area A_p) that are nearest to the light H_p that transport found:
//
//   minimise  sum_p A_p (mean_p(f) - H_p)^2  +  alpha sum_e area_e height_e^2 (slope change at e)^2
//
// The second sum, over the edges e inside smooth regions, is the regularisation.
//
// Source: Kavan, Bargteil and Sloan, "Least Squares Vertex Baking" (EGSR 2011). The regularisation,
// which does not change linear light, is theirs too.
// Differs:
// - The data are means over patches, not point samples, so that linear light is reproduced exactly
//   up to the border of the mesh.
// - A term for the twist of quads replaces their diagonal.
// - The parts of patches that another surface covers, which nobody sees, do not count. Contacts are
//   therefore neither dark nor do they leak light.
// - Values stay within the range of the light around them, by fluxes that keep the mean
//   (reconstruction/fit_terms.h): no wall near a lamp gets more light than arrives there.
// - The slope change is multiplied by the harmonic mean of the heights of both faces, not divided
//   by each height. Faces almost without height then do not make the matrix unsolvable.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/lit_surfaces.h"
#include "reconstruction/corner_weights.h"
#include "reconstruction/instance_side.h"
#include "scene/scene.h"

namespace raybundle {

// The exposed share is taken to be at least this value, so that a node has a value even if all its
// patches are covered.
constexpr float kLeastExposure = 1e-5f;

// Relative residuals at which a fit differs from the exact one by its rounding only, and by less
// than the noise of a draft.
constexpr double kExactFit = 1e-6, kDraftFit = 5e-4;

// The result of leastSquares().
struct LeastSquaresFit {
    std::vector<std::vector<glm::vec3>> fields;  // per field and node, not negative
    // False if the iteration did not converge. The channels concerned then have the area-weighted
    // means at the nodes.
    bool isSolved = true;
};

// Reconstructs several fields of light on one side of an instance. `surfaces.exposed` holds the
// share of each patch side that counts, 0 to 1. `regularization` is the weight alpha of the
// regularisation, without unit. Each of the `fields` is per patch side; the result is in the unit
// of the field. The iteration ends at the relative residual `tolerance`. Throws Error(CANCELLED) if
// the bake is cancelled.
LeastSquaresFit leastSquares(const LitSurfaces& surfaces, const InstanceSide& surface,
                             float regularization,
                             const std::vector<const std::vector<glm::vec3>*>& fields,
                             double tolerance = kExactFit);

}  // namespace raybundle
