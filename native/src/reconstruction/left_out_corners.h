// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light at the corners of faces without patches. A doubled face (patches/doubled_faces.h) gets
// the light of the face that stands for it. A face without area gets the mean of the other corners
// at each of its vertices, so that it does not change a mean over the corners of a vertex.
#pragma once

#include <vector>

#include "job/report.h"
#include "patches/patches.h"
#include "reconstruction/instance_light.h"
#include "reconstruction/least_squares.h"

namespace raybundle {

// Sets the light and the error at all corners of faces without patches. If an object has no patches
// because its faces are doubled ones, also sets its stated error in `report`. `ranges`, `light` and
// Report::objects are per instance.
void fillLeftOutCorners(const Patches& patches, const std::vector<InstanceRange>& ranges,
                        std::vector<InstanceLight>& light, Report& report);

}  // namespace raybundle
