// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light at corners while a bake still runs: area averages (area_average.h) of the light that
// sides have so far. It is meant to be looked at, takes a few nanoseconds per corner, and leaves
// out what the final reconstruction adds: least squares, light gathered at corners, light sets and
// the corners of faces that are left out.
#pragma once

#include <vector>

#include "patches/lit_surfaces.h"
#include "reconstruction/instance_light.h"
#include "reconstruction/shown_light.h"
#include "scene/scene.h"
#include "transport/transport.h"

namespace raybundle {

// Returns the light per instance of the scene. `light` is per patch side, the irradiance that sides
// show (ShownLight::of), W/m^2.
std::vector<InstanceLight> interimLight(const Scene& scene, const LitSurfaces& surfaces,
                                        const ShownLight& shown, const Irradiance& light);

}  // namespace raybundle
