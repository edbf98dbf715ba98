// SPDX-License-Identifier: GPL-3.0-or-later
//
// When a bake has traced enough bundles, and how many to trace before the next look at its noise.
//
// Source: thesis section 4.3.3, which adds bundles until an error estimate meets a target.
// Differs: the number of bundles grows as the slope of the noise foretells instead of by a fixed
// step; and where noisy sides cast rays of their own, what these leave is judged too.
#pragma once

#include <cmath>
#include <cstdint>

#include "job/settings.h"

namespace raybundle {

// Why a bake adds no more bundles, or that it does.
enum class Stop { NOT_YET, NOISE_AT_TARGET, MAX_BUNDLES, UNCOUNTABLE_LINES };

class StopRule {
  public:
    // countable: the most bundles whose lines can be counted (mostBundles in
    // bundles/line_windows.h). traced: bundles of earlier bakes with the same lines.
    StopRule(const Settings& settings, uint32_t countable, uint32_t traced);

    // How many bundles, those of earlier bakes included, are to be traced before the next look.
    uint32_t wanted() const { return wantedBundles; }
    // The most bundles that this bake may use.
    uint32_t most() const { return mostBundles; }

    // After a look at so many bundles whose noise is `excess` times the target.
    Stop after(uint32_t bundles, double excess);
    // After Stop::NOISE_AT_TARGET, once noisy sides have cast rays, on whose objects the noise is
    // still `left` times the target: NOT_YET where more bundles are worth their time.
    Stop afterRays(uint32_t bundles, double left);

    // So many times too large for the target was the noise by the last judgement.
    double excess() const { return lastExcess; }
    // Whether rays have left more than twice the target, which more bundles hardly help.
    bool isOutOfReach() const;

  private:
    const Settings& settings;
    const bool isCountable;  // all of max_bundles
    const uint32_t mostBundles;
    uint32_t wantedBundles;
    double lastExcess = 0;
    double leftByRays = INFINITY;  // times the target, at the last afterRays
};

}  // namespace raybundle
