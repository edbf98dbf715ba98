// SPDX-License-Identifier: GPL-3.0-or-later
//
// The rule that decides when a bake has traced enough bundles, and how many bundles it traces
// before the next look at its noise.
//
// Source: thesis section 4.3.3, which adds bundles until an error estimate meets a target.
// Differs:
// - The number of bundles grows as the known slope of the noise predicts, instead of by a fixed
//   step.
// - If noisy sides have cast rays of their own, the noise that remains after these rays is judged
//   too.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "job/settings.h"

namespace raybundle {

// Why a bake traces no more bundles, or NOT_YET if it traces more.
enum class Stop { NOT_YET, NOISE_AT_TARGET, MAX_BUNDLES, UNCOUNTABLE_LINES };

// Decides the number of bundles of one bake.
class StopRule {
  public:
    // `countable` is the largest number of bundles whose lines can be counted (mostBundles in
    // bundles/line_windows.h). `traced` is the number of bundles that earlier bakes have traced
    // with the same lines. Keeps a reference to `settings`.
    StopRule(const Settings& settings, uint32_t countable, uint32_t traced);

    // Returns how many bundles must be traced before the next look, those of earlier bakes
    // included.
    uint32_t wanted() const { return wantedBundles; }
    // Returns the largest number of bundles that this bake may use.
    uint32_t most() const { return mostBundles; }
    // Returns how many bundles the bake will probably use: as many as the slope of the noise
    // predicts, at least wanted().
    uint32_t foreseen() const { return std::max(foreseenBundles, wantedBundles); }

    // Decides after a look at `bundles` bundles, whose noise is `excess` times the target.
    Stop after(uint32_t bundles, double excess);
    // Decides after Stop::NOISE_AT_TARGET, when noisy sides have cast rays. `left` is the noise
    // that remains on their objects, in multiples of the target. Returns NOT_YET if more bundles
    // are worth their time.
    Stop afterRays(uint32_t bundles, double left);

    // Returns the noise of the last decision in multiples of the target.
    double excess() const { return lastExcess; }
    // Returns whether rays have left so much more than twice the target that further bundles would
    // be worth their time, but would hardly reduce it.
    bool isOutOfReach() const;

  private:
    const Settings& settings;
    const bool isCountable;  // whether the lines of max_bundles bundles can be counted
    const uint32_t mostBundles;
    uint32_t wantedBundles, foreseenBundles = 0;
    double lastExcess = 0;
    double leftByRays = INFINITY;  // noise at the last afterRays(), in multiples of the target
};

}  // namespace raybundle
