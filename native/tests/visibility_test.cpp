// SPDX-License-Identifier: GPL-3.0-or-later
#include "visibility/visibility.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "test_scenes.h"

namespace raybundle {
namespace {

using namespace test;

TEST(Visibility, RaysOutOfTheRangeOfNumbersMeetNothingAndAreBlocked) {
    Scene scene;
    place(scene, box("room", glm::vec3(0), glm::vec3(1), true), grey("", 0.5f));
    const Patches patches = subdivide(scene, 0.5f, kMany);
    const Visibility visibility(patches);
    const glm::vec3 inside(0.5f), up(0, 0, 1);
    const float most = std::numeric_limits<float>::max();
    for (const float bad : {NAN, INFINITY, -INFINITY, most, -1e19f})
        for (int axis = 0; axis < 3; ++axis) {
            glm::vec3 from = inside, way = up;
            from[axis] = bad;
            way[axis] = bad;
            EXPECT_EQ(visibility.visibleShare(0, {from, up, INFINITY}), 0) << bad;
            EXPECT_EQ(visibility.visibleShare(0, {from, way, INFINITY}), 0) << bad;
            EXPECT_FALSE(visibility.firstHit(0, from, up)) << bad;
            const ShadowRay rays[2] = {{from, up, INFINITY}, {from, way, INFINITY}};
            float shares[2] = {-1, -1};
            visibility.visibleShares(0, rays, 2, shares);
            EXPECT_EQ(shares[0] + shares[1], 0) << bad;
        }
}

}  // namespace
}  // namespace raybundle
