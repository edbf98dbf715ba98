// SPDX-License-Identifier: GPL-3.0-or-later
#include "direct_light/emission_split.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "test_bakes.h"
#include "test_scenes.h"
#include "visibility/visibility.h"

namespace raybundle {
namespace {

using namespace test;

constexpr float kReflectance = 0.5f, kEmission = 0.5f;

// A closed unit cube whose faces emit on both sides, seen from inside. The irradiance inside is
// kEmission / (1 - kReflectance) = 1 W/m^2. The light that leaves the outside does not return.
Scene glowingCube(bool inward) {
    Scene scene;
    place(scene, box("cube", glm::vec3(0), glm::vec3(1), inward),
          grey("", kReflectance, kEmission, kEmission), glm::dmat4(1), RB_ROLE_BAKE,
          inward ? RB_SIDE_FRONT : RB_SIDE_BACK);
    return scene;
}

struct Case {
    int along;  // patches along an edge
    bool inward;
    std::string name() const {
        return std::to_string(along) + " along an edge" + (inward ? ", inward" : ", outward");
    }
};

// Of the 12 n^2 sides, 512 at equal steps are all fronts or all backs for n = 16 and 32, and both
// kinds for the other n.
std::vector<Case> cases() {
    std::vector<Case> all;
    for (const int along : {1, 2, 5, 7, 8, 16, 31, 32})
        for (const bool inward : {false, true}) all.push_back({along, inward});
    return all;
}

TEST(EmissionSplit, DoesNotDependOnTheNumberOfPatches) {
    for (const Case& c : cases()) {
        const Scene scene = glowingCube(c.inward);
        const Patches patches = subdivide(scene, 1.001f / float(c.along), kMany);
        ASSERT_EQ(patches.count(), size_t(6 * c.along * c.along));
        const Visibility visibility(patches);
        for (uint32_t seed = 0; seed < 4; ++seed) {
            const EmissionSplit split =
                splitEmission(scene, patches, visibility, kNoLightSet, seed);
            EXPECT_EQ(std::count(split.isSource.begin(), split.isSource.end(), true), 0)
                << c.name() << ", seed " << seed;
        }
    }
}

TEST(EmissionSplit, AFurnaceThatGlowsOnBothSidesIsExact) {
    for (const Case& c : {Case{7, true}, Case{16, true}, Case{16, false}, Case{32, false}}) {
        Bake bake;
        setQuick(bake);
        bake.settings.patchSize = 1.001f / float(c.along);
        bake.run(glowingCube(c.inward));
        for (const glm::vec3& light : cornerLight(bake, 0, RB_OUTPUT_LIGHTING))
            EXPECT_NEAR(light.x * kPi, 1, 1e-4) << c.name();
    }
}

}  // namespace
}  // namespace raybundle
