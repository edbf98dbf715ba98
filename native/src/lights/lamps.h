// SPDX-License-Identifier: GPL-3.0-or-later
//
// The lamps of Blender as light sources: a file for each kind, and a row in lightSources
// (lights/light_source.cpp).
#pragma once

#include <glm/glm.hpp>
#include <memory>

#include "lights/light_source.h"
#include "scene/scene.h"

namespace raybundle {

// Each makes the source of a lamp of its kind. centre: Patches::centre, metres. The lamp must
// outlive its source.
std::unique_ptr<LightSource> pointSource(const Light& light, const glm::dvec3& centre);
std::unique_ptr<LightSource> sunSource(const Light& light, const glm::dvec3& centre);
// Null for a lamp without area.
std::unique_ptr<LightSource> areaSource(const Light& light, const glm::dvec3& centre);

}  // namespace raybundle
