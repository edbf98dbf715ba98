// SPDX-License-Identifier: GPL-3.0-or-later
//
// Where the power goes, and the share of it that goes wrong ways because a projector lets it.
#pragma once

#include <vector>

#include "job/report.h"
#include "patches/lit_surfaces.h"
#include "scene/scene.h"
#include "transport/set_light.h"

namespace raybundle {

// Compares the power that the lights emit with what surfaces absorb and what leaves the scene: adds
// those of one light set. openShare: per side, the share of its lines that leave the scene, as Transport::openShare has it: sides of which nothing is known
// get what others of their object do by lines, in the mean.
void balanceEnergy(const LitSurfaces& surfaces, const SetLight& light,
                   const std::vector<float>& openShare, Report& report);

// The share of the lines of the weighted sides that leave the scene, or stay in it, only because
// the projector lets lines through surfaces (ROULETTE): the difference to exact projection, object
// by object, so that the noise of single sides cancels.
double leakedShare(const Scene& scene, const Patches& patches, const std::vector<float>& weight,
                   const std::vector<float>& exactOpen, const std::vector<float>& open);

// Relative error of the light where so large a share of the exchanges is wrong: each reflection
// adds to it.
double errorByWrongExchanges(const Patches& patches, double share);

}  // namespace raybundle
