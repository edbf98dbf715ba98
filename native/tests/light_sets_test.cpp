// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light sets: several groups of lights baked from one trace. The light of each set equals that of a
// bake without the other lights, and the light of all sources is their sum.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "job/error.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// Both bakes solve the same system with a relative residual of at most 2e-4, from different first
// guesses. At a mean reflectance of 0.6 the light may differ by 1 / (1 - 0.6) times as much.
constexpr double kSolverTolerance = 5e-4;
// Float rounding only.
constexpr double kRounding = 1e-6;

constexpr int32_t kInstances = 4;

// A court under the sky with a box, a red panel in front of a wall, a lamp and a spot. The lights
// selected by `lit` shine. With `isSplit` panel and lamp form one set, sky and point light another,
// and the sun belongs to no set.
struct Lit {
    bool first = true, second = true, rest = true;
};
Scene court(const Lit& lit = {}, bool isSplit = false) {
    Scene scene;
    place(scene, box("box", {1, 1, 0.2f}, {2, 1.8f, 1}, false), grey("", 0.7f));
    place(scene, grid("floor", {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, 4, 4), grey("", 0.6f));
    place(scene, grid("wall", {0, 4, 0}, {4, 0, 0}, {0, 0, 3}, 4, 3), grey("", 0.5f));
    Material red = grey("red", 0.2f, lit.first ? 20.0f : 0.0f);
    red.sides[0].emission.constant *= glm::vec3(1, 0.2f, 0.1f);
    const int32_t panel =
        place(scene, rectangle("panel", {2.5f, 3.5f, 1}, {0.6f, 0, 0}, {0, 0, 0.6f}), red);
    if (isSplit) {
        EXPECT_EQ(scene.addLightSet("warm"), 0);
        EXPECT_EQ(scene.addLightSet("cold"), 1);
        scene.instances[size_t(panel)].lightSet = 0;
        scene.worldLightSet = 1;
    }
    auto add = [&](bool isLit, Light light, int32_t set) {
        if (isSplit) light.lightSet = set;
        if (isLit) scene.addLight(std::move(light));
    };
    add(lit.first, areaLight({1, 2.5, 2.6}, {0.3, 0, 0}, {0, -0.3, 0}, {5, 3, 1}), 0);
    add(lit.second, pointLight({3, 1, 2}, {0.3, 0.6, 2}), 1);
    add(lit.rest, sunLight({1, -1, 2}, {0.5, 0.4, 0.3}, 0.01), kNoLightSet);
    if (lit.second) scene.worldRadiance = {0.1f, 0.2f, 0.4f};
    return scene;
}

std::unique_ptr<Bake> baked(const Scene& scene,
                            Reconstruction reconstruction = Reconstruction::LEAST_SQUARES,
                            float megabytes = 8192, int bundleCount = 128) {
    auto bake = std::make_unique<Bake>();
    setQuick(*bake, bundleCount);
    bake->settings.reconstruction = reconstruction;
    bake->settings.memoryLimit = megabytes;
    bake->run(scene);
    return bake;
}

// Returns all outputs at all corners, by all lights or by one set.
std::vector<glm::vec3> light(const Bake& bake, int32_t set = kNoLightSet) {
    std::vector<glm::vec3> all;
    for (int32_t i = 0; i < kInstances; ++i)
        for (rb_output output :
             {RB_OUTPUT_COMBINED, RB_OUTPUT_LIGHTING, RB_OUTPUT_DIRECT, RB_OUTPUT_INDIRECT}) {
            const CornerLight& part =
                set == kNoLightSet ? bake.instanceLight(i) : bake.setLight(set, i);
            for (const glm::vec3& v : part.perCorner(output)) all.push_back(v);
        }
    return all;
}

std::vector<glm::vec3> sum(std::vector<glm::vec3> a, const std::vector<glm::vec3>& b) {
    for (size_t i = 0; i < a.size(); ++i) a[i] += b[i];
    return a;
}

// Expects that both sets of a court equal courts with only the lights of the set, from the same
// lines. `rest` selects the lights that belong to no set.
void expectSetsAsAlone(Reconstruction reconstruction, bool rest) {
    SCOPED_TRACE(choiceName(reconstruction));
    const auto together = baked(court({true, true, rest}, true), reconstruction);
    const auto first = baked(court({true, false, false}), reconstruction);
    const auto second = baked(court({false, true, false}), reconstruction);
    EXPECT_LT(difference(light(*together, 0), light(*first)), kSolverTolerance);
    EXPECT_LT(difference(light(*together, 1), light(*second)), kSolverTolerance);
    EXPECT_EQ(reportOf(*together)["lines"], reportOf(*first)["lines"]);
}

TEST(LightSets, EachIsWhatABakeOfItsLightsAloneGives) {
    for (Reconstruction reconstruction :
         {Reconstruction::LEAST_SQUARES, Reconstruction::AREA_AVERAGE, Reconstruction::POINT})
        expectSetsAsAlone(reconstruction, true);
}

TEST(LightSets, EachIsThatWhereAllLightIsInOne) {
    for (Reconstruction reconstruction :
         {Reconstruction::LEAST_SQUARES, Reconstruction::AREA_AVERAGE, Reconstruction::POINT})
        expectSetsAsAlone(reconstruction, false);
}

TEST(LightSets, AllLightIsTheSumOfTheSetsAndOfWhatIsInNone) {
    const auto together = baked(court({}, true));
    const auto rest = baked(court({false, false, true}));
    const auto parts = sum(light(*together, 0), light(*together, 1));
    EXPECT_LT(difference(light(*together), sum(parts, light(*rest))), kSolverTolerance);

    const auto allInSets = baked(court({true, true, false}, true));
    EXPECT_LT(difference(light(*allInSets), sum(light(*allInSets, 0), light(*allInSets, 1))),
              kRounding);
}

// Without sets the shadow rays of the same lights are different, and fewer in places. The noise of
// the direct light, which target_error bounds, then differs.
TEST(LightSets, AllLightIsThatOfABakeWithoutSets) {
    const auto split = baked(court({}, true)), whole = baked(court());
    EXPECT_LT(noise(light(*split), light(*whole)), 0.5 * double(split->settings.targetError));
    EXPECT_NEAR(reportOf(*split)["energy"]["emitted"].get<double>(),
                reportOf(*whole)["energy"]["emitted"].get<double>(),
                1e-2 * reportOf(*whole)["energy"]["emitted"].get<double>());
    EXPECT_LT(reportOf(*split)["energy"]["balance_error"].get<double>(), 1e-2);
}

TEST(LightSets, OfAFurnaceAreExact) {
    Scene scene = closedCube(0.6f, 0.4f);
    scene.addLightSet("glow");
    scene.instances[0].lightSet = 0;
    Bake bake;
    setQuick(bake);
    bake.run(scene);
    for (const glm::vec3& v : bake.setLight(0, 0).perCorner(RB_OUTPUT_LIGHTING))
        EXPECT_NEAR(double(v.x) * kPi, 1, 1e-3);
    EXPECT_FALSE(mentions(reportOf(bake)["warnings"], "light set"));
}

TEST(LightSets, KeepTheirLinesWhenALampChanges) {
    Scene scene = court({}, true);
    const auto bake = baked(scene);
    const auto warm = light(*bake, 0), cold = light(*bake, 1);
    const Json before = reportOf(*bake);
    scene.lights[1].strength *= glm::dvec3(2, 0.5, 0);
    scene.worldRadiance *= glm::vec3(2, 0.5f, 0);
    bake->run(scene);
    EXPECT_TRUE(skips(reportOf(*bake), SkippedWork::UNCHANGED_GEOMETRY));
    EXPECT_EQ(reportOf(*bake)["lines"], before["lines"]);
    EXPECT_LT(difference(light(*bake, 0), warm), kSolverTolerance);
    std::vector<glm::vec3> wanted = cold;
    for (glm::vec3& v : wanted) v *= glm::vec3(2, 0.5f, 0);
    EXPECT_LT(difference(light(*bake, 1), wanted), 2 * kSolverTolerance);
    // Other sets, with the same lines.
    scene.lights[1].lightSet = kNoLightSet;
    scene.lightSets.pop_back();
    scene.worldLightSet = kNoLightSet;
    bake->run(scene);
    EXPECT_TRUE(skips(reportOf(*bake), SkippedWork::UNCHANGED_GEOMETRY));
    EXPECT_LT(difference(light(*bake, 0), warm), kSolverTolerance);
    EXPECT_THROW(bake->setLight(1, 0), Error);
}

// All these bakes use the same bundles once and then discard them.
TEST(LightSets, ShareTheLinesBeyondTheMemoryLimit) {
    const auto together = baked(court({}, true), Reconstruction::LEAST_SQUARES, 2, 512);
    const auto second = baked(court({false, true, false}), Reconstruction::LEAST_SQUARES, 2, 512);
    const Json warnings = reportOf(*together)["warnings"];
    ASSERT_TRUE(mentions(warnings, "memory_limit")) << warnings;
    EXPECT_EQ(std::count_if(warnings.begin(), warnings.end(),
                            [](const Json& w) { return mentions(w, "memory_limit"); }),
              1);
    EXPECT_LT(difference(light(*together, 1), light(*second)), kSolverTolerance);
}

TEST(LightSets, AllMeetTheTargetError) {
    Bake bake;
    bake.settings.patchSize = 0.25f;
    bake.settings.targetError = 0.01f;
    bake.run(court({}, true));
    const Json report = reportOf(bake);
    ASSERT_EQ(report["light_sets"].size(), 2u);
    EXPECT_EQ(report["light_sets"][0]["name"], "warm");
    for (const Json& set : report["light_sets"]) {
        EXPECT_GT(set["estimated_error"].get<double>(), 0) << set;
        EXPECT_LE(set["estimated_error"].get<double>(), 0.01) << set;
    }
    EXPECT_LE(report["estimated_error"].get<double>(), 0.01);

    bake.settings.targetError = 1e-4f;
    bake.settings.minBundles = bake.settings.maxBundles = 64;
    bake.run(court({}, true));
    EXPECT_TRUE(mentions(reportOf(bake)["warnings"], "the noise of light set"));
}

TEST(LightSets, WithoutLightAreBlackAndNamed) {
    for (const Lit& lit : {Lit{true, false, true}, Lit{false, false, false}}) {
        const auto bake = baked(court(lit, true));
        const Json warnings = reportOf(*bake)["warnings"];
        EXPECT_TRUE(mentions(warnings, "light set \\\"cold\\\": no light"));
        for (const glm::vec3& v : light(*bake, 1)) EXPECT_EQ(v, glm::vec3(0));
        EXPECT_EQ(reportOf(*bake)["light_sets"][1]["estimated_error"], 0);
        EXPECT_EQ(mentions(warnings, "light set \\\"warm\\\": no light"), !lit.first);
    }
}

TEST(LightSets, AreForLineReuseAlone) {
    for (Solver solver : {Solver::MULTIPATH, Solver::STOCHASTIC_ITERATION, Solver::RANDOM_WALK}) {
        Bake bake;
        bake.settings.solver = solver;
        bake.settings.directions = DirectionKind::RANDOM;
        try {
            bake.run(court({}, true));
            ADD_FAILURE() << choiceName(solver) << " baked light sets";
        } catch (const Error& error) {
            EXPECT_EQ(error.code, RB_ERROR_INVALID_ARGUMENT);
            EXPECT_NE(std::string(error.what()).find("light sets"), std::string::npos)
                << error.what();
        }
    }
}

TEST(LightSets, WorkWithEveryFirstShot) {
    for (FirstShotKind kind : {FirstShotKind::SHOOT, FirstShotKind::EXTENDED}) {
        Bake together, alone;
        for (Bake* bake : {&together, &alone}) {
            setQuick(*bake);
            bake->settings.firstShot = kind;
            bake->settings.localRays = 100000;
        }
        together.run(court({}, true));
        alone.run(court({false, true, false}));
        EXPECT_LT(difference(light(together, 1), light(alone)), kSolverTolerance)
            << choiceName(kind);
    }
}

}  // namespace
}  // namespace raybundle
