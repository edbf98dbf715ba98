// SPDX-License-Identifier: GPL-3.0-or-later
//
// The surplus: the difference between the light on a surface and the best linear function on each
// patch, estimated from the light of the surrounding patches.
//
// Sources: the recovery of gradients and their jumps are those of a posteriori error estimates for
// finite elements (Zienkiewicz and Zhu, "A Simple Error Estimator and Adaptive Procedure for
// Practical Engineering Analysis", 1987).
// - The gradient of a patch is that of the linear function nearest to the light of its neighbours.
// - Where light is smooth, the change of the gradient from patch to patch gives the second
//   derivatives u. On a rectangle with edges a and b, the RMS difference from the best linear
//   function is then
//     sqrt(((u_aa a^2)^2 + (u_bb b^2)^2) / 720 + (u_ab a b)^2 / 144).
// - At the edge of a shadow, light is not smooth: the difference between two neighbours deviates
//   from what their gradients predict. The square of this deviation counts as far as it exceeds the
//   square of the change of the gradients, which it does not exceed where light is curved but
//   smooth. For a step at a random place along a row of patches, the mean square difference from
//   the linear functions with the recovered gradients is 17/144 of the square of the step. What
//   counts has a mean of 0.0933 of this square.
// - Where the surface bends by an angle from patch to patch, neighbours face other directions, and
//   their light says less about the light within a patch. On a facet of a sphere in even light the
//   light has a gradient although its neighbours have the same light. Per radian, light from a
//   single direction changes by its own amount (RMS over directions), and light from everywhere
//   does not change. Half of the former is assumed.
// Only light of the sources has such steps. Its noise, which is known, has the same effect as steps
// and is subtracted in the mean.
#pragma once

#include <cstdint>
#include <vector>

#include "patches/lit_surfaces.h"
#include "scene/scene.h"
#include "transport/transport.h"

namespace raybundle {

// The surplus of a patch: mean squares over the patch, summed over RGB, (W/m^2)^2.
struct Surplus {
    bool isKnown = false;  // whether there are enough patches around
    float smooth = 0;      // falls with the fourth power of the patch's edge
    float step = 0;        // falls with the edge; may be negative, as noise is subtracted
};

// Returns the surplus of the patches of the parents [firstParent, lastParent), in their order, on
// one side of each patch. `irradiance` is per patch side, W/m^2. `directError` is per patch side
// the standard error of the light of the sources, W/m^2. Empty if there are no parents.
std::vector<Surplus> surplusOf(const LitSurfaces& surfaces, uint32_t firstParent,
                               uint32_t lastParent, rb_side side, const Irradiance& irradiance,
                               const std::vector<float>& directError);

}  // namespace raybundle
