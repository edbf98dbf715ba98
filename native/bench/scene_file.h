// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "scene/scene.h"

namespace raybundle::bench {

// Reads a scene that blend_tests/export_scene.py wrote. Throws Error, or nlohmann's exceptions for
// text that is not such a scene.
Scene readScene(const std::string& path);

}  // namespace raybundle::bench
