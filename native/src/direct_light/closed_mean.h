// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "lights/light_source.h"
#include "lights/receiver_place.h"

namespace raybundle {

// An irradiance, W/m^2, and the estimated error of its brightest channel, W/m^2.
struct ClosedMean {
    glm::vec3 irradiance{0.0f};
    float error = 0;
};

// Returns the irradiance that a receiver gets from a source without occluders, as the mean over its
// patch, computed from the source's closed form. Returns nothing if the source has no closed form.
// `tolerance` is the acceptable error, W/m^2.
std::optional<ClosedMean> closedMean(const LightSource& source, const ReceiverPlace& place,
                                     float tolerance);

}  // namespace raybundle
