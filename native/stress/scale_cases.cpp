// SPDX-License-Identifier: GPL-3.0-or-later
//
// Cases of sizes, distances from the origin, and sizes of pixels relative to patches. A lit room
// must look the same in all of them.
#include <glm/gtc/matrix_transform.hpp>

#include "cases.h"
#include "test_scenes.h"

namespace raybundle::stress {
namespace {

using namespace test;

// Tolerance of the relative RMS difference between two bakes to 2 %. Each corner has some of their
// noise.
constexpr double kNoise = 0.05;
constexpr float kPatchSize = 0.25f;

// Returns a room with two boxes and a lamp below the ceiling, `scale` times as large, at `offset`
// (m).
Scene litRoomAt(double scale, const glm::dvec3& offset) {
    Scene scene = roomWithBoxes(0.6f);
    const glm::dmat4 place = glm::scale(glm::translate(glm::dmat4(1), offset), glm::dvec3(scale));
    for (Instance& instance : scene.instances) instance.transform = place * instance.transform;
    scene.addLight(areaLight(offset + scale * glm::dvec3(2, 1.6, 2.6), {0.3 * scale, 0, 0},
                             {0, -0.3 * scale, 0}, {5, 4, 3}));
    return scene;
}

Case room(const std::string& group, const std::string& name, double scale,
          const glm::dvec3& offset) {
    Case made;
    made.group = group;
    made.name = name;
    made.scene = litRoomAt(scale, offset);
    made.like = std::make_shared<Scene>(litRoomAt(1, glm::dvec3(0)));
    made.settings.patchSize = float(double(kPatchSize) * scale);
    made.likeSettings.patchSize = kPatchSize;
    made.tolerance = kNoise;
    made.hasNoise = true;
    return made;
}

}  // namespace

std::vector<Case> scaleCases() {
    std::vector<Case> cases;
    for (double scale : {1e-4, 1e-2, 1e2, 1e4, 1e6})
        cases.push_back(room("scale", printed("%g times as large", scale), scale, glm::dvec3(0)));
    for (double offset : {1e3, 1e5, 1e6})
        cases.push_back(room("offset", printed("%g m from the origin", offset), 1,
                             offset * glm::dvec3(1, -1, 1)));
    cases.push_back(
        room("offset", "0.01 times as large, 1e+06 m from the origin", 0.01, glm::dvec3(1e6)));

    // The lines of a bundle are spread over about 1000 patches of 0.25 m. Patches of 0.5 m get as
    // many lines each from a quarter of the lines.
    for (double pixels : {0.02, 0.2, 5.0, 50.0, 1000.0}) {
        const bool isWide = pixels >= 1000;
        Case made = room("pixels", printed("%g pixels per patch", pixels), 1, glm::dvec3(0));
        if (isWide) made.settings.patchSize = made.likeSettings.patchSize = 2 * kPatchSize;
        made.settings.linesPerBundle = int((isWide ? 250 : 1000) * pixels / 4);
        // If there are fewer lines than patches, patches gather light with local rays until they
        // have some lines. Lines are noisier than these rays, so that the noise need not fall at
        // first.
        made.hasNoise = pixels > 1;
        cases.push_back(made);
    }
    return cases;
}

}  // namespace raybundle::stress
