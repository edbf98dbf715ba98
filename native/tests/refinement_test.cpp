// SPDX-License-Identifier: GPL-3.0-or-later
//
// Cut tiles as patches, and the tiles that refinement cuts.
#include "refinement/refinement.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>

#include "bake/bake.h"
#include "patches/neighbours.h"
#include "patches/tiles.h"
#include "test_bakes.h"
#include "test_scenes.h"
#include "transport/line_reuse.h"

namespace raybundle {
namespace {

using namespace test;

// Returns levels 0 to 5 in random order.
std::vector<uint8_t> mixedLevels(size_t tiles) {
    std::mt19937 random(1);
    std::vector<uint8_t> levels(tiles);
    for (uint8_t& level : levels) level = uint8_t(random() % 6);
    return levels;
}

// A parallelogram and a triangle.
Scene twoShapes() {
    Scene scene;
    place(scene, rectangle("skewed", {0, 0, 0}, {1.7f, 0.2f, 0.1f}, {0.3f, 1.1f, -0.4f}),
          grey("", 0.5f));
    place(scene, polygons("triangle", {{0, 0, 1}, {2, 0.3f, 1}, {0.4f, 1.5f, 1.2f}}, {{0, 1, 2}}),
          grey("", 0.5f));
    return scene;
}

Patches cutShapes(float size) {
    const Scene scene = twoShapes();
    Patches patches = subdivide(scene, size, kMany);
    cutTiles(scene, patches, mixedLevels(patches.count()));
    return patches;
}

TEST(CutTiles, PatchesFindTheirPoints) {
    for (float size : {3.0f, 0.5f, 0.11f}) {
        const Patches patches = cutShapes(size);
        for (uint32_t p = 0; p < patches.count(); ++p)
            for (glm::vec2 uv : kInside)
                ASSERT_EQ(patches.patchAt(patches.parentOf[p], patches.point(p, uv)), p);
    }
}

TEST(CutTiles, AreasAreConserved) {
    for (float size : {3.0f, 0.5f, 0.11f}) {
        const Patches patches = cutShapes(size);
        double sum = 0;
        for (uint32_t p = 0; p < patches.count(); ++p) {
            sum += double(patches.area[p]);
            const Parent& parent = patches.parents[patches.parentOf[p]];
            const glm::vec3 o = patches.point(p, {0, 0});
            const float area =
                glm::length(glm::cross(patches.point(p, {1, 0}) - o, patches.point(p, {0, 1}) - o));
            ASSERT_NEAR(patches.area[p], parent.isTriangle ? area / 2 : area, 1e-2f * area);
        }
        EXPECT_NEAR(sum, patches.totalArea, 1e-5 * sum);
    }
}

// The patches have no gaps: each point of a parent lies in the patch that is found for it.
TEST(CutTiles, EveryPointLiesInItsPatch) {
    const Patches patches = cutShapes(0.4f);
    std::mt19937 random(2);
    std::uniform_real_distribution<float> uniform;
    for (const Parent& parent : patches.parents)
        for (int i = 0; i < 20000; ++i) {
            glm::vec2 st(uniform(random), uniform(random));
            if (parent.isTriangle && st.x + st.y > 1) st = 1.0f - st;
            const uint32_t patch = parent.patchAt(st.x, st.y);
            const glm::vec2 o = parent.pointOn(patch, {0, 0});
            const glm::vec2 a = parent.pointOn(patch, {1, 0}) - o,
                            b = parent.pointOn(patch, {0, 1}) - o, d = st - o;
            const float det = a.x * b.y - a.y * b.x;
            const float u = (d.x * b.y - d.y * b.x) / det, v = (a.x * d.y - a.y * d.x) / det;
            constexpr float kRounding = 1e-3f;
            ASSERT_GE(std::min(u, v), -kRounding);
            ASSERT_LE(parent.isTriangle ? u + v : std::max(u, v), 1 + kRounding);
        }
}

// As LineCounts.LinesOfAPatchFollowItsAreaAtAnySize, with the same tolerance.
TEST(CutTiles, LinesFollowTheArea) {
    Scene scene;
    place(scene, icosphere("ball", 1, 2, true), grey("", 0.5f));
    Patches patches = subdivide(scene, 10, kMany);
    std::vector<uint8_t> levels(patches.count(), 0);
    for (size_t tile = 0; tile < levels.size(); ++tile) levels[tile] = uint8_t(tile % 3);
    cutTiles(scene, patches, levels);
    constexpr uint32_t kCount = 2048;
    constexpr float kPixel = 0.05f;
    const LineCounts counts = traceLines(patches, kPixel, kCount);
    for (uint32_t p = 0; p < patches.count(); ++p) {
        const double wanted = kCount * double(patches.area[p]) / (2 * double(kPixel) * kPixel);
        EXPECT_LT(std::abs(linesOf(counts, 2 * p) - wanted), 4 * std::sqrt(wanted)) << p;
    }
}

// Returns the cuts after a coarse first shot with this target error.
Cuts cutsOf(const Scene& scene, const Patches& patches, size_t most = kMany,
            float targetError = 0.02f) {
    const Visibility visibility(patches);
    const DirectLight light(scene, patches, visibility, 1);
    std::vector<uint32_t> all(patches.sideCount());
    std::iota(all.begin(), all.end(), 0u);
    std::vector<CoarseShot> shots{{std::vector<Gathered>(all.size()), {}}};
    light.shootCoarsely(
        shots[0], all,
        [&](size_t side) {
            return Receiver{uint32_t(side), patches.normal(uint32_t(side)), std::nullopt,
                            uint32_t(side)};
        },
        [](double) {});
    return worthwhileCuts(scene, patches, shots, most, targetError);
}

// A plane of 4 m under a lamp 3 m above it, with a blocker between them if `hasBlocker`.
Scene litPlane(bool hasBlocker) {
    Scene scene;
    place(scene, rectangle("plane", {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}), grey("", 0.5f));
    if (hasBlocker)
        place(scene, rectangle("blocker", {-0.5f, -0.5f, 1}, {1, 0, 0}, {0, 1, 0}), grey("", 0.5f));
    scene.addLight(areaLight({0, 0, 3}, {0.1, 0, 0}, {0, -0.1, 0}, {50, 50, 50}));
    return scene;
}

TEST(Refinement, CutsTheShadowEdgeOfABlockerAndNothingElse) {
    const Scene scene = litPlane(true);
    const Patches patches = subdivide(scene, 0.2f, kMany);
    const std::vector<uint8_t> levels = cutsOf(scene, patches, kMany, 0.005f).levels;
    // The blocker is at a third of the height of the lamp. Its shadow is 1.5 m wide, and the edge
    // extends by half the lamp, 0.1 m, to both sides.
    constexpr float kEdge = 0.75f, kWidth = 0.1f, kTile = 0.2f;
    for (uint32_t tile = 0; tile < patches.count(); ++tile) {
        if (patches.parents[patches.parentOf[tile]].instance != 0) continue;
        const glm::vec3 centre = patches.point(tile, {0.5f, 0.5f}) + glm::vec3(patches.centre);
        const float off = std::max(std::abs(centre.x), std::abs(centre.y)) - kEdge;
        if (std::abs(off) < 0.25f * kTile) {
            EXPECT_GT(levels[tile], 0)
                << "the edge passes through " << centre.x << ", " << centre.y;
        }
        if (std::abs(off) > kWidth + kTile) {
            EXPECT_EQ(levels[tile], 0) << centre.x << ", " << centre.y;
        }
    }
}

TEST(Refinement, LeavesAnEvenlyLitPlaneAsItIs) {
    const Scene scene = litPlane(false);
    const Patches patches = subdivide(scene, 0.2f, kMany);
    EXPECT_EQ(cutsOf(scene, patches).count(), 0u);
}

TEST(Refinement, CutsNothingThatTheTargetDoesNotNeed) {
    const Scene scene = litPlane(true);
    const Patches patches = subdivide(scene, 0.2f, kMany);
    const size_t fine = cutsOf(scene, patches, kMany, 0.005f).count();
    EXPECT_GT(fine, 0u);
    EXPECT_LE(cutsOf(scene, patches, kMany, 0.02f).count(), fine);
    EXPECT_EQ(cutsOf(scene, patches, kMany, 0.5f).count(), 0u);
}

TEST(Refinement, KeepsToMaxPatches) {
    const Scene scene = litPlane(true);
    const Patches patches = subdivide(scene, 0.2f, kMany);
    const size_t tiles = patches.count();
    for (size_t more : {0, 2, 30, 100}) {
        const Cuts cuts = cutsOf(scene, patches, more, 0.005f);
        if (cuts.count() == 0) continue;
        Patches cut = patches;
        cutTiles(scene, cut, cuts.levels);
        EXPECT_LE(cut.count(), tiles + more);
        EXPECT_EQ(cut.count(), tiles + 3 * cuts.count());
    }
    EXPECT_EQ(cutsOf(scene, patches, 2, 0.005f).count(), 0u);
    EXPECT_EQ(cutsOf(scene, patches, 100, 0.005f).count(), 33u);
}

TEST(Refinement, IsTheSameForAnyNumberOfThreads) {
    const Scene scene = litRoom();
    const Patches patches = subdivide(scene, 0.3f, kMany);
    std::vector<uint8_t> levels[2];
    for (int threads : {1, 4})
        tbb::task_arena(threads).execute(
            [&] { levels[threads > 1] = cutsOf(scene, patches).levels; });
    EXPECT_EQ(levels[0], levels[1]);
    EXPECT_GT(*std::max_element(levels[0].begin(), levels[0].end()), 0);
}

void bakeRefined(Bake& bake, const Scene& scene, int threads = 0) {
    setQuick(bake);
    bake.settings.refine = 1;
    bake.settings.contacts = 0;
    bake.settings.threads = threads;
    // The number of bundles is fixed. A low target makes cuts pay.
    bake.settings.targetError = 0.003f;
    bake.run(scene);
}

TEST(CutTiles, KeepTheirNeighbours) {
    const Scene scene = roomWithBoxes(0.5f);
    Patches patches = subdivide(scene, 0.3f, 1 << 20);
    auto pairsOf = [&] {
        std::vector<std::pair<uint32_t, uint32_t>> pairs;
        for (const TilePair& pair : neighbouringTiles(patches, 0, uint32_t(patches.parents.size())))
            pairs.emplace_back(pair.first, pair.second);
        return pairs;
    };
    const auto before = pairsOf();
    cutTiles(scene, patches, mixedLevels(patches.count()));
    EXPECT_EQ(pairsOf(), before);
}

TEST(CutTiles, AFurnaceStaysExact) {
    Patches patches = subdivide(roomWithBoxes(0.5f), 0.5f, kMany);
    std::vector<uint8_t> levels = mixedLevels(patches.count());
    for (uint8_t& level : levels) level = uint8_t(level / 2);
    cutTiles(roomWithBoxes(0.5f), patches, levels);
    FirstShot shot;
    shot.irradiance.resize(patches.sideCount());
    for (const glm::vec3& rho : patches.reflectance) shot.emission.push_back(1.0f - rho);
    const LineCounts counts = traceLines(patches, 0.1f, 64);
    const std::vector<float> exposed;
    std::vector<glm::vec3> reflected(patches.sideCount());
    const Irradiance h = LineReuse(patches, counts, shot, glm::vec3(0.0f), exposed)
                             .solve(Half::BOTH, 1e-6f, reflected);
    size_t met = 0;
    for (uint32_t side = 0; side < patches.sideCount(); side += 2) {
        if (!(linesOf(counts, side) > 0)) continue;
        ++met;
        for (int c = 0; c < 3; ++c)
            ASSERT_NEAR((h.direct[side] + h.indirect[side])[c], 1, 1e-5f) << side;
    }
    EXPECT_GT(met, 1000u);
}

TEST(CutTiles, LetThroughWhatTheTileLetsThrough) {
    Scene scene = twoShapes();
    for (Material& material : scene.materials) material.opacity = 0.25f;
    Patches patches = subdivide(scene, 0.5f, kMany);
    double before = 0, after = 0;
    for (float area : patches.area) before += double(area);
    cutTiles(scene, patches, mixedLevels(patches.count()));
    for (float area : patches.area) after += double(area);
    EXPECT_NEAR(before, 0.25 * patches.totalArea, 1e-5);
    EXPECT_NEAR(after, before, 1e-5);
    ASSERT_EQ(patches.opacity.size(), patches.count());
    for (float opacity : patches.opacity) EXPECT_EQ(opacity, 0.25f);
}

TEST(Tiles, AreThePatchesOfAnUncutSubdivision) {
    const Scene scene = twoShapes();
    const Patches uncut = subdivide(scene, 0.3f, kMany);
    Patches cut = uncut;
    cutTiles(scene, cut, mixedLevels(uncut.count()));
    const Tiles tiles(cut);
    ASSERT_EQ(tiles.patches().count(), uncut.count());
    EXPECT_EQ(tiles.patches().parentOf, uncut.parentOf);
    for (uint32_t tile = 0; tile < uncut.count(); ++tile) {
        EXPECT_NEAR(tiles.patches().area[tile], uncut.area[tile], 1e-5f * uncut.area[tile]);
        EXPECT_EQ(tiles.patches().point(tile, {0.3f, 0.4f}), uncut.point(tile, {0.3f, 0.4f}));
    }
    // A linear function of the position: its mean over a tile is the value at the centre.
    std::vector<float> values, areas, errors(cut.sideCount(), 0.5f);
    for (uint32_t side = 0; side < cut.sideCount(); ++side) {
        const bool isTriangle = cut.parentAt(side).isTriangle;
        const glm::vec3 at = cut.point(side / 2, glm::vec2(isTriangle ? 1.0f / 3 : 0.5f));
        values.push_back(1 + at.x + 2 * at.y + float(side % 2));
        areas.push_back(cut.area[side / 2]);
    }
    const std::vector<float> mean = tiles.mean(values, areas), sum = tiles.sum(areas),
                             error = tiles.errorOfMean(errors);
    for (uint32_t side = 0; side < tiles.sideCount(); ++side) {
        const bool isTriangle = uncut.parentAt(side).isTriangle;
        const glm::vec3 at = uncut.point(side / 2, glm::vec2(isTriangle ? 1.0f / 3 : 0.5f));
        EXPECT_NEAR(mean[side], 1 + at.x + 2 * at.y + float(side % 2), 1e-4f);
        EXPECT_NEAR(sum[side], uncut.area[side / 2], 1e-4f * sum[side]);
        // The mean of 4^level independent errors.
        EXPECT_NEAR(error[side], std::ldexp(0.5f, -tiles.level(side / 2)), 1e-4f);
    }
}

// If the light of the sources is weak compared with that of the surfaces, no cut pays.
TEST(RefinedBake, AFurnaceWithAFaintLampIsLeftAsItIs) {
    Scene scene = roomWithBoxes(0.5f, 0.5f);
    scene.addLight(pointLight({0.5, 0.5, 2}, glm::vec3(1e-6f)));
    Bake bake;
    bakeRefined(bake, scene);
    EXPECT_TRUE(reportOf(bake)["refined"].empty());
    for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_LIGHTING))
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(double(light[c]) * kPi, 1, 1e-4);
}

