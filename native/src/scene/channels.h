// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <glm/glm.hpp>

namespace raybundle {

// Returns the largest channel.
inline float brightest(const glm::vec3& v) { return std::max({v.x, v.y, v.z}); }

// Returns the sum of the channels.
inline double sumOfChannels(const glm::dvec3& v) { return v.x + v.y + v.z; }

}  // namespace raybundle
