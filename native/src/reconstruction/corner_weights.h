// SPDX-License-Identifier: GPL-3.0-or-later
//
// The weights with which the light of patches counts at the corners of their face. The weight of a
// patch is that of the interpolation between the corners, but 0 at a corner that a wall hides from
// the patch (patches/crossings.h). If the corner's own side of the wall is covered or lies inside
// of something, nobody sees this side. An example is the seat of a chair below its back. The corner
// then gets the light of the visible part of its face, although that lies beyond the wall.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "patches/lit_surfaces.h"
#include "scene/scene.h"
#include "visibility/visibility.h"

namespace raybundle {

// The indices of an instance's cells and parents in Patches::cells and Patches::parents. An
// instance without cells or parents has 0 for both ends.
struct InstanceRange {
    uint32_t firstCell = 0, lastCell = 0;      // [first, last)
    uint32_t firstParent = 0, lastParent = 0;  // [first, last)
};

// The corner weights of all patches on one side of an instance.
class CornerWeights {
  public:
    // Computes the weights from the exposed shares of the sides. The patches of `surfaces` must
    // outlive the object.
    CornerWeights(const LitSurfaces& surfaces, const InstanceRange& range, rb_side side);

    // The weights of one patch. The weights of the corners sum to 1, or to 0 if the patch counts at
    // no corner. `all` is the factor, 0 to 1, by which the patch counts as a whole. It is smaller
    // the nearer the patch is to corners that a wall hides from it.
    struct OfPatch {
        std::array<float, 4> corner;
        float all;
    };
    // Returns the weights at the centroid of a patch. `parent` is an index in Patches::parents, and
    // `patchInParent` the number of the patch in this parent.
    OfPatch of(uint32_t parent, uint32_t patchInParent) const;
    // Returns, per corner of its cell, the factor by which walls reduce the weight of a parent's
    // patches, 0 to 1. It is 1 at corners that no wall hides from the parent.
    const std::array<float, 4>& countsAt(uint32_t parent) const { return counts[parent - first]; }
    // Returns whether a wall reduces the weight of a parent's patches at any corner.
    bool isParted(uint32_t parent) const {
        return countsAt(parent) != std::array<float, 4>{1, 1, 1, 1};
    }

  private:
    const Patches& patches;
    const uint32_t first;
    std::vector<std::array<float, 4>> counts;  // per parent of the instance, see countsAt()
};

// Returns the exposed share of each patch side, with 0 for sides that lie inside a solid. Only the
// sides of faces that walls cut are examined, and they keep their shares if at least half of the
// face's area on this side is inside.
std::vector<float> exposedOutside(const LitSurfaces& surfaces, const Visibility& visibility);

}  // namespace raybundle
