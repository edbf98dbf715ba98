// SPDX-License-Identifier: GPL-3.0-or-later
//
// The noise at corners, which is what is shown: that of each object, and of the whole scene.
//
// Source: none; what the halves tell of the cells' means (stated_error/noise.h), by object.
// - What corners show is measured: least squares are fitted to the light of each half as they will
//   be to all of it. Half of the difference is one sample of the noise at each corner; from cell to
//   cell it differs by chance, so that of it only the whole object's is taken, and what the means
//   of cells foretell says how that is spread.
// - Values at corners whose interpolation is nearest to the light have more variance than the means
//   of cells, as far as that is random within these: 3 times in a grid, where there is one corner a
//   cell (the diagonal of the inverse of the hat functions' mass matrix), and 16 times on a quad by
//   itself, which has four of them.
// - Few cells are few samples: their noise is stated higher, by the chance that they agree.
#pragma once

#include <array>
#include <vector>

#include "patches/lit_surfaces.h"
#include "scene/scene.h"
#include "stated_error/noise.h"

namespace raybundle {

// An object that is darker than this share of the scene's RMS light counts as that.
constexpr double kNearlyBlack = 0.01;

// Per instance: how much the variance grows from the means of cells to corners, as far as it is
// random within them.
std::vector<double> cornerGrowth(const Scene& scene, const Patches& patches);

// Squares of the noise of bundles at the corners of a cell, as its mean foretells them: of the last
// look. growth: of its instance.
double bundlesAtCorners(const Noise::OfCell& cell, double growth);

// What is usual of shownOverForetold.
constexpr double kUsuallyOverForetold = 2;

// Per instance: squares of the noise of bundles that its corners show, over what bundlesAtCorners
// foretells of them. halves: per side of the tiles, of the noise's last look, W/m^2;
// regularization: see leastSquares. Of few cells it is near what is usual.
std::vector<double> shownOverForetold(const Scene& scene, const LitSurfaces& tiles,
                                      const Noise& noise, const std::array<Irradiance, 2>& halves,
                                      float regularization, const std::vector<double>& growth);

// Relative to the RMS of the light, that of the first shot included.
struct CornerNoise {
    double ofAll = 0;
    // Per instance; its light is taken to be kNearlyBlack of the scene's at least.
    std::vector<double> ofObjects;
};

// tiles: whose cells these are; growth, shown: per instance, see above.
CornerNoise noiseAtCorners(const Scene& scene, const Patches& tiles, const Noise& noise,
                           const std::vector<double>& growth, const std::vector<double>& shown);

}  // namespace raybundle
