// SPDX-License-Identifier: GPL-3.0-or-later
//
// Decides which emission is a source of the first shot and which is left to the bundles. A global
// line carries the exitance of the surface that it meets. Emission that is not much brighter than
// the mean of all that lines meet, the darkness outside an open scene included, adds little noise
// there. Leaving it to the bundles keeps a furnace exact.
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

// The emission of a light set, per side, W/m^2.
struct EmissionSplit {
    std::vector<glm::vec3> emitted;    // all emission of the light set
    std::vector<glm::vec3> ofSources;  // emission of the sources, for the whole patch area
    std::vector<glm::vec3> bundled;    // emission that is left to the bundles
    std::vector<bool> isSource;        // whether the side is a light source
    // The difference of what sides send towards a direction from `ofSources`; null if there is none.
    std::shared_ptr<const DirectedEmission> directed{};
    // Number of sides whose emission no surface can receive, and their power, W. The members above
    // leave this emission out.
    size_t unseen = 0;
    glm::dvec3 unseenPower{0.0};
};

// Splits the emission of a light set between the first shot and the bundles.
EmissionSplit splitEmission(const Scene& scene, const Patches& patches,
                            const Visibility& visibility, int32_t lightSet, uint32_t seed,
                            const Skips& skips = {});

}  // namespace raybundle
