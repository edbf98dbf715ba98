// SPDX-License-Identifier: GPL-3.0-or-later
#include "visibility/visibility.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

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

// Rays from the floor of a room with a box: past the box, into the box, and so short that nothing
// is between. Packets of each size give the results of single rays, also with kernels for four rays
// (Visibility with RAYBUNDLE_EMBREE, in CMakeLists.txt).
TEST(Visibility, PacketsOfAnySizeSeeWhatSingleRaysSee) {
    Scene scene;
    place(scene, box("room", glm::vec3(0), glm::vec3(4), true), grey("", 0.5f));
    place(scene, box("box", glm::vec3(1, 1, 2), glm::vec3(3, 3, 3), false), grey("", 0.5f));
    const Patches patches = subdivide(scene, 0.5f, kMany);
    const Visibility visibility(patches);
    uint32_t floor = 0;
    while (patches.normal(floor).z < 0.9f || patches.parentAt(floor).origin.z > 0.1f) ++floor;
    for (int count = 1; count <= Visibility::kPacket; ++count)
        for (int from = 0; from < 40; ++from) {
            const glm::vec3 point(0.1f * float(from), 2.0f, 0.0f);
            std::vector<ShadowRay> rays;
            for (int k = 0; k < count; ++k) {
                const glm::vec3 end(0.5f * float(k), 2.2f, 3.9f);
                const float distance = k % 3 == 2 ? 1e-9f : glm::length(end - point);
                rays.push_back({point, glm::normalize(end - point), distance});
            }
            std::vector<float> shares(size_t(count), -1.0f);
            visibility.visibleShares(floor, rays.data(), count, shares.data());
            for (int k = 0; k < count; ++k)
                EXPECT_EQ(shares[size_t(k)], visibility.visibleShare(floor, rays[size_t(k)]))
                    << count << " rays from " << from << ", ray " << k;
        }
}

}  // namespace
}  // namespace raybundle
