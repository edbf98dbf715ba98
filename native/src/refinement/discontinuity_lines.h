// SPDX-License-Identifier: GPL-3.0-or-later
//
// Lines on faces across which the light of the sources jumps, as at the edges of hard shadows. If
// they are edges of a mesh, few triangles show a shadow that many small ones along its edge show
// worse.
//
// Sources: Heckbert, "Discontinuity Meshing for Radiosity" (1992); Lischinski, Tampieri and
// Greenberg, "Discontinuity Meshing for Accurate Radiosity" (1992).
// Differs:
// - They project the edges of all surfaces from each light. Here the lines are found in the light
//   itself, at the edges of a mesh that was refined where the light is not smooth: whatever gives
//   light or stops it, and however many surfaces there are, the cost follows the length of lines.
// - A line is a polygon through the points at which edges meet it, with as few corners as its
//   accuracy allows. Two long sides that a short one joins are prolonged to their intersection.
// - The soft edge of a shadow is no line if the refined mesh shows that it is soft.
#pragma once

#include <vector>

#include "job/progress.h"
#include "job/report.h"
#include "patches/refined_mesh.h"
#include "refinement/adapted_mesh.h"
#include "refinement/face_light.h"

namespace raybundle {

// Returns the lines on the faces of an instance. `adapted` is its mesh, which is refined. Adds
// shadow rays to the report.
std::vector<DiscontinuityLine> discontinuityLines(const KnownLight& known,
                                                  const AdaptedMesh& adapted,
                                                  const Progress& progress, Report& report);

}  // namespace raybundle
