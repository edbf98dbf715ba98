// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "lights/light_source.h"
#include "lights/receiver_place.h"

namespace raybundle {

// An irradiance, W/m^2, and about how far its brightest channel may be off.
struct ClosedMean {
    glm::vec3 irradiance{0.0f};
    float error = 0;
};

// What a receiver gets of a source without occluders, in the mean over its patch, by the source's
// closed form; nothing where the source has none. tolerance: an error that is small enough, W/m^2.
std::optional<ClosedMean> closedMean(const LightSource& source, const ReceiverPlace& place,
                                     float tolerance);

}  // namespace raybundle
