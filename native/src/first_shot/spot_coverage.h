// SPDX-License-Identifier: GPL-3.0-or-later
//
// What lies on bright spots (first_shot/bright_spots.h). The light of a spot leaves from the part of
// it that nothing covers. A solid that stands on it blocks the shadow rays to the covered part,
// while a sheet on it may not.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <set>
#include <vector>

#include "direct_light/emission_split.h"
#include "patches/patches.h"
#include "visibility/visibility.h"

namespace raybundle {

// Bright spots as sources.
struct SpotSources {
    EmissionSplit light;          // the spots, with the exitance of their exposed parts
    std::vector<uint32_t> sides;  // the sides that are sources, in ascending order
    // The surfaces (Parent::surface) of solids that stand on spots. Shadow rays end just before a
    // spot, and so do not meet the bottom of such a solid. Its inside is to get no light of spots.
    std::set<uint32_t> covers;
};

// Returns the sides of `bright` that can be sources. `sent` is per side the light that it sends in
// the mean over its whole area, W/m^2. A side cannot be a source if a sheet lies on it, if too
// little of it is exposed, or if a solid stands on it with other bright sides in it.
SpotSources spotSources(const Patches& patches, const Visibility& exchange,
                        const std::vector<uint32_t>& bright, const std::vector<glm::vec3>& sent);

}  // namespace raybundle
