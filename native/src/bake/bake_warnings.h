// SPDX-License-Identifier: GPL-3.0-or-later
//
// Warnings about results of a bake that are limited or approximate. Each function decides whether
// its warning applies, and adds it to the report with a remedy.
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

// Names the objects for which blocking of light, or the exchange of light, is only approximated.
void warnOfVisibility(const Scene& scene, const SetLights& lights, const Settings& settings,
                      Report& report);

// Names the translucent materials if the solver does not carry the light that passes through them.
void warnOfTranslucence(const Scene& scene, const Settings& settings, Report& report);

// If any material reflects light depending on its angle, names the first shot and the solver that
// ignore the angle.
void warnOfAngles(const Patches& patches, const Settings& settings, Report& report);

// Warns that the scene has more patches than allowed, because each face has at least one.
void warnOfPatches(size_t patches, const Settings& settings, Report& report);

// Warns of patches beside narrow gaps that were not cut. `patches` is their number.
void warnOfGaps(size_t patches, Report& report);

// Names the baked objects whose patches meet so few lines that their noise cannot be estimated.
// `pixelSize` is the edge of the pixels of all `bundles` bundles, m.
void warnOfFewLines(const Scene& scene, const Patches& patches, float pixelSize, uint32_t bundles,
                    const Settings& settings, Report& report);

// Names the source that causes most of the noise of the first shot, and the object with most of
// this noise. `area` is per side the area that has a result, m^2. `noise` and `target` are
// relative.
void warnOfDirectNoise(const Scene& scene, const Patches& patches, const SetLights& lights,
                       const std::vector<float>& area, double noise, double target, Report& report);

// A bake that ended above its target. Noises are relative.
struct MissedTarget {
    Stop stop;  // why the bake ended
    uint32_t bundles;
    int32_t set;        // light set with the most noise, or kNoLightSet
    double noise;       // noise of the light of this set on all patches
    double ofNoisiest;  // noise of the noisiest parts of objects; 0 if not known
    double target;
};
// Warns that the bake ended above its target, and why.
void warnOfMissedTarget(const Scene& scene, const MissedTarget& missed, Report& report);

// Warns of cycles of patches each of which covers the next one. No order from back to front, which
// a painter needs, exists for them. `cycles` is the number of broken cycles.
void warnOfBrokenCycles(uint64_t cycles, Report& report);

// Warns of lines that met surfaces in the wrong order or passed through surfaces. `share` is their
// share of all lines, `error` the relative error of the light that they cause.
void warnOfWrongExchanges(double share, double error, Report& report);

// Warns of an energy balance with a large error. The warning is put before all others, because
// light that is lost or created is worse than noise.
void warnOfImbalance(Report& report);

}  // namespace raybundle
