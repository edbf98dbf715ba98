// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace raybundle {

// Interface for emitted light whose radiance depends on the direction.
class DirectedEmission {
  public:
    virtual ~DirectedEmission() = default;

    // Returns how much the exitance of a patch side towards `direction` differs from `mean`, in
    // W/m^2; negative where the side sends less than the mean. `direction` is a unit vector that
    // points away from the side. `mean` is the side's exitance, averaged over all directions,
    // W/m^2.
    virtual glm::vec3 beyondMean(uint32_t side, const glm::vec3& direction,
                                 const glm::vec3& mean) const = 0;
};

}  // namespace raybundle
