// SPDX-License-Identifier: GPL-3.0-or-later
//
// Drafts whose light is scaled while the strengths of some sources change.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "job/error.h"
#include "test_bakes.h"
#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

// A room with an opening to the world, a box, two lamps, and a mesh lamp of a material of its own.
// With `isSplit` the second lamp and the mesh lamp are in one light set, the world in another.
// Faces are about as small as patches: on larger faces the fit to the corners, which keeps values
// within the range of the light around them, is not linear in the light.
Scene openRoom(bool isSplit = false) {
    Scene scene;
    place(scene, grid("floor", {0, 0, 0}, {4, 0, 0}, {0, 3, 0}, 12, 9), grey("floor", 0.5f));
    place(scene, grid("wall", {0, 3, 0}, {4, 0, 0}, {0, 0, 3}, 12, 9), grey("wall", 0.5f));
    place(scene, box("box", {1, 1, 0}, {1.3f, 1.3f, 0.3f}, false), grey("box", 0.5f));
    place(scene, grid("ceiling", {0, 0, 3}, {0, 3, 0}, {4, 0, 0}, 9, 12), grey("ceiling", 0.5f));
    place(scene, grid("side", {0, 0, 0}, {0, 3, 0}, {0, 0, 3}, 9, 9), grey("side", 0.5f));
    const int32_t panel =
        place(scene, rectangle("lamp", {2.5f, 1, 2.7f}, {0, 0.6f, 0}, {0.6f, 0, 0}),
              grey("lamp", 0.5f, 60));
    scene.addLight(pointLight({0.5, 0.5, 2}, {1, 0.8, 0.6}));
    scene.addLight(areaLight({3, 2.5, 2.6}, {0.3, 0, 0}, {0, -0.2, 0}, {8, 8, 8}));
    scene.worldRadiance = {0.1f, 0.2f, 0.3f};
    if (!isSplit) return scene;
    scene.addLightSet("warm");
    scene.addLightSet("cold");
    scene.lights[1].lightSet = scene.instances[size_t(panel)].lightSet = 0;
    scene.worldLightSet = 1;
    return scene;
}

using Change = void (*)(Scene&, double);

void dimLamp(Scene& scene, double factor) { scene.lights[1].strength *= factor; }
// Both lamps become redder, by the same factors.
void redden(Scene& scene, double factor) {
    for (Light& lamp : scene.lights) lamp.strength *= glm::dvec3(factor, 1, 1 / factor);
}
void dimMesh(Scene& scene, double factor) {
    for (Material& material : scene.materials)
        for (MaterialSide& side : material.sides) side.emission.constant *= float(factor);
}
void dimWorld(Scene& scene, double factor) { scene.worldRadiance *= float(factor); }

void setDraft(Bake& bake) {
    setQuick(bake);
    bake.settings.draft = 1;
}

Scene changed(Change change, double factor, bool isSplit = false) {
    Scene scene = openRoom(isSplit);
    change(scene, factor);
    return scene;
}

// Runs three drafts, of which the third is scaled, from strengths times 1, `second` and `third`.
void runThree(Bake& bake, Change change, double second, double third) {
    setDraft(bake);
    for (const double factor : {1.0, second, third}) {
        bake.run(changed(change, factor));
        EXPECT_EQ(skips(reportOf(bake), SkippedWork::SCALED_DRAFT), factor == third) << factor;
    }
    EXPECT_EQ(reportOf(bake)["shadow_rays"], 0);
}

// Expects the light of a draft of the same scene without scaling, to within the noise of both,
// which is independent in the direct light.
void expectAsFresh(const Bake& scaled, const Scene& scene) {
    Bake fresh;
    setDraft(fresh);
    fresh.run(scene);
    const double both = std::sqrt(2) * double(reportOf(fresh)["error"]["noise"]);
    EXPECT_LT(noise(everything(scaled), everything(fresh)), both);
    for (size_t set = 0; set < scene.lightSets.size(); ++set) {
        const double ofSet = reportOf(fresh)["light_sets"][set]["estimated_error"];
        for (int32_t i = 0; i < 3; ++i)
            EXPECT_LT(noise(scaled.setLight(int32_t(set), i).perCorner(RB_OUTPUT_COMBINED),
                            fresh.setLight(int32_t(set), i).perCorner(RB_OUTPUT_COMBINED)),
                      std::max(both, std::sqrt(2) * ofSet))
                << set;
    }
    const Json report = reportOf(scaled), energy = reportOf(fresh)["energy"];
    for (const char* part : {"emitted", "absorbed", "escaped"})
        EXPECT_NEAR(report["energy"][part], energy[part], both * double(energy["emitted"])) << part;
    EXPECT_EQ(report["light_sets"].size(), scene.lightSets.size());
    EXPECT_FALSE(mentions(report["warnings"], "light set \"\""));
}

