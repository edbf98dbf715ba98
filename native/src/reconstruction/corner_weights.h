// SPDX-License-Identifier: GPL-3.0-or-later
//
// What the light of a patch counts at the corners of its face: as much as the interpolation between
// them has there, but nothing at a corner that a wall hides from it (patches/crossings.h). Where
// the corner's own side of the wall is covered or inside of something, as below the back of a
// chair, nobody sees that: the corner then has the light of what is seen of its face.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "patches/lit_surfaces.h"
#include "scene/scene.h"
#include "visibility/visibility.h"

namespace raybundle {

// Where an instance's cells and parents lie in Patches.
struct InstanceRange {
    uint32_t firstCell = 0, lastCell = 0;      // [first, last)
    uint32_t firstParent = 0, lastParent = 0;  // [first, last)
};

class CornerWeights {
  public:
    // For one side of an instance, by what is exposed of it. The patches must outlive the object.
    CornerWeights(const LitSurfaces& surfaces, const InstanceRange& range, rb_side side);

    // Of a patch by its number in the parent, by its middle. The sum of the corners' is 1, or 0 if
    // it counts at none; all: what the patch counts by, the less the nearer it is to corners that a
    // wall hides.
    struct OfPatch {
        std::array<float, 4> corner;
        float all;
    };
    OfPatch of(uint32_t parent, uint32_t patchInParent) const;
    // Per corner of its face, what the patches of a parent count there, of what they would without
    // walls: 1 where no wall hides it.
    const std::array<float, 4>& countsAt(uint32_t parent) const { return counts[parent - first]; }
    bool isParted(uint32_t parent) const {
        return countsAt(parent) != std::array<float, 4>{1, 1, 1, 1};
    }

  private:
    const Patches& patches;
    const uint32_t first;
    std::vector<std::array<float, 4>> counts;  // per parent of the instance, see countsAt
};

// exposed, but 0 for what lies inside of a solid of the sides of faces that walls cut, if that is
// the smaller part of a face.
std::vector<float> exposedOutside(const LitSurfaces& surfaces, const Visibility& visibility);

}  // namespace raybundle
