// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "job/settings.h"
#include "patches/clusters.h"
#include "patches/lit_surfaces.h"
#include "reconstruction/shown_light.h"
#include "scene/scene.h"
#include "transport/set_light.h"
#include "visibility/visibility.h"

namespace raybundle {

// The input of a reconstruction. The inherited `exposed` is per patch side. References must outlive
// the object.
struct ReconstructionInput : LitSurfaces {
    const Scene& scene;
    const Visibility& visibility;
    const Clusters& clusters;  // of the patches, between which light was exchanged
    const SetLights& lights;
    const ShownLight& shown;
    const Settings& settings;
};

}  // namespace raybundle
