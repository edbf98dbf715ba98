// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "job/settings.h"
#include "patches/patches.h"
#include "reconstruction/shown_light.h"
#include "scene/scene.h"
#include "transport/set_light.h"
#include "visibility/visibility.h"

namespace raybundle {

// What reconstructions are made of. References must outlive them.
struct ReconstructionInput {
    const Scene& scene;
    const Patches& patches;
    const Visibility& visibility;
    const float touchDistance;  // surfaces not further apart touch, metres
    const SetLights& lights;
    const ShownLight& shown;
    const std::vector<float>& exposed;  // per side: the share of it that nothing covers
    const Settings& settings;
};

}  // namespace raybundle
