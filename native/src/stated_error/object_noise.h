// SPDX-License-Identifier: GPL-3.0-or-later
//
// The noise at corners, where the result is shown: the noise of each object, and of the whole
// scene.
//
// Source: none. The noise of the means over cells (stated_error/noise.h) is summed up by object.
// - The noise at corners is measured by fitting least squares to the light of each half, as they
//   will be fitted to the whole light. Half of the difference at a corner is one sample of its
//   noise. From cell to cell these samples vary by chance, so only their sum over an object is
//   used. The noise of the cells' means determines how it is distributed over the object.
// - Corner values whose interpolation is nearest to the light have a larger variance than the means
//   over cells, as far as the noise within cells is random. In a grid, with one corner per cell,
//   the variance is 3 times as large (the diagonal of the inverse of the mass matrix of the hat
//   functions). On a single quad, with four corners, it is 16 times as large.
// - The noise of an object with few cells is stated higher, because few samples may be small by
//   chance.
#pragma once

#include <array>
#include <vector>

#include "patches/lit_surfaces.h"
#include "scene/scene.h"
#include "stated_error/noise.h"

namespace raybundle {

// An object whose RMS light is below this share of the scene's RMS light is judged as if it had
// this much light.
constexpr double kNearlyBlack = 0.01;

// Returns per instance the ratio of the variance at corners to that of the means over cells, for
// noise that is random within cells. It is larger the more corners a cell has. Instances that are
// not baked have the ratio of a grid, 3, and those for which `isGathered` is true
// (ShownLight::instancesAllGathered) a ratio of 1.
std::vector<double> cornerGrowth(const Scene& scene, const Patches& patches,
                                 const std::vector<bool>& isGathered);

// Returns the squared noise of bundles at the corners of a cell, as predicted from the noise of the
// cell's mean at the last look, summed over RGB, (W/m^2)^2. `growth` is the value of cornerGrowth()
// for the cell's instance.
double bundlesAtCorners(const Noise::OfCell& cell, double growth);

// The value that ShownNoise::overForetold usually has.
constexpr double kUsuallyOverForetold = 2;

// The noise of bundles at corners, measured with fits to both halves.
struct ShownNoise {
    // Per instance, the ratio of the squared noise at its corners to the prediction of
    // bundlesAtCorners(). For instances with few cells, or without a measurement, the ratio is near
    // or equal to kUsuallyOverForetold.
    std::vector<double> overForetold;
    // Indexed like Noise::cells(): the mean squared noise at the corners of the cell, summed over
    // RGB, (W/m^2)^2. Negative where it was not measured.
    std::vector<double> ofCells;
};

// Measures the noise at corners. `tiles` are the tiles and their exposed shares. `halves` are those
// of the last look of `noise`, per side of the tiles, W/m^2. For `regularization` see
// leastSquares(); `growth` is the result of cornerGrowth(). Instances for which `isGathered` is
// true are not measured, because their corners show other light than that of the patches; they have
// the noise that is foretold.
ShownNoise shownNoise(const Scene& scene, const LitSurfaces& tiles, const Noise& noise,
                      const LightOfHalves& halves, float regularization,
                      const std::vector<double>& growth, const std::vector<bool>& isGathered);

// The noise at corners relative to the RMS of the light, with the noise of the first shot.
struct CornerNoise {
    // Of the whole scene, with the error that both halves share.
    double ofAll = 0;
    // Per instance. The light of an instance is taken to be at least kNearlyBlack times that of the
    // scene.
    std::vector<double> ofObjects;
};

// Returns the stated noise at the corners at the last look of `noise`. `tiles` are the patches of
// whose cells `noise` was measured. `growth` is the result of cornerGrowth(), and `shown` is
// ShownNoise::overForetold.
CornerNoise noiseAtCorners(const Scene& scene, const Patches& tiles, const Noise& noise,
                           const std::vector<double>& growth, const std::vector<double>& shown);

}  // namespace raybundle
