// SPDX-License-Identifier: GPL-3.0-or-later
//
// Meshes that follow the light: the baked meshes with more vertices where the interpolation between
// vertices needs them, at the edges of shadows, at contacts and close to lamps, and nowhere else.
//
// Source: Dorfler, "A Convergent Adaptive Algorithm for Poisson's Equation" (1996): in each round
// the triangles are refined that together have a given share of the squared error.
// Differs:
// - The error of a triangle is not that of a solution but that of the interpolation
//   (refinement/adapted_mesh.h). The light is known from a bake of the meshes as they are.
// - The rounds end when the error of the scene is below the target, and that of each object below a
//   few targets, relative to its own light.
// - Where the light jumps along lines, a mesh that has these lines as edges is refined as well, until
//   it has as little error. It is used unless it has more than a tenth more vertices.
#pragma once

#include <vector>

#include "job/progress.h"
#include "job/report.h"
#include "patches/finer_mesh.h"
#include "refinement/face_light.h"

namespace raybundle {

// Returns the adapted mesh of each instance; empty for instances that are not baked. Objects whose
// stated error in the report is far below the target keep their meshes. All meshes together have at
// most Settings::maxVertices vertices, or those of the sources if these are more. Adds shadow rays
// and warnings to the report. `ranges` is per instance.
std::vector<FinerMesh> adaptMeshes(const KnownLight& known,
                                   const std::vector<InstanceRange>& ranges,
                                   const Progress& progress, Report& report);

}  // namespace raybundle
