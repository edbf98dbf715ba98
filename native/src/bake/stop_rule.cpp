// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stop_rule.h"

#include <algorithm>

#include "bundles/directions.h"

namespace raybundle {
namespace {

// If the predicted number of bundles is more than this many times the present number, the
// prediction is not relied on.
constexpr double kFarAway = 2.5;
// Multiples of the target that may remain after sides have cast rays. If more than kLeftWithRays
// remains, the light that the rays met is too noisy. More bundles are then worth their time, and
// that of all rays, which are cast again, as long as they reduce what remains to less than
// kWorthMore of its value. If kOutOfReach or more remains at first, as between the books of a
// shelf, dozens of times as many bundles would be needed.
constexpr double kLeftWithRays = 2, kWorthMore = 0.75, kOutOfReach = 12;

// Rounds up to an even number, since both halves have the same number of bundles.
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
    // Traces as many bundles as the slope of the noise predicts. If this number is far away,
    // doubles the number of bundles and looks again.
    const double factor =
        settings.skipBundles ? 1.05 * std::pow(excess, 1 / kNoiseSlope) : INFINITY;
    wantedBundles =
        std::min(mostBundles, (uint32_t(bundles * (factor < kFarAway ? factor : 2.0)) + 2) & ~1u);
    // The factor is not finite if no bundle has been traced, or if all bundles are wanted.
    const bool isForeseen = factor < double(mostBundles);
    foreseenBundles =
        isForeseen ? uint32_t(std::min(bundles * factor, double(mostBundles))) : mostBundles;
    return Stop::NOT_YET;
}

Stop StopRule::afterRays(uint32_t bundles, double left) {
    const double before = leftByRays;
    leftByRays = left;
    const bool isWorthMore =
        kWorthMore * left > kLeftWithRays && left < std::min(kWorthMore * before, kOutOfReach);
    return isWorthMore ? after(bundles, left / kLeftWithRays) : Stop::NOISE_AT_TARGET;
}

bool StopRule::isOutOfReach() const {
    return std::isfinite(leftByRays) && kWorthMore * leftByRays > kLeftWithRays;
}

}  // namespace raybundle
