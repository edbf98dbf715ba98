// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "scene/scene.h"

namespace raybundle::bench {

// Reads a scene that blend_tests/export_scene.py has written. Throws Error, or an exception of
// nlohmann JSON if the text is not a scene.
Scene readScene(const std::string& path);

}  // namespace raybundle::bench
