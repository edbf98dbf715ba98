// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "first_shot/first_shot.h"

namespace raybundle {

// Largest number of lines of a first shot.
constexpr uint64_t kMostShotLines = uint64_t(1) << 24;
// Random number streams of a first shot, one for each purpose.
constexpr uint32_t kAllotSources = 0, kShootSources = 1, kAllotReflected = 2, kShootReflected = 3;

// The result of shooting from the sources, for first shots that shoot.
struct SourceShot {
    std::vector<glm::dvec3> received;  // per side: power that arrived, W
    std::vector<glm::dvec3> variance;  // per side: variance of `received`, W^2
    glm::dvec3 emitted{0.0};           // W, see FirstShot::emitted
    glm::dvec3 escaped{0.0};           // W
    double powerPerLine = 0;           // sum over the channels, W
    uint64_t lines = 0;
};

// Shoots `lines` lines from all sources. With 0 lines, shoots until the noise meets the target
// error.
SourceShot shootSources(const FirstShotInput& input, uint64_t lines);

// Returns the standard error of the irradiance of each side, W/m^2, from the variance of its power,
// W^2. It is that of the noisiest channel.
std::vector<float> standardErrors(const Patches& patches, const std::vector<glm::dvec3>& variance);

}  // namespace raybundle
