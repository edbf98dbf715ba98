// SPDX-License-Identifier: GPL-3.0-or-later
//
// What surfaces that enclose a volume hide: of those that let no light through, a line from outside
// meets the outer side first. So light of their inner side, as the body of a lamp has it whose
// material emits from both sides, is out of sight from outside; and where nothing else is inside,
// nobody ever sees it.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/patch_size.h"
#include "patches/patches.h"
#include "scene/scene.h"

namespace raybundle {

// Of a surface, or of several.
struct Enclosing {
    Extent box;                    // relative to Patches::centre
    bool hides[2] = {true, true};  // whether nothing outside sees its fronts, or its backs

    void add(const Enclosing& other);
};

// Of a parent, relative to Patches::centre.
Extent boxOf(const Patches& patches, const Parent& parent);

// Per surface (Parent::surface).
std::vector<Enclosing> enclosingSurfaces(const Patches& patches);

// Per surface: whether its backs see nothing but each other and are not what is baked. Only asked
// of surfaces with `emission` (per side) on their backs; false of all others, and empty without
// any.
std::vector<bool> emptyInsides(const Scene& scene, const Patches& patches,
                               const std::vector<glm::vec3>& emission);

}  // namespace raybundle
