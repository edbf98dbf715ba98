// SPDX-License-Identifier: GPL-3.0-or-later
//
// The stage in which the sources shine: the first shot of each light set, kept from bake to bake
// where lights and geometry stay the same.
#pragma once

#include <vector>

#include "bake/trace.h"
#include "direct_light/direct_light.h"
#include "job/report.h"
#include "reconstruction/shown_light.h"
#include "transport/set_light.h"

namespace raybundle {

// A few shadow rays from each tile, of what belongs to no light set and then of each set. It tells
// which patches are worth cutting. Adds its time to the report.
std::vector<CoarseShot> shootCoarsely(const StageInput& in, Report& report);

// The first shot of what belongs to no light set and then of each set. coarse: what shootCoarsely
// has found, for the shots to go on with; empty: they make their own. Adds its time, its rays and
// what it skipped to the report.
SetLights shootSources(const StageInput& in, const ShownLight& shown,
                       const std::vector<CoarseShot>& coarse, Report& report);

}  // namespace raybundle