TEST(RefinedBake, KeepsTheEnergy) {
    Bake bake;
    bakeRefined(bake, litRoom());
    EXPECT_FALSE(reportOf(bake)["refined"].empty());
    const double error = reportOf(bake)["energy"]["balance_error"];
    // The error is that of the shadow rays in the first shot: a few per mille with these patches.
    EXPECT_LT(error, 0.01);
}

TEST(RefinedBake, IsTheSameForAnyNumberOfThreads) {
    const Scene scene = litRoom();
    Bake one, four;
    bakeRefined(one, scene, 1);
    bakeRefined(four, scene, 4);
    EXPECT_LT(difference(everything(one), everything(four)), 1e-5);
}

TEST(RefinedBake, WithoutACutIsTheBakeWithoutIt) {
    Bake with, without;
    bakeRefined(with, litPlane(false));
    setQuick(without);
    without.settings.refine = 0;
    without.settings.targetError = with.settings.targetError;
    without.run(litPlane(false));
    EXPECT_EQ(cornerLight(with, 0, RB_OUTPUT_LIGHTING),
              cornerLight(without, 0, RB_OUTPUT_LIGHTING));
}

TEST(RefinedBake, LightSetsAreThoseOfTheSum) {
    Scene scene = litRoom();
    Bake all;
    bakeRefined(all, scene);
    ASSERT_FALSE(reportOf(all)["refined"].empty());
    Scene sets = litRoom();
    sets.addLightSet("lamps");
    for (Light& light : sets.lights) light.lightSet = 0;
    Bake bake;
    bakeRefined(bake, sets);
    EXPECT_EQ(bake.patches().count(), all.patches().count());
    EXPECT_LT(difference(everything(bake), everything(all)), 1e-3);
}

