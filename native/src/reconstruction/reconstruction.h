// SPDX-License-Identifier: GPL-3.0-or-later
//
// From patch sides to the corners of each mesh that is baked.
//
// LEAST_SQUARES: the corner values whose interpolation is nearest to the light on the faces
//   (reconstruction/least_squares.h).
// AREA_AVERAGE: the mean of the light on the faces around each corner
//   (reconstruction/area_average.h).
// POINT: the light at the corners themselves, as Cycles' bake has it. Light of the sources, which
//   changes within a face, is gathered at each corner, and the rest where it is not smooth;
//   elsewhere it is that of least squares (reconstruction/corner_gather.h). Corners that another
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

// Cells and parents are in the order of the instances.
std::vector<InstanceRange> instanceRanges(const Scene& scene, const Patches& patches);

// Light of every instance, by all lights and by each light set; of those that only occlude, empty.
// Adds the objects, warnings and skips to the report.
std::vector<InstanceLight> reconstruct(const ReconstructionInput& input, const Progress& progress,
                                       Report& report);

}  // namespace raybundle
