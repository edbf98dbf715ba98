// SPDX-License-Identifier: GPL-3.0-or-later
//
// Single lobes against the published models.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "surfaces/lobe.h"
#include "surfaces/microfibers.h"
#include "test_bakes.h"
#include "test_bsdfs.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

void expectModel(const Lobe& lobe, const Bsdf& bsdf, const glm::dvec3& in, double tolerance) {
    const glm::dvec2 mean = moments(bsdf, in);
    forCosine(32, [&](const glm::dvec3& out, double) {
        const double expected = kPi * bsdf(in, out) / mean.x;
        EXPECT_NEAR(double(lobe.towards(out).x), expected, tolerance * expected + 1e-3);
    });
    const double contrast = std::sqrt(std::max(0.0, mean.y / (mean.x * mean.x) - 1));
    EXPECT_NEAR(double(lobe.contrast()), contrast, 0.1 * contrast + 0.01);
}

TEST(Lobe, IsTheModelOverItsMean) {
    const glm::vec3 normal(0, 0, 1);
    // The mean of gloss comes from a table that is accurate to 5 % at grazing angles.
    constexpr double kTolerance = 0.05;
    for (double roughness : {0.5, 0.7, 1.0}) {
        if (kFewBakes && roughness < 1) continue;
        const Bsdf several = severalFacets(roughness);
        for (double cosine : {1.0, 0.7, 0.3, 0.1}) {
            SCOPED_TRACE(std::to_string(cosine) + " " + std::to_string(roughness));
            const glm::dvec3 in = inclined(cosine);
            const float rough = float(roughness);
            for (rb_masking masking : {RB_MASKING_CORRELATED, RB_MASKING_SEPARATE})
                expectModel(Lobe::gloss(normal, in, masking, rough, glm::vec3(0.04f)),
                            ggx(roughness, 0.04, masking), in, kTolerance);
            expectModel(Lobe::of(LobeKind::SEVERAL_FACETS, normal, in, rough), several, in,
                        kTolerance);
            expectModel(Lobe::diffuse(normal, in, RB_DIFFUSE_BURLEY, rough), burley(roughness), in,
                        kTolerance);
            expectModel(Lobe::diffuse(normal, in, RB_DIFFUSE_OREN_NAYAR, rough),
                        orenNayar(roughness), in, kTolerance);
        }
    }
}

TEST(Lobe, OfClothIsTheModelOverItsMean) {
    const glm::vec3 normal(0, 0, 1);
    constexpr double kTolerance = 0.02;  // the mean is computed from 128 points
    for (double cosine : {0.95, 0.6, 0.2})
        for (double roughness : {0.5, 0.8, 1.0}) {
            SCOPED_TRACE(std::to_string(cosine) + " " + std::to_string(roughness));
            const glm::dvec3 in = inclined(cosine);
            const float rough = float(roughness);
            expectModel(Lobe::of(LobeKind::MICROFIBERS, normal, in, rough),
                        transformedCosine(roughness), in, kTolerance);
            expectModel(Lobe::of(LobeKind::VELVET, normal, in, rough), velvet(roughness), in,
                        kTolerance);
            expectModel(Lobe::of(LobeKind::BURLEY_SHEEN, normal, in, rough), burleySheen(), in,
                        kTolerance);
        }
}

// By reciprocity, the light that comes from all directions and leaves at an angle has the albedo of
// that angle.
TEST(Lobe, MicrofibersSendTheirAlbedo) {
    for (double cosine : {0.9, 0.5, 0.2})
        for (double roughness : {0.3, 0.65, 1.0}) {
            const Bsdf bsdf = transformedCosine(roughness);
            const glm::dvec3 out = inclined(cosine);
            double sum = 0;
            forCosine(400, [&](const glm::dvec3& in, double share) {
                sum += kPi * bsdf(in, out) * share;
            });
            const double albedo = double(Microfibers::at(float(roughness), float(cosine)).albedo);
            EXPECT_NEAR(sum, albedo, 0.01 * albedo + 1e-4) << cosine << " " << roughness;
        }
}

TEST(Lobe, HasNothingBelowTheSurfaceAndIsFiniteAtItsEdge) {
    const glm::vec3 normal(0, 0, 1);
    for (const glm::vec3& in : {glm::vec3(0, 0, 1), glm::vec3(1, 0, 1e-6f), glm::vec3(1, 0, -0.1f)})
        for (float roughness : {0.0f, 0.45f, 1.0f}) {
            const glm::vec3 to = glm::normalize(in);
            for (const Lobe& lobe :
                 {Lobe::gloss(normal, to, RB_MASKING_CORRELATED, roughness, glm::vec3(0)),
                  Lobe::gloss(normal, to, RB_MASKING_SEPARATE, roughness, glm::vec3(1)),
                  Lobe::of(LobeKind::MICROFIBERS, normal, to, roughness),
                  Lobe::of(LobeKind::VELVET, normal, to, roughness),
                  Lobe::of(LobeKind::BURLEY_SHEEN, normal, to, roughness),
                  Lobe::of(LobeKind::SEVERAL_FACETS, normal, to, roughness)}) {
                EXPECT_EQ(lobe.towards({0.6f, 0, -0.8f}), glm::vec3(0));
                for (const glm::vec3& out : {glm::vec3(0, 0, 1), glm::vec3(-1, 0, 1e-6f),
                                             glm::vec3(1, 0, 1e-6f), glm::vec3(0, 1, 1)}) {
                    const float value = lobe.towards(glm::normalize(out)).x;
                    EXPECT_TRUE(std::isfinite(value) && value >= 0) << roughness;
                }
            }
        }
}

TEST(Lobe, FindsF0ByHowTheReflectanceRises) {
    for (rb_masking masking : {RB_MASKING_CORRELATED, RB_MASKING_SEPARATE})
        for (double roughness : {0.5, 0.8, 1.0})
            for (double f0 : {0.02, 0.04, 0.3}) {
                const Bsdf bsdf = ggx(roughness, f0, masking);
                double everywhere = 0;
                constexpr int kCosines = 12, kSteps = 100;
                for (int i = 0; i < kCosines; ++i) {
                    const double cosine = (i + 0.5) / kCosines;
                    everywhere += 2 * cosine / kCosines * moments(bsdf, inclined(cosine), kSteps).x;
                }
                const double ratio = moments(bsdf, inclined(1), kSteps).x / everywhere;
                // The table is accurate to 1 %, and the ratio determines f0 less well the more is
                // mirrored.
                EXPECT_NEAR(double(Lobe::f0Of(float(ratio), masking, float(roughness))), f0,
                            0.1 * f0)
                    << roughness << " " << f0;
            }
    EXPECT_EQ(Lobe::f0Of(1.1f, RB_MASKING_CORRELATED, 0.5f), 1);
    EXPECT_NEAR(Lobe::f0Of(0.04f / (0.04f + 0.96f * 0.0534f), RB_MASKING_CORRELATED, 0), 0.04,
                1e-3);
}

}  // namespace
}  // namespace raybundle
