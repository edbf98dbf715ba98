// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

// The light of one light set at the nodes of an instance (reconstruction/smooth_regions.h). All
// fields are per node, W/m^2.
struct NodeLight {
    std::vector<glm::vec3> direct, indirect;  // irradiance
    std::vector<glm::vec3> exitance;          // with emission
    // Set only on instances whose corners gather; otherwise empty.
    std::vector<glm::vec3> carried;   // part of the direct irradiance that is not from the sources
    std::vector<glm::vec3> emission;  // exitance of emission
};

}  // namespace raybundle
