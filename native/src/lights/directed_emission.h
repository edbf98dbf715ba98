// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace raybundle {

// Of light that surfaces do not send alike to all directions.
class DirectedEmission {
  public:
    virtual ~DirectedEmission() = default;

    // What a side sends towards a direction (unit, away from it) more than in the mean over all
    // directions, or less, W/m^2. mean: its exitance, W/m^2.
    virtual glm::vec3 beyondMean(uint32_t side, const glm::vec3& direction,
                                 const glm::vec3& mean) const = 0;
};

}  // namespace raybundle
