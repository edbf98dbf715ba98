// SPDX-License-Identifier: GPL-3.0-or-later
//
// The stated error of the result, in three parts, per object and in all:
// - noise: of the light on the patches, from finitely many bundles and shadow rays
//   (stated_error/noise.h);
// - discretisation: what light has beyond the best linear function on each patch, which nothing
//   that is made of the patches can show (stated_error/surplus.h);
// - mesh: how far the interpolation between the corners is from the light of the patches, which is
//   what a finer mesh would mend.
// Together they stand for the surface error: the distance of the interpolated result from the light
// at all points of the faces.
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

// What is known about the light on the sides of the tiles; references must outlive it.
struct SideErrors {
    const Irradiance& irradiance;           // mean over each side
    const std::vector<float>& exposed;      // share of each side that nothing covers
    const std::vector<glm::vec3>& noise;    // a sample of that of the bundles, W/m^2; empty: none
    const std::vector<float>& directError;  // standard error of the sources' light, W/m^2
    const std::vector<double>& ofObjects;   // per instance: noise at corners, relative
    bool isOutOfReach = false;              // see SideNoise
};

// Adds the errors, and warnings of objects whose mesh is too coarse, to the report, and the error
// per corner to the light. report.error.noise is the shown noise in all. ranges: of the patches.
// Where the directions of bundles are independent, all objects get too much light together, or too
// little: what the halves tell of one object is a single sample then, and none has less noise than
// all together. Sparse results that are gathered are the light of points
// (InstanceLight::gatheredNoise), whose error is noise alone.
void stateErrors(const Scene& scene, const Tiles& tiles, const std::vector<InstanceRange>& ranges,
                 const SideErrors& sides, const Settings& settings,
                 std::vector<InstanceLight>& light, Report& report);

}  // namespace raybundle
