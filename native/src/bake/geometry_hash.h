// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "job/settings.h"
#include "scene/scene.h"

namespace raybundle {

// Returns a hash of everything that patches and traced lines depend on: positions, faces,
// transforms, which instances block and exchange light, and the settings of patches and lines. If
// any material lets light through, the opacity of the materials is included. Light, colours, names
// and roles are not included. Two scenes with equal hashes are assumed to have equal geometry (64
// bits).
uint64_t geometryHash(const Scene& scene, const Settings& settings);

// Returns a hash of everything apart from the geometry that determines which faces stand for others
// in the same place (patches/doubled_faces.h).
uint64_t likenessHash(const Scene& scene);

}  // namespace raybundle
