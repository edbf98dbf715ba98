// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stop_rule.h"

#include <algorithm>

#include "bundles/directions.h"

namespace raybundle {
namespace {

// So many times the bundles are too many to be foretold.
constexpr double kFarAway = 2.5;
// So many times the target may be left where sides cast rays. If more is left, what these rays met
// is too noisy, and more bundles are worth their time as long as they take what is left down to
// kWorthMore of what it was. Where kOutOfReach times the target is left at first, as between the
// books of a shelf, that would take dozens of times the bundles, and all rays again each time.
constexpr double kLeftWithRays = 2, kWorthMore = 0.75, kOutOfReach = 12;

// Halves have the same number of bundles.
uint32_t even(uint32_t bundles) { return (bundles + 1) & ~1u; }

}  // namespace

StopRule::StopRule(const Settings& settings, uint32_t countable, uint32_t traced)
    : settings(settings),
      isCountable(countable >= uint32_t(settings.maxBundles)),
      mostBundles(std::min(uint32_t(settings.maxBundles), countable) & ~1u),
      wantedBundles(std::max(traced, std::min(mostBundles, even(uint32_t(settings.minBundles))))) {}

Stop StopRule::after(uint32_t bundles, double excess) {
    lastExcess = excess;
    if (excess <= 1 && settings.skipBundles) return Stop::NOISE_AT_TARGET;
    if (bundles >= mostBundles) return isCountable ? Stop::MAX_BUNDLES : Stop::UNCOUNTABLE_LINES;
    // As many as the slope of the noise says; if that is far away, double only, and look again.
    const double factor =
        settings.skipBundles ? 1.05 * std::pow(excess, 1 / kNoiseSlope) : INFINITY;
    wantedBundles =
        std::min(mostBundles, (uint32_t(bundles * (factor < kFarAway ? factor : 2.0)) + 2) & ~1u);
    return Stop::NOT_YET;
}

Stop StopRule::afterRays(uint32_t bundles, double left) {
    const double before = leftByRays;
    leftByRays = left;
    const bool isWorthMore =
        left > kLeftWithRays && left < std::min(kWorthMore * before, kOutOfReach);
    return isWorthMore ? after(bundles, left / kLeftWithRays) : Stop::NOISE_AT_TARGET;
}

bool StopRule::isOutOfReach() const {
    return std::isfinite(leftByRays) && leftByRays > kLeftWithRays;
}

}  // namespace raybundle
