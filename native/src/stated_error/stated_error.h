// SPDX-License-Identifier: GPL-3.0-or-later
//
// The stated error of the result, per object and for the whole scene, in three parts:
// - noise: the random error of the light on the patches, from finitely many bundles and shadow rays
//   (stated_error/noise.h);
// - discretisation: the difference between the light and the best linear function on each patch,
//   which no result made of the patches can show (stated_error/surplus.h);
// - mesh: the difference between the interpolation over the corners and the light of the patches,
//   which a finer mesh would remove. Where corners have gathered their light on dense surfaces, it
//   is estimated from this light (stated_error/dense_surplus.h).
// Together they estimate the surface error: the difference between the interpolated result and the
// true light, at all points of the faces.
#pragma once

#include <vector>

#include "job/report.h"
#include "job/settings.h"
#include "patches/tiles.h"
#include "reconstruction/instance_light.h"
#include "reconstruction/least_squares.h"
#include "scene/scene.h"
#include "transport/transport.h"

namespace raybundle {

// What is known about the light on the sides of the tiles. All arrays except `ofObjects` are per
// side of the tiles. References must outlive the object.
struct SideErrors {
    const Irradiance& irradiance;           // mean over each side, W/m^2
    const std::vector<float>& exposed;      // share of each side that nothing covers
    const std::vector<glm::vec3>& noise;    // sample of that of bundles, W/m^2; empty if none
    const std::vector<float>& directError;  // standard error of the sources' light, W/m^2
    const std::vector<double>& ofObjects;   // relative noise at corners, per instance
    const std::vector<bool>& isGathered;    // see ShownLight::isGathered
    bool isOutOfReach = false;              // see SideNoise
};

// Adds the stated errors, and warnings of objects that are noisy or whose mesh is too coarse, to
// the report, and sets InstanceLight::error at each corner. On entry, report.error.noise must be
// the relative noise at all corners of the scene, and report.estimatedError that of the patch
// sides. `ranges` and `light` are per instance; the ranges refer to the tiles.
// If the directions of bundles are independent, the errors of all objects are correlated: all get
// too much light, or all too little. The halves then give only a single sample, and no object is
// stated to have less noise than the whole scene.
// Results that corners gathered (InstanceLight::gatheredNoise) are the light at points. Their
// errors are noise, that of the mesh, and, where light was interpolated between places that gather,
// the error of this interpolation (InstanceLight::gatheredSurplus), which counts as discretisation.
void stateErrors(const Scene& scene, const Tiles& tiles, const std::vector<InstanceRange>& ranges,
                 const SideErrors& sides, const Settings& settings,
                 std::vector<InstanceLight>& light, Report& report);

}  // namespace raybundle
