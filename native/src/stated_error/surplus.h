// SPDX-License-Identifier: GPL-3.0-or-later
//
// The surplus: what the light on a surface has beyond the best linear function on each patch,
// estimated from the light of the patches around.
//
// Sources: the gradient recovery and the gradient jumps are those of a posteriori error estimates
// for finite elements (Zienkiewicz and Zhu, "A Simple Error Estimator and Adaptive Procedure for
// Practical Engineering Analysis", 1987).
// - A patch's gradient is that of the linear function nearest to its neighbours' light.
// - Where light is smooth the change of the gradient from patch to patch gives the second
//   derivatives u, and these the distance from the best linear function on a rectangle with edges
//   a, b:  sqrt(((u_aa a^2)^2 + (u_bb b^2)^2) / 720 + (u_ab a b)^2 / 144).
// - At a shadow's edge nothing is smooth: there the difference of two neighbours is not what their
//   gradients foretell. What the square of that is beyond the square of the gradients' change,
//   which bent but smooth light stays below, counts: for a step at a random place along a row of
//   patches the mean square distance from the linear functions with the recovered gradients is
//   17/144 of the step's square, and what counts has the mean 0.0933 of it.
// - Where the surface bends by an angle from patch to patch the neighbours face other directions,
//   and their light says less about that within a patch: a facet of a sphere that is evenly lit has
//   a gradient, and its neighbours' light is the same. Light from one direction changes by its own
//   size per radian (RMS over directions), light from everywhere not at all: half of that is taken.
// Only light of the sources has such steps, and its noise, which is known, looks alike: it is
// taken out in the mean.
#pragma once

#include <cstdint>
#include <vector>

#include "patches/lit_surfaces.h"
#include "scene/scene.h"
#include "transport/transport.h"

namespace raybundle {

// Mean squares over a patch, summed over RGB, (W/m^2)^2.
struct Surplus {
    bool isKnown = false;  // whether there are enough patches around
    float smooth = 0;      // falls with the fourth power of the patch's edge
    float step = 0;        // falls with the edge; below 0 by chance, where noise was taken out
};

// Of the patches of parents [firstParent, lastParent), in their order, for one of their sides.
// directError: per side, standard error of the light of the sources, W/m^2.
std::vector<Surplus> surplusOf(const LitSurfaces& surfaces, uint32_t firstParent,
                               uint32_t lastParent, rb_side side, const Irradiance& irradiance,
                               const std::vector<float>& directError);

}  // namespace raybundle
