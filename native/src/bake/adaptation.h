// SPDX-License-Identifier: GPL-3.0-or-later
//
// The two passes of a bake whose meshes follow the light: a scene of the adapted meshes for the
// second pass, and what the caller sees of it.
#pragma once

#include <vector>

#include "job/progress.h"
#include "job/report.h"
#include "patches/finer_mesh.h"
#include "reconstruction/instance_light.h"
#include "scene/scene.h"

namespace raybundle {

// Returns whether any adapted mesh is finer than the mesh of its instance. `adapted` is per
// instance.
bool areAnyFiner(const Scene& scene, const std::vector<FinerMesh>& adapted);

// Returns the scene with the adapted meshes of its instances. Instances whose adapted mesh is not
// finer keep their mesh. `adapted` is per instance.
Scene adaptedScene(const Scene& scene, const std::vector<FinerMesh>& adapted);

// Returns the light at the corners of the source meshes, of light at the corners of the adapted
// meshes. Both are per instance.
std::vector<InstanceLight> atSources(const std::vector<InstanceLight>& light,
                                     const std::vector<FinerMesh>& adapted);

// Reports the stages of the first pass as one stage, the patches of the second. Stages of a pass
// take turns; the share that is reported never falls.
class FirstPassProgress {
  public:
    // `callers` must outlive the object.
    explicit FirstPassProgress(const Progress& callers) : callers(callers) {}
    // Returns the progress to which the first pass reports. The object must outlive it.
    Progress progress();

  private:
    const Progress& callers;
    double most = 0;  // share that was reported, 0 to 1
};

// Adds the times, the rays, the vertices and the limit of the first pass to the report of the
// second.
void addFirstPass(const Report& first, Report& second);

}  // namespace raybundle
