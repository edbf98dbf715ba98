// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "first_shot/first_shot.h"

namespace raybundle {

// Lines of a first shot, at most.
constexpr uint64_t kMostShotLines = uint64_t(1) << 24;
// Streams of random numbers of a first shot, by what they are for.
constexpr uint32_t kAllotSources = 0, kShootSources = 1, kAllotReflected = 2, kShootReflected = 3;

// What shooting from the sources brought, before it is a first shot.
struct SourceShot {
    std::vector<glm::dvec3> received;  // per side, W
    std::vector<glm::dvec3> variance;  // per side, of what it received, W^2
    glm::dvec3 emitted{0.0};           // W, as in FirstShot
    glm::dvec3 escaped{0.0};           // W
    double powerPerLine = 0;           // W, all channels together
    uint64_t lines = 0;
};

// Shoots from all sources with `lines` lines; 0: until the noise meets the target error.
SourceShot shootSources(const FirstShotInput& input, uint64_t lines);

// Standard error of the irradiance of each side by the variance of its power; of the noisiest
// channel.
std::vector<float> standardErrors(const Patches& patches, const std::vector<glm::dvec3>& variance);

}  // namespace raybundle
