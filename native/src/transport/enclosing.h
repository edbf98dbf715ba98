// SPDX-License-Identifier: GPL-3.0-or-later
//
// What surfaces that enclose a volume hide: of those that let no light through, a line from outside
// meets the outer side first. So light of their inner side, as the body of a lamp has it whose
// material emits from both sides, is out of sight from outside; and where nothing else is inside,
// nobody ever sees it.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <vector>

#include "patches/patches.h"
#include "scene/scene.h"

namespace raybundle {

// A box, metres, relative to Patches::centre.
struct Enclosure {
    glm::vec3 low{INFINITY}, high{-INFINITY};

    void add(const glm::vec3& point) {
        low = glm::min(low, point);
        high = glm::max(high, point);
    }
    void add(const Enclosure& other) {
        low = glm::min(low, other.low);
        high = glm::max(high, other.high);
    }
    // Whether they have more in common than what touches.
    bool meets(const Enclosure& other, float touchDistance) const {
        return glm::all(glm::lessThan(low + touchDistance, other.high)) &&
               glm::all(glm::lessThan(other.low + touchDistance, high));
    }
    float distance(const glm::vec3& point) const {
        return glm::length(glm::max(glm::max(low - point, point - high), glm::vec3(0.0f)));
    }
    float radius() const { return low.x > high.x ? 0.0f : 0.5f * glm::length(high - low); }
};

// Of a surface, or of several.
struct Enclosing {
    Enclosure box;
    bool hides[2] = {true, true};  // whether nothing outside sees its fronts, or its backs

    void add(const Enclosing& other);
};

// Per surface (Parent::surface).
std::vector<Enclosing> enclosingSurfaces(const Patches& patches);

// Per surface: whether its backs see nothing but each other and are not what is baked. Only asked of
// surfaces with `emission` (per side) on their backs; false of all others.
std::vector<bool> emptyInsides(const Scene& scene, const Patches& patches,
                               const std::vector<glm::vec3>& emission);

}  // namespace raybundle
