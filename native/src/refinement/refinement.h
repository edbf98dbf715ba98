// SPDX-License-Identifier: GPL-3.0-or-later
//
// Refinement: tiles are cut where the light changes within them by more than the bake may err, and
// where that gains more than the patches cost; others stay as they are. What tells before any
// bundle is a coarse first shot, of few shadow rays from each tile: the surplus of its light
// (stated_error/surplus.h),
// - at the edge of a shadow, where of the rays of a tile some are blocked and some are not;
// - in light that bends within a tile, as beside a lamp.
//
// A cut pays where the squares that it removes, over those of the light, are more than those of
// kWorth targets. One tile of N is 1 / N of the area, and its cut adds 3 / N to the patches. If a
// share c of the run time goes with the patches, bundles for as much time would bring the squares
// of the noise, which are those of the target, down by 2 * kNoiseSlope (bundles/directions.h) * 3 *
// c of them: with c = 1/2 that is the square of 1.4 targets.
//
// Contacts are cut only where the sources' light shows them; narrow gaps are cut for themselves
// (refinement/contacts.h).
//
// Sources: the marks are those of hierarchical radiosity: Cohen, Greenberg, Immel, Brock, "An
// Efficient Radiosity Approach for Realistic Image Synthesis" (1986); Hanrahan, Salzman, Aupperle,
// "A Rapid Hierarchical Radiosity Algorithm" (1991).
// Differs: there an element is cut after its light is known, and its interactions with it; here
// once, after a coarse first shot and before bundles are traced, because lines are kept
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

// The cuts of an uncut subdivision that pay. shots: of all sides, of each light set. At most
// maxPatches patches come out, the most worthwhile cuts first. targetError: relative.
Cuts worthwhileCuts(const Scene& scene, const Patches& patches,
                    const std::vector<CoarseShot>& shots, size_t maxPatches, float targetError);

}  // namespace raybundle
