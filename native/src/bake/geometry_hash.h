// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "job/settings.h"
#include "scene/scene.h"

namespace raybundle {

// A hash of all that patches and traced lines depend on: positions, faces, transforms and the
// settings of patches and lines. Light, materials, names and roles do not enter. Two scenes with
// equal hashes are taken to have equal geometry (64 bits).
uint64_t geometryHash(const Scene& scene, const Settings& settings);

// A hash of what decides beside geometry which faces stand for others in the same place
// (patches/doubled_faces.h).
uint64_t likenessHash(const Scene& scene);

}  // namespace raybundle
