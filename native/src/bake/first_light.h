// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light that is shown before the patches are made. In a scene of many faces, the patches and
// the first shot take far longer than somebody wants to wait for the first light. Whole faces and
// one sample of each source at about one face per vertex take some hundred nanoseconds per face.
#pragma once

#include "bake/interim.h"
#include "job/settings.h"
#include "scene/scene.h"

namespace raybundle {

// Offers the first light of the sources to `interim`, unless no source lights anything. The light
// has noise, no reflections and, on translucent surfaces, nothing of the light from behind.
void offerFirstLight(const Scene& scene, const Settings& settings, Interim& interim);

}  // namespace raybundle
