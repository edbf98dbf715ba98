// SPDX-License-Identifier: GPL-3.0-or-later
//
// GATHER: the first shot, seen from the receivers: every patch side gathers the light of the
// sources.
//
// Sources: thesis sections 2.4.2 and 4.3.3 (first shot, stated error).
// Differs: the thesis shoots rays from the sources: of N rays a patch gets few, and fewer the finer
// it is. Gathering spends its rays where the light is to be known (transport/direct_light.h).
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "bake/progress.h"
#include "patches/patches.h"
#include "transport/direct_light.h"

namespace raybundle {

struct FirstShot {
    std::vector<glm::vec3> irradiance;  // per side, gathered from the sources, W/m^2
    std::vector<float> error;           // per side, standard error of the irradiance, W/m^2
    std::vector<glm::vec3> emission;    // per side: emission that the bundles are to carry, W/m^2
    glm::dvec3 emitted{0.0};  // power of the gathered sources, W; without a power: what arrives
    glm::dvec3 escaped{0.0};  // part of it that meets no surface, W
    uint64_t rays = 0;
    uint64_t unblockedSides = 0;  // side and source pairs without noise: wholly visible
    uint64_t hiddenSides = 0;     // side and source pairs that cannot see each other, without a ray
};

// Gathers direct light to about `targetError` relative standard error per patch side.
FirstShot gatherFirstShot(const DirectLight& light, const Patches& patches, float targetError,
                          const Progress& progress);

}  // namespace raybundle
