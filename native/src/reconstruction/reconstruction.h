// SPDX-License-Identifier: GPL-3.0-or-later
//
// Reconstruction: from the light on patch sides to the light at the corners of each mesh that is
// baked. The setting `reconstruction` selects one of the methods:
//
// LEAST_SQUARES: the corner values whose interpolation is nearest to the light on the faces
//   (reconstruction/least_squares.h).
// AREA_AVERAGE: the mean of the light on the faces around each corner
//   (reconstruction/area_average.h).
// POINT: the light at the corners themselves, as in Cycles' bake. The light of the sources, which
//   changes within a face, is gathered at each corner. The rest is gathered where it is not smooth,
//   and is that of least squares elsewhere (reconstruction/corner_gather.h). Corners that another
//   surface covers, where no light arrives, keep the value of least squares.
#pragma once

#include <vector>

#include "job/progress.h"
#include "job/report.h"
#include "patches/patches.h"
#include "reconstruction/corner_weights.h"
#include "reconstruction/instance_light.h"
#include "reconstruction/reconstruction_input.h"
#include "scene/scene.h"

namespace raybundle {

// Returns the ranges of cells and parents of each instance. Patches::cells and Patches::parents
// must be in the order of the instances.
std::vector<InstanceRange> instanceRanges(const Scene& scene, const Patches& patches);

// Returns the light of every instance of the scene, by all sources and by each light set. Occluders
// have no light if the setting `skipOccluders` is on. Adds the objects, warnings and skips to the
// report. Throws Error(CANCELLED) if the bake is cancelled.
std::vector<InstanceLight> reconstruct(const ReconstructionInput& input, const Progress& progress,
                                       Report& report);

}  // namespace raybundle
