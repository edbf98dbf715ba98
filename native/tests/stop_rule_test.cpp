// SPDX-License-Identifier: GPL-3.0-or-later
//
// When a bake stops adding bundles, and the reason.
#include "bake/stop_rule.h"

#include <gtest/gtest.h>

#include <cmath>

#include "bundles/directions.h"

namespace raybundle {
namespace {

constexpr uint32_t kAll = 1u << 24;

TEST(StopRule, BeginsWithTheLeastOrWithWhatWasTraced) {
    Settings settings;
    settings.minBundles = 63;  // rounded up, since halves are of equal size
    EXPECT_EQ(StopRule(settings, kAll, 0).wanted(), 64u);
    EXPECT_EQ(StopRule(settings, kAll, 500).wanted(), 500u);
    settings.maxBundles = 20;
    EXPECT_EQ(StopRule(settings, kAll, 0).wanted(), 20u);
}

TEST(StopRule, EndsAtTheTarget) {
    const Settings settings;
    StopRule rule(settings, kAll, 0);
    EXPECT_EQ(rule.after(64, 1.0), Stop::NOISE_AT_TARGET);
    EXPECT_FALSE(rule.isOutOfReach());
}

TEST(StopRule, WantsWhatTheSlopeForetellsAndDoublesWhereThatIsFar) {
    const Settings settings;
    StopRule rule(settings, kAll, 0);
    EXPECT_EQ(rule.after(64, 10), Stop::NOT_YET);
    EXPECT_EQ(rule.wanted(), 130u);
    EXPECT_EQ(rule.after(1000, 1.2), Stop::NOT_YET);
    EXPECT_NEAR(rule.wanted(), 1050 * std::pow(1.2, 1 / kNoiseSlope), 3);
    EXPECT_EQ(rule.wanted() % 2, 0u);
}

TEST(StopRule, SaysWhatLimitsTheBundles) {
    Settings settings;
    settings.maxBundles = 256;
    StopRule limited(settings, kAll, 0);
    EXPECT_EQ(limited.after(128, 10), Stop::NOT_YET);
    EXPECT_EQ(limited.wanted(), 256u);
    EXPECT_EQ(limited.after(256, 5), Stop::MAX_BUNDLES);
    EXPECT_EQ(limited.excess(), 5);
    StopRule uncountable(settings, 101, 0);
    EXPECT_EQ(uncountable.most(), 100u);
    EXPECT_EQ(uncountable.after(100, 5), Stop::UNCOUNTABLE_LINES);
}

TEST(StopRule, TracesAllBundlesWhereNoneAreToBeSkipped) {
    Settings settings;
    settings.maxBundles = 256;
    settings.skipBundles = 0;
    StopRule rule(settings, kAll, 0);
    EXPECT_EQ(rule.after(64, 0.5), Stop::NOT_YET);
    EXPECT_EQ(rule.after(256, 0.5), Stop::MAX_BUNDLES);
}

TEST(StopRule, GoesOnAfterRaysOnlyWhereThatIsWorthIt) {
    const Settings settings;
    StopRule rule(settings, kAll, 0);
    EXPECT_EQ(rule.afterRays(64, 1.9), Stop::NOISE_AT_TARGET);
    EXPECT_FALSE(rule.isOutOfReach());
    // A tenth more bundles would do, but all rays would be cast again for a tenth less noise.
    StopRule nearly(settings, kAll, 0);
    EXPECT_EQ(nearly.afterRays(64, 2.1), Stop::NOISE_AT_TARGET);
    EXPECT_FALSE(nearly.isOutOfReach());  // a lower target would trace these bundles
    StopRule noisy(settings, kAll, 0);
    EXPECT_EQ(noisy.afterRays(64, 6), Stop::NOT_YET);  // more than twice the target is left
    EXPECT_EQ(noisy.excess(), 3);
    EXPECT_EQ(noisy.afterRays(128, 5), Stop::NOISE_AT_TARGET);  // the noise has hardly fallen
    EXPECT_TRUE(noisy.isOutOfReach());
    StopRule hopeless(settings, kAll, 0);
    EXPECT_EQ(hopeless.afterRays(64, 20), Stop::NOISE_AT_TARGET);
    EXPECT_TRUE(hopeless.isOutOfReach());
}

}  // namespace
}  // namespace raybundle
