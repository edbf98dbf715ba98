// SPDX-License-Identifier: GPL-3.0-or-later
//
// What sides send of a solved light towards one direction: what a local ray that meets them brings.
// Without emission, which is not reflected.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "first_shot/directed_light.h"
#include "patches/lit_surfaces.h"
#include "transport/transport.h"

namespace raybundle {

class SentLight {
  public:
    using Of = DirectedLight::Of;
    // irradiance: solved with that shot. All must outlive the object.
    SentLight(const LitSurfaces& surfaces, const FirstShot& shot, const Irradiance& irradiance,
              Of of);

    // Exitance towards a direction (unit) away from the side, W/m^2.
    glm::vec3 towards(uint32_t side, const glm::vec3& direction) const;

  private:
    const Irradiance& irradiance;
    const std::vector<float>& exposed;
    std::vector<glm::vec3> mean;  // per side, over all directions
    const DirectedLight directed;
};

}  // namespace raybundle
