// SPDX-License-Identifier: GPL-3.0-or-later
//
// The corners of faces that have no patches: of doubled faces (patches/doubled_faces.h), which get
// the light of those that stand for them, and of faces without area, which get the mean of the
// other corners at their vertex, so that they change nothing in a mean over it.
#pragma once

#include <vector>

#include "job/report.h"
#include "patches/patches.h"
#include "reconstruction/instance_light.h"
#include "reconstruction/least_squares.h"

namespace raybundle {

// ranges: of the parents of each instance. Sets the light and the errors of such corners, and the
// stated error of objects of which they are all.
void fillLeftOutCorners(const Patches& patches, const std::vector<InstanceRange>& ranges,
                        std::vector<InstanceLight>& light, Report& report);

}  // namespace raybundle
