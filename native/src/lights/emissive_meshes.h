// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which emissive faces make a light source together: those of one object, material and connected
// surface, fronts and backs apart.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "lights/light_source.h"

namespace raybundle {

// The emissive faces of sides that are marked, whose emission per side of all patches (W/m^2 of the
// whole patch, 0 where not marked) is given; directed: what they send towards a direction more than
// that, or less; null: nothing. All that is passed must outlive them.
std::vector<std::unique_ptr<LightSource>> meshSources(const Scene& scene, const Patches& patches,
                                                      const std::vector<bool>& gatheredSides,
                                                      const std::vector<glm::vec3>& emission,
                                                      const DirectedEmission* directed);

}  // namespace raybundle