TEST(DraftLight, IsScaledWhileStrengthsChange) {
    for (const Change change : {dimLamp, redden, dimMesh, dimWorld})
        for (const double third : {0.2, 1.3, 6.0}) {
            SCOPED_TRACE(third);
            Bake scaled;
            runThree(scaled, change, 1.1, third);
            expectAsFresh(scaled, changed(change, third));
        }
}

TEST(DraftLight, OfALoneLampIsProportional) {
    auto room = [](const glm::dvec3& strength) {
        Scene scene = roomWithBoxes(0.5f);
        scene.addLight(pointLight({0.5, 0.5, 2}, strength));
        return scene;
    };
    Bake bake;
    setDraft(bake);
    bake.run(room({1, 1, 1}));
    bake.run(room({2, 1, 0.5}));
    const std::vector<glm::vec3> before = everything(bake);
    const std::vector<float> error = bake.instanceLight(0).error;
    const std::vector<glm::vec3> onPatches = bake.patchIrradiance().indirect;
    // Each step rounds by up to 6e-8 of light that is up to 15 times as bright as the last.
    for (int step = 0; step < 50; ++step) bake.run(room({2 + step, 1 + 0.01 * step, 0.5}));
    bake.run(room({6, 0.1, 0.5}));
    ASSERT_TRUE(skips(reportOf(bake), SkippedWork::SCALED_DRAFT));
    std::vector<glm::vec3> expected = before;
    for (glm::vec3& value : expected) value *= glm::vec3(3, 0.1f, 1);
    for (int c = 0; c < 3; ++c) {
        std::vector<glm::vec3> is = everything(bake), should = expected;
        for (auto* values : {&is, &should})
            for (glm::vec3& value : *values) value = glm::vec3(value[c]);
        EXPECT_LT(difference(is, should), 5e-5) << c;
    }
    for (size_t side = 0; side < onPatches.size(); ++side)
        EXPECT_NEAR(bake.patchIrradiance().indirect[side].x, 3 * onPatches[side].x,
                    5e-5f * onPatches[side].x);
    // Relative to the brightest channel, which is three times as bright.
    for (size_t c = 0; c < error.size(); ++c)
        EXPECT_NEAR(bake.instanceLight(0).error[c], 3 * error[c], 1e-3f * error[c]);
}

TEST(DraftLight, OfAnUnchangedSceneIsKept) {
    Bake bake;
    setDraft(bake);
    bake.run(openRoom());
    const std::vector<glm::vec3> before = everything(bake);
    bake.run(openRoom());
    EXPECT_TRUE(skips(reportOf(bake), SkippedWork::SCALED_DRAFT));
    EXPECT_EQ(everything(bake), before);
}

TEST(DraftLight, IsComputedAnewWhenAnythingElseChanges) {
    const std::vector<std::function<void(Scene&)>> changes = {
        [](Scene& s) { s.lights[1].position.x += 0.1; },
        [](Scene& s) { s.lights[1].castsShadows = false; },
        [](Scene& s) { s.lights[0].radius = 0.1; },
        [](Scene& s) { s.lights.pop_back(); },
        [](Scene& s) {
            s.lights[0].strength = {1, 0.8, 0};
        },  // another source
        [](Scene& s) {
            s.worldImage = {2, 1, {glm::vec3(0.1f), glm::vec3(0.2f)}};
        },
        [](Scene& s) { s.materials[0].sides[0].reflectance.constant.y = 0.4f; },
        [](Scene& s) { s.materials[0].sides[0].translucence.constant.y = 0.1f; },
        [](Scene& s) { s.materials[0].sides[0].scattering.glossOffset = glm::vec3(0.2f); },
        [](Scene& s) { s.materials[0].sides[0].colorScale = glm::vec3(0.5f); },
        [](Scene& s) { s.materials[0].opacity = 0.5f; },
        [](Scene& s) { s.meshes[0].vertices[0].x -= 0.1f; },
        [](Scene& s) {
            s.meshes[0].cornerNormals.resize(s.meshes[0].cornerCount(), {0, 0, 1});
        },
        [](Scene& s) {
            s.meshes[0].cornerColors.resize(s.meshes[0].cornerCount(), {1, 0, 0});
        },
        [](Scene& s) { s.instances[1].transform[3].x += 0.1; },
        [](Scene& s) { s.instances[1].role = RB_ROLE_OCCLUDE; },
        [](Scene& s) { s.instances[1].noiseFactor = 2; },
        [](Scene& s) { s.instances[1].exchanges = false; },
        [](Scene& s) { s.addLightSet("new"); },
    };
    for (size_t k = 0; k < changes.size(); ++k) {
        Bake bake;
        runThree(bake, dimLamp, 1.1, 1.2);
        Scene scene = changed(dimLamp, 1.3);
        changes[k](scene);
        bake.run(scene);
        EXPECT_FALSE(skips(reportOf(bake), SkippedWork::SCALED_DRAFT)) << k;
    }
    Bake bake;
    runThree(bake, dimLamp, 1.1, 1.2);
    bake.settings.seed = 7;
    bake.run(changed(dimLamp, 1.2));
    EXPECT_FALSE(skips(reportOf(bake), SkippedWork::SCALED_DRAFT));
}