TEST(RefinedBake, RelightingKeepsThePatches) {
    Bake bake;
    bakeRefined(bake, litRoom());
    const size_t patches = bake.patches().count();
    EXPECT_FALSE(reportOf(bake)["refined"].empty());
    Scene dark = roomWithBoxes(0.6f);
    dark.addLight(pointLight({1, 1, 2}, {1, 5, 2}));
    bake.run(dark);
    EXPECT_EQ(bake.patches().count(), patches);
    EXPECT_TRUE(skips(reportOf(bake), SkippedWork::UNCHANGED_GEOMETRY));
}

// The patches of the painter, and patches that are drawn one by one, equal those of the rasteriser.
TEST(RefinedBake, ProjectorsThatDrawPatchesAgree) {
    const Scene scene = litRoom();
    Bake exact;
    setQuick(exact, 512);
    exact.settings.refine = 1;
    exact.settings.targetError = 0.003f;
    exact.run(scene);
    for (ProjectorKind projector : {ProjectorKind::PAINTER_NEWELL, ProjectorKind::PAINTER}) {
        Bake bake;
        setQuick(bake, 512);
        bake.settings.refine = 1;
        bake.settings.targetError = 0.003f;
        bake.settings.projector = projector;
        bake.run(scene);
        // The noise of 512 bundles is 1 % in both.
        EXPECT_LT(noise(everything(bake), everything(exact)), 0.03) << choiceName(projector);
    }
}

}  // namespace
}  // namespace raybundle
