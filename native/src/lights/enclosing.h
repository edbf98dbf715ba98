// SPDX-License-Identifier: GPL-3.0-or-later
//
// Surfaces that enclose a volume, and which of their sides they hide. If such a surface lets no
// light through, any line from outside meets its outer side first. The light of the inner side is
// then out of sight from outside. An example is the body of a lamp whose material emits from both
// sides. If nothing else is inside, nobody ever sees this light.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/patch_size.h"
#include "patches/patches.h"
#include "scene/scene.h"

namespace raybundle {

// The bounds of one surface or of several surfaces, and the sides that they hide.
struct Enclosing {
    Extent box;  // metres, relative to Patches::centre
    // Whether the fronts [0], and the backs [1], are out of sight from outside.
    bool hides[2] = {true, true};

    // Extends the box by that of `other`. A side stays hidden only if it is hidden in both.
    void add(const Enclosing& other);
};

// Returns the bounding box of a parent in metres, relative to Patches::centre.
Extent boxOf(const Patches& patches, const Parent& parent);

// Returns the box and the hidden sides of each surface, indexed by Parent::surface.
std::vector<Enclosing> enclosingSurfaces(const Patches& patches);

// Returns for each surface whether its backs see only each other and are not baked. The result is
// indexed by Parent::surface. Only surfaces with emission on their backs are examined; the result
// is false for all others, and empty if no back emits. `emission` is per patch side, W/m^2.
std::vector<bool> emptyInsides(const Scene& scene, const Patches& patches,
                               const std::vector<glm::vec3>& emission);

}  // namespace raybundle
