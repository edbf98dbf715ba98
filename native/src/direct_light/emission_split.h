// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which emission is a source of the first shot, and which is left to the bundles. A line brings the
// exitance of the surface that it meets: what is not much brighter than the mean of all that lines
// meet, the darkness beyond an open scene included, adds little noise, and a furnace stays exact.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "job/skips.h"
#include "lights/directed_emission.h"
#include "patches/patches.h"
#include "scene/scene.h"
#include "visibility/visibility.h"

namespace raybundle {

// Per side, W/m^2.
struct EmissionSplit {
    std::vector<glm::vec3> emitted;   // all of the light set
    std::vector<glm::vec3> gathered;  // of sources, of the whole patch
    std::vector<glm::vec3> bundled;
    std::vector<bool> isSource;
    // What sides send towards a direction more than `gathered`, or less; null: nothing.
    std::shared_ptr<const DirectedEmission> directed{};
    // Emission that nobody ever sees is in none of these: its sides, and its power, W.
    size_t unseen = 0;
    glm::dvec3 unseenPower{0.0};
};

EmissionSplit splitEmission(const Scene& scene, const Patches& patches,
                            const Visibility& visibility, int32_t lightSet, uint32_t seed,
                            const Skips& skips = {});

}  // namespace raybundle
