// SPDX-License-Identifier: GPL-3.0-or-later
//
// Groups emissive faces into light sources. A source consists of the faces of one object, material
// and connected surface. Fronts and backs are separate sources.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "lights/light_source.h"

namespace raybundle {

// Returns the light sources of the sides that `sourceSides` marks. `emission` is per side of all
// patches, averaged over the whole patch, W/m^2, and 0 for sides that are not marked. `directed`
// adds the dependence of the emission on the direction; null if there is none. All arguments must
// outlive the sources, except `sourceSides`.
LightSources meshSources(const Scene& scene, const Patches& patches,
                         const std::vector<bool>& sourceSides,
                         const std::vector<glm::vec3>& emission, const DirectedEmission* directed);

}  // namespace raybundle
