// SPDX-License-Identifier: GPL-3.0-or-later
//
// What a bake says of its result where that is limited or approximated, each with what to do.
#pragma once

#include <string>
#include <vector>

#include "bake/stop_rule.h"
#include "job/report.h"
#include "job/settings.h"
#include "patches/patches.h"
#include "scene/scene.h"
#include "transport/set_light.h"

namespace raybundle {

// Names the instances whose visibility is only approximated.
void warnOfVisibility(const Scene& scene, const SetLights& lights, const Settings& settings,
                      Report& report);

// Names the materials whose light through them the solver does not carry.
void warnOfTranslucence(const Scene& scene, const Settings& settings, Report& report);

// Where materials reflect by angle: names the first shot and the solver that do not.
void warnOfAngles(const Patches& patches, const Settings& settings, Report& report);

// Of so many patches beside narrow gaps that are left whole.
void warnOfGaps(size_t patches, Report& report);

// Names the objects whose patches about so few lines meet that nobody knows their noise. pixelSize:
// edge of the pixels of `bundles` bundles, metres, the same everywhere.
void warnOfFewLines(const Scene& scene, const Patches& patches, float pixelSize, uint32_t bundles,
                    const Settings& settings, Report& report);

// Names the source and the object that most of the first shot's noise comes from and is on. area:
// per side, of what is wanted.
void warnOfDirectNoise(const Scene& scene, const Patches& patches, const SetLights& lights,
                       const std::vector<float>& area, double noise, double target, Report& report);

// A bake that ended above its target; noises are relative.
struct MissedTarget {
    Stop stop;  // why it ended
    uint32_t bundles;
    int32_t set;        // the light set with the most noise, or kNoLightSet
    double noise;       // of that light on all patches
    double ofNoisiest;  // of the noisiest parts of objects; 0: not known
    double target;
};
void warnOfMissedTarget(const Scene& scene, const MissedTarget& missed, Report& report);

// Of cycles of patches that each cover the next one, which a painter's order cannot have.
void warnOfBrokenCycles(uint64_t cycles, Report& report);

// Of the share of all lines that met surfaces in a wrong order or passed through some, and the
// relative error by them.
void warnOfWrongExchanges(double share, double error, Report& report);

// First of all that is said: light that is lost or made is worse than noise.
void warnOfImbalance(Report& report);

}  // namespace raybundle
