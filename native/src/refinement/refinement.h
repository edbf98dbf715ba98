// SPDX-License-Identifier: GPL-3.0-or-later
//
// Refinement: a tile is cut if the light changes within it by more than the error allowed in the
// bake, and if the gain is worth the cost of the additional patches. The decision is made before
// any bundle is traced, from a coarse first shot with few shadow rays from each tile. The surplus
// of its light (stated_error/surplus.h) marks tiles
// - at the edge of a shadow, where some of the rays of a tile are blocked and others are not;
// - where light varies nonlinearly within a tile, as beside a lamp.
//
// A cut pays if the squared error that it removes, relative to the squared light, is more than that
// of kWorth targets. One tile of N is 1 / N of the area, and its cut adds 3 / N to the number of
// patches. If a share c of the run time is proportional to the number of patches, bundles traced in
// the time that the cut takes would reduce the square of the noise, which is that of the target, on
// this area by 2 * kNoiseSlope (bundles/directions.h) * 3 * c times its value. For c = 1/2 this is
// the square of 1.4 targets.
//
// Contacts are cut here only where the light of the sources shows them. Narrow gaps are cut
// independently of the light (refinement/contacts.h).
//
// Sources: the criteria are those of hierarchical radiosity: Cohen, Greenberg, Immel, Brock, "An
// Efficient Radiosity Approach for Realistic Image Synthesis" (1986); Hanrahan, Salzman, Aupperle,
// "A Rapid Hierarchical Radiosity Algorithm" (1991).
// Differs: in these an element and its interactions are cut after its light is known. Here tiles
// are cut once, after a coarse first shot and before bundles are traced, because lines are stored
// with the patches that they join.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "direct_light/direct_light.h"
#include "patches/cuts.h"
#include "patches/patches.h"
#include "scene/scene.h"

namespace raybundle {

// Returns the cuts of a subdivision without cuts that pay. `shots` holds the coarse shot of all
// sides for each light set. They add at most `most` patches; the most worthwhile cuts come first.
// Tiles of dense surfaces (Patches::isDense) are cut only if `cutsDense` is true. `targetError` is
// relative.
Cuts worthwhileCuts(const Scene& scene, const Patches& patches,
                    const std::vector<CoarseShot>& shots, size_t most, float targetError,
                    bool cutsDense = true);

}  // namespace raybundle
