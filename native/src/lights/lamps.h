// SPDX-License-Identifier: GPL-3.0-or-later
//
// Constructors of the light sources for Blender's lamps. Each kind of lamp has its own source file
// and a case in lampSource (lights/light_source.cpp).
#pragma once

#include <glm/glm.hpp>
#include <memory>

#include "lights/light_source.h"
#include "scene/scene.h"

namespace raybundle {

// Each function returns the light source of a lamp of its kind. `centre` is Patches::centre in
// metres. `light` must outlive the returned source.
std::unique_ptr<LightSource> pointSource(const Light& light, const glm::dvec3& centre);
std::unique_ptr<LightSource> sunSource(const Light& light, const glm::dvec3& centre);
// Returns null if the lamp has no area.
std::unique_ptr<LightSource> areaSource(const Light& light, const glm::dvec3& centre);

}  // namespace raybundle
