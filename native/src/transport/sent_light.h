// SPDX-License-Identifier: GPL-3.0-or-later
//
// The exitance of patch sides towards one direction, for solved light. This is the light that a
// local ray brings from the side that it meets. Emission is not included.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "first_shot/directed_light.h"
#include "patches/lit_surfaces.h"
#include "transport/transport.h"

namespace raybundle {

// The light that sides reflect and pass on, by direction.
class SentLight {
  public:
    using Of = DirectedLight::Of;
    // Takes all reflected light, or only the light that the first shot has not distributed itself
    // (`of`). `irradiance` must have been solved from `shot`. All references must outlive the
    // object.
    SentLight(const LitSurfaces& surfaces, const FirstShot& shot, const Irradiance& irradiance,
              Of of);

    // Returns the exitance of the exposed part of a side towards a direction, W/m^2. The direction
    // is a unit vector that points away from the side.
    glm::vec3 towards(uint32_t side, const glm::vec3& direction) const;

  private:
    const Irradiance& irradiance;
    const std::vector<float>& exposed;
    std::vector<glm::vec3> mean;  // per side: mean exitance over all directions, W/m^2
    const DirectedLight directed;
};

}  // namespace raybundle
