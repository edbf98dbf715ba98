// SPDX-License-Identifier: GPL-3.0-or-later
//
// The stage of the first shot: distributes the light of the sources of each light set once. The
// result is kept for the next bake, which uses it if lights and geometry are unchanged.
#pragma once

#include <vector>

#include "bake/trace.h"
#include "direct_light/direct_light.h"
#include "job/report.h"
#include "reconstruction/shown_light.h"
#include "transport/set_light.h"

namespace raybundle {

// Gathers light with a few shadow rays from each tile, from which worthwhileCuts() decides which
// tiles are worth cutting. Sides whose light is not shown get that of a stand-in. Returns the light
// of the sources that belong to no light set, then that of each light set. Adds its time to the
// report.
std::vector<CoarseShot> shootCoarsely(const StageInput& in, Report& report);

// Returns the first shot of the sources that belong to no light set, then that of each light set.
// `coarse` is the result of shootCoarsely(), from which the shots start; if it is empty, they make
// their own coarse shots. Adds the time, the number of rays and the skipped work to the report.
SetLights shootSources(const StageInput& in, const ShownLight& shown,
                       const std::vector<CoarseShot>& coarse, Report& report);

}  // namespace raybundle
