// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

// The light of one set at the nodes of an instance (SmoothRegions), all per node, W/m^2.
struct NodeLight {
    std::vector<glm::vec3> direct, indirect;  // irradiance
    std::vector<glm::vec3> exitance;          // emission included
    // Only where corners gather; else empty.
    std::vector<glm::vec3> carried;   // of the direct light what is not from the sources
    std::vector<glm::vec3> emission;  // exitance
};

}  // namespace raybundle