TEST(DraftLight, IsNotScaledWhereSourcesChangeByDifferentFactors) {
    Bake bake;
    runThree(bake, redden, 1.1, 1.2);
    Scene scene = changed(redden, 1.2);
    scene.lights[0].strength *= 2.0;
    bake.run(scene);
    EXPECT_FALSE(skips(reportOf(bake), SkippedWork::SCALED_DRAFT));
    expectAsFresh(bake, scene);
}

TEST(DraftLight, IsScaledAfterOneDraftWhenTheNextLampChanges) {
    Bake bake;
    runThree(bake, dimLamp, 1.1, 3);
    for (const double factor : {1.1, 2.0}) {
        Scene scene = changed(dimLamp, 3);
        scene.lights[0].strength *= factor;
        bake.run(scene);
        EXPECT_EQ(skips(reportOf(bake), SkippedWork::SCALED_DRAFT), factor == 2);
        expectAsFresh(bake, scene);
    }
}

TEST(DraftLight, OfASourceThatWasDarkIsComputed) {
    Bake bake;
    setDraft(bake);
    for (const double factor : {1.0, 0.0, 2.0}) {
        bake.run(changed(dimLamp, factor));
        EXPECT_FALSE(skips(reportOf(bake), SkippedWork::SCALED_DRAFT));
        expectAsFresh(bake, changed(dimLamp, factor));
    }
}

// The results of light sets, their errors and the warnings about them come from all stages.
TEST(DraftLight, OfLightSetsIsComputed) {
    for (const Change change : {dimLamp, dimMesh, dimWorld}) {
        Bake bake;
        setDraft(bake);
        for (const double factor : {1.0, 1.1, 2.5}) {
            bake.run(changed(change, factor, true));
            EXPECT_FALSE(skips(reportOf(bake), SkippedWork::SCALED_DRAFT));
        }
        expectAsFresh(bake, changed(change, 2.5, true));
        EXPECT_FALSE(warns(reportOf(bake), WarningId::DARK_LIGHT_SET));
    }
}

TEST(DraftLight, AlongKeptLinesIsThatOfNewlyChosenLines) {
    // Light that gloss sends by direction comes along lines that the drafts of a drag keep. Without
    // the solution of the draft before, a later draft is equal to a first one to the last bit.
    auto glossyRoom = [](double x) {
        Scene scene = roomWithBoxes(0.5f);
        for (Material& material : scene.materials) {
            material.sides[0].scattering.glossRoughness = 0.3f;
            material.sides[0].scattering.glossScale = glm::vec3(0.3f);
        }
        scene.addLight(pointLight({1, 1, 2}, {3, 5, 2}));
        scene.addLight(pointLight({x, 2, 1.5}, {5, 3, 2}));
        scene.addLight(pointLight({3.5, 0.5, 2.5}, {4, 4, 4}));
        return scene;
    };
    auto dragged = [&](const std::vector<double>& places) {
        Bake bake;
        setDraft(bake);
        bake.settings.skipWarmStart = 0;
        bake.run(glossyRoom(1));
        for (const double x : places) bake.run(glossyRoom(x));
        return everything(bake);
    };
    const std::vector<glm::vec3> first = dragged({2.5}), later = dragged({1.5, 2, 2.5});
    EXPECT_GT(noise(dragged({2}), first), 1e-3);
    EXPECT_EQ(difference(later, first), 0);
}

TEST(DraftLight, DoesNotChangeLaterBakes) {
    Bake after, fresh;
    runThree(after, dimLamp, 1.1, 5);
    after.settings.draft = 0;
    after.run(changed(dimLamp, 5));
    setQuick(fresh);
    fresh.run(changed(dimLamp, 5));
    EXPECT_FALSE(skips(reportOf(after), SkippedWork::SCALED_DRAFT));
    // Both bakes have the noise that they state, and share that of the lines.
    EXPECT_LT(noise(everything(after), everything(fresh)),
              double(reportOf(fresh)["estimated_error"]));
}

TEST(DraftLight, IsWholeAfterACancellation) {
    Bake bake;
    runThree(bake, dimLamp, 1.1, 1.2);
    const std::vector<glm::vec3> before = everything(bake);
    bake.progress = Progress([](void*, rb_stage, double) { return false; }, nullptr);
    Scene moved = changed(dimLamp, 1.3);
    moved.lights[0].position.x += 0.1;
    EXPECT_THROW(bake.run(moved), Error);
    EXPECT_EQ(everything(bake), before);
    bake.progress = Progress();
    bake.run(changed(dimLamp, 2));
    expectAsFresh(bake, changed(dimLamp, 2));
}

}  // namespace
}  // namespace raybundle
