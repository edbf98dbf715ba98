// SPDX-License-Identifier: GPL-3.0-or-later
//
// Cuts beside narrow gaps: which tiles are cut, and the light in a gap against its exact value.
#include "refinement/contacts.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "lights/mesh_outline.h"
#include "test_bakes.h"
#include "test_scenes.h"
#include "visibility/visibility.h"

namespace raybundle {
namespace {

using namespace test;

// Ground of 10 x 10 patches of 0.1 m, with a board of 0.3 x 0.3 m over its centre.
Scene groundUnderBoard(float gap) {
    Scene scene;
    place(scene, rectangle("ground", {-0.5f, -0.5f, 0}, {1, 0, 0}, {0, 1, 0}), grey("", 0.5f));
    place(scene, rectangle("board", {-0.15f, -0.15f, gap}, {0, 0.3f, 0}, {0.3f, 0, 0}),
          grey("", 0.5f));
    return scene;
}

Cuts cutsOf(const Scene& scene, size_t most = kMany) {
    const Patches patches = subdivide(scene, 0.1f, kMany);
    return contactCuts(patches, Visibility(patches), most);
}

TEST(ContactCuts, AreWhereAGapIsCoveredInPart) {
    // The board covers 2 x 2 tiles of the ground fully, and half of the 12 tiles around them.
    const Cuts cuts = cutsOf(groundUnderBoard(0.02f));
    ASSERT_EQ(cuts.levels.size(), 109u);
    for (int y = 0; y < 10; ++y)
        for (int x = 0; x < 10; ++x) {
            const int ring = std::max(std::abs(2 * x - 9), std::abs(2 * y - 9)) / 2;
            const int level = cuts.levels[size_t(10 * y + x)];
            if (ring > 0) {
                EXPECT_EQ(level, ring == 1 ? 2 : 0) << x << " " << y;
            }
        }
    EXPECT_EQ(cuts.shadowEdges + cuts.bentLight, 0u);
    EXPECT_EQ(cuts.count(), 109u - size_t(std::count(cuts.levels.begin(), cuts.levels.end(), 0)));
}

TEST(ContactCuts, LeaveWideGapsAndTouchingSurfacesAlone) {
    EXPECT_EQ(cutsOf(groundUnderBoard(0.03f)).count(), 0u);
    EXPECT_EQ(cutsOf(groundUnderBoard(5e-6f)).count(), 0u);
    EXPECT_EQ(cutsOf(closedCube(0.5f)).count(), 0u);
}

TEST(ContactCuts, KeepWithinMaximumPatches) {
    const size_t all = cutsOf(groundUnderBoard(0.02f)).morePatches();
    const Cuts some = cutsOf(groundUnderBoard(0.02f), all / 2);
    EXPECT_GT(some.count(), 0u);
    EXPECT_LE(some.morePatches(), all / 2);
    EXPECT_EQ(cutsOf(groundUnderBoard(0.02f), 0).count(), 0u);
}

TEST(ContactCuts, TheUndersideOfABoardGetsTheLightThatIsInTheGap) {
    // A black board under a sun at the zenith. Its underside gets light only from the ground beside
    // its shadow.
    Scene scene = groundUnderBoard(0.02f);
    scene.mesh(1).faceMaterials[0] = scene.addMaterial(grey("black", 0));
    scene.addLight(sunLight({0, 0, 1}, {4, 4, 4}));
    const glm::dvec3 ground[4] = {{-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}};
    const glm::dvec3 shadow[4] = {
        {-0.15, -0.15, 0}, {0.15, -0.15, 0}, {0.15, 0.15, 0}, {-0.15, 0.15, 0}};
    double exact = 0;  // mean irradiance on the underside, by the midpoint rule
    constexpr int kCells = 200;
    for (int i = 0; i < kCells * kCells; ++i) {
        const glm::dvec3 point(0.3 * ((i % kCells + 0.5) / kCells - 0.5),
                               0.3 * ((i / kCells + 0.5) / kCells - 0.5), 0.02);
        exact += 2 / kPi *
                 (polygonIrradiance(point, {0, 0, -1}, ground, 4) -
                  polygonIrradiance(point, {0, 0, -1}, shadow, 4)) /
                 (kCells * kCells);
    }
    double found[2];
    for (int contacts : {0, 1}) {
        Bake bake;
        bake.settings.patchSize = 0.1f;
        bake.settings.contacts = contacts;
        bake.settings.minBundles = bake.settings.maxBundles = 4096;
        bake.run(scene);
        double light = 0, area = 0;
        const Patches& patches = bake.patches();
        for (uint32_t side = 0; side < patches.sideCount(); side += 2) {
            if (patches.parentAt(side).instance != 1) continue;
            light += double(patches.area[side / 2] * bake.patchIrradiance().indirect[side].x);
            area += double(patches.area[side / 2]);
        }
        found[contacts] = light / area;
    }
    // Without cuts a quarter or a half of each tile around the shadow lights the gap under the
    // tile.
    EXPECT_GT(found[0], 1.5 * exact);
    // The tolerance covers a step of light within patches of 0.6 gaps. The noise is 1 % of the
    // mean.
    EXPECT_NEAR(found[1], exact, 0.1 * exact);
}

}  // namespace
}  // namespace raybundle
