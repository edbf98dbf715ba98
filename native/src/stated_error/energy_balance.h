// SPDX-License-Identifier: GPL-3.0-or-later
//
// Energy balance: where the emitted power goes, and which share of it goes wrong ways because a
// projector lets lines pass through surfaces.
#pragma once

#include <vector>

#include "job/report.h"
#include "patches/lit_surfaces.h"
#include "scene/scene.h"
#include "transport/set_light.h"

namespace raybundle {

// Adds the power that one light set emits, the power that surfaces absorb, and the power that
// leaves the scene to `energy`. `light.irradiance` must be solved.
// `openShare` is per side the share of its lines that leave the scene, see Transport::openShare().
// For a side with a negative share, about which nothing is known, the mean of the other sides of
// its object is used.
void balanceEnergy(const LitSurfaces& surfaces, const SetLight& light,
                   const std::vector<float>& openShare, Report::Energy& energy);

// Returns the share of lines, 0 to 1, that leave the scene, or stay in it, only because the
// projector lets lines pass through surfaces (ROULETTE). `open` and `exactOpen` are per side the
// shares of lines that leave the scene with this projector and with exact projection; `weight` is
// per side. The differences are summed up per object before their sizes are added, so that the
// noise of single sides cancels.
double leakedShare(const Scene& scene, const Patches& patches, const std::vector<float>& weight,
                   const std::vector<float>& exactOpen, const std::vector<float>& open);

// Returns the relative error of the light if the given share of the exchanges is wrong. The error
// accumulates with each reflection.
double errorByWrongExchanges(const Patches& patches, double share);

}  // namespace raybundle
