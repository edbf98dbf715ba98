// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/irradiance_cache.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace raybundle {
namespace {

constexpr float kFar = 10, kVariance = 1e-4f;

CachePlace onPlane(float x, float y, float nearness = 1) {
    return {{x, y, 0.0f}, {0.0f, 0.0f, 1.0f}, nearness};
}

CachedLight lightOf(float value, double variance = double(kVariance)) {
    CachedLight light;
    light.reflected = glm::vec3(value);
    light.variance = variance;
    light.allowed = variance;
    return light;
}

// Adds records on a plane at all places of a grid of `step` with |x|, |y| <= 1.
template <class ValueAt>
IrradianceCache planeOf(float step, const ValueAt& valueAt, double variance = double(kVariance)) {
    IrradianceCache cache(kFar);
    for (float x = -1; x < 1.001f; x += step)
        for (float y = -1; y < 1.001f; y += step)
            cache.add(onPlane(x, y), lightOf(valueAt(x, y), variance));
    cache.update(true);
    return cache;
}

TEST(IrradianceCache, HasNoLightBeforeItHasRecords) {
    IrradianceCache cache(kFar);
    cache.update(true);
    EXPECT_TRUE(std::isinf(cache.at(onPlane(0, 0)).variance));
    EXPECT_FALSE(cache.at(onPlane(0, 0)).isGood());
}

TEST(IrradianceCache, KeepsEvenLightExactly) {
    const IrradianceCache cache = planeOf(0.15f, [](float, float) { return 0.7f; });
    for (float x : {-0.97f, -0.33f, 0.05f, 0.61f})
        EXPECT_NEAR(double(cache.at(onPlane(x, 0.4f * x)).total().x), 0.7, 1e-6);
}

TEST(IrradianceCache, FollowsLinearLight) {
    auto value = [](float x, float y) { return 2 + x - 0.5f * y; };
    const IrradianceCache cache = planeOf(0.12f, value);
    for (float x : {-0.5f, 0.03f, 0.31f}) {
        const CachedLight light = cache.at(onPlane(x, 0.7f * x));
        // The weight of even light pulls the slope over one step by a few percent of it.
        EXPECT_NEAR(double(light.total().x), double(value(x, 0.7f * x)), 0.01) << x;
        EXPECT_LT(light.variance, 0.5 * double(kVariance)) << "the noise of records averages out";
        EXPECT_TRUE(light.isGood());
    }
}

TEST(IrradianceCache, HasTheSlopeOfLightAmongRecordsOfAnyReach) {
    IrradianceCache cache(kFar);
    auto value = [](float x, float y) { return 2 + x - 0.5f * y; };
    int count = 0;
    for (float x = -1; x < 1.001f; x += 0.1f)
        for (float y = -1; y < 1.001f; y += 0.1f)
            cache.add(onPlane(x, y, ++count % 2 ? 0.5f : 1.2f), lightOf(value(x, y)));
    cache.update(false);
    for (float x : {-0.31f, 0.03f, 0.47f}) {
        const CachePlace place = onPlane(x, 0.7f * x);
        EXPECT_NEAR(double(cache.at(place).total().x), double(value(x, 0.7f * x)), 0.003);
        const glm::vec3 off(0.05f, -0.04f, 0.0f);
        const double slope = double(cache.at(place, off).total().x - cache.at(place).total().x);
        // The weight of even light pulls the slope by 6 %.
        EXPECT_NEAR(slope, 0.07, 0.1 * 0.07) << x;
    }
}

TEST(IrradianceCache, FollowsLightThatTurnsWithTheNormal) {
    // A ball under a sky that brightens towards the zenith: light 1 + z of the normal.
    IrradianceCache cache(kFar);
    auto onBall = [](float turn, float around) {
        const glm::vec3 normal(std::sin(turn) * std::cos(around), std::sin(turn) * std::sin(around),
                               std::cos(turn));
        return CachePlace{normal, normal, 0.1f};
    };
    for (float turn = 0.1f; turn < 1.6f; turn += 0.13f)
        for (float around = 0; around < 6.2f; around += 0.13f / std::sin(turn))
            cache.add(onBall(turn, around), lightOf(1 + std::cos(turn)));
    // The light is not linear over the first reach of the records, which is therefore shortened.
    for (int k = 0; k < 4; ++k) cache.update(true);
    for (float turn : {0.4f, 0.83f, 1.2f}) {
        const CachedLight light = cache.at(onBall(turn, 1.0f));
        EXPECT_NEAR(double(light.total().x), 1 + std::cos(double(turn)), 0.02) << turn;
    }
}

TEST(IrradianceCache, DoesNotReachAcrossAWall) {
    // A wall at x = 0 on a floor. A cosine-weighted mean of the inverse distances to the wall is
    // 2 / (3 pi) times the inverse of the distance.
    auto floorAt = [](float x) { return onPlane(x, 0, 0.212f / std::abs(x)); };
    for (float beside : {0.1f, 0.5f, 1.0f, 1.6f, 3.0f, 10.0f}) {
        IrradianceCache cache(kFar);
        cache.add(floorAt(-beside), lightOf(1));
        cache.update(true);
        EXPECT_TRUE(std::isinf(cache.at(floorAt(1)).variance)) << beside;
        EXPECT_FALSE(std::isinf(cache.at(floorAt(-1.05f * beside)).variance)) << beside;
    }
}

TEST(IrradianceCache, DoesNotReachAnotherLayerOrTheOtherSide) {
    IrradianceCache cache(kFar);
    cache.add(onPlane(0, 0), lightOf(1));
    cache.update(true);
    EXPECT_FALSE(std::isinf(cache.at(onPlane(0.1f, 0)).variance));
    CachePlace below = onPlane(0, 0);
    below.position.z = -0.15f;
    EXPECT_TRUE(std::isinf(cache.at(below).variance));
    CachePlace back = onPlane(0, 0);
    back.normal.z = -1;
    EXPECT_TRUE(std::isinf(cache.at(back).variance));
}

TEST(IrradianceCache, FindsRecordsFarFromTheOriginAndInNarrowGaps) {
    for (float nearness : {0.0f, 1.0f, 1e6f, 1e30f}) {
        IrradianceCache cache(0.01f);
        CachePlace far = onPlane(3e4f, -2e4f, nearness);
        cache.add(far, lightOf(0.5f));
        for (int k = 0; k < 50; ++k) cache.update(true);
        EXPECT_NEAR(double(cache.at(far).total().x), 0.5, 1e-6) << nearness;
    }
}

// Records of reaches from 0.001 to 3 m, which lie in grids of a dozen widths.
TEST(IrradianceCache, TellsWhereNewRecordsHaveChangedTheLight) {
    IrradianceCache cache(kFar);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(-1, 1);
    auto anyPlace = [&] {
        return onPlane(uniform(random), uniform(random), std::pow(10.0f, 1.5f * uniform(random)));
    };
    std::vector<CachePlace> places;
    for (int k = 0; k < 400; ++k) places.push_back(anyPlace());
    auto lightThere = [&] {
        std::vector<float> light;
        for (const CachePlace& place : places) light.push_back(cache.at(place).total().x);
        return light;
    };
    auto add = [&](int count) {
        for (int k = 0; k < count; ++k) cache.add(anyPlace(), lightOf(1 + uniform(random)));
        cache.update(false);
    };
    add(300);
    const std::vector<float> before = lightThere();
    add(40);
    const std::vector<float> after = lightThere();
    int changed = 0, unchanged = 0;
    for (size_t k = 0; k < places.size(); ++k) {
        EXPECT_TRUE(cache.isReachedSince(0, places[k]) || after[k] == 0.0f);
        if (cache.isReachedSince(300, places[k])) {
            changed += before[k] != after[k];
            continue;
        }
        EXPECT_EQ(before[k], after[k]);
        ++unchanged;
    }
    EXPECT_GT(changed, 40);
    EXPECT_GT(unchanged, 40);
}

TEST(IrradianceCache, ReachesLessFarWhereLightHasAStep) {
    auto step = [](float x, float) { return x < 0.01f ? 1.0f : 0.0f; };
    IrradianceCache cache = planeOf(0.05f, step, 1e-6);
    const double before = std::abs(double(cache.at(onPlane(-0.08f, 0.02f)).total().x) - 1);
    for (int k = 0; k < 6; ++k) cache.update(true);
    const double after = std::abs(double(cache.at(onPlane(-0.08f, 0.02f)).total().x) - 1);
    EXPECT_LT(after, 0.01);
    EXPECT_LE(after, before);
    // Far from the step, noise of this size is no reason to reach less far.
    EXPECT_FALSE(std::isinf(cache.at(onPlane(-0.7f, 0)).variance));
}

}  // namespace
}  // namespace raybundle
