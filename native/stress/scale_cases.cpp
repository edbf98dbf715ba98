// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sizes, places, and patches beside pixels: a lit room must look the same in all of them.
#include <glm/gtc/matrix_transform.hpp>

#include "cases.h"
#include "test_scenes.h"

namespace raybundle::stress {
namespace {

using namespace test;

// Relative RMS difference of two bakes to 2 %, each of whose corners has some of that noise.
constexpr double kNoise = 0.05;
constexpr float kPatchSize = 0.25f;

// A room with two boxes and a lamp below the ceiling, `scale` times as large, at `offset`.
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

    // Patches of 0.25 m: about 1000 of them, over which a bundle's lines are spread; or of 0.5 m,
    // of which each gets the same with a quarter of the lines.
    for (double pixels : {0.02, 0.2, 5.0, 50.0, 1000.0}) {
        const bool isWide = pixels >= 1000;
        Case made = room("pixels", printed("%g pixels a patch", pixels), 1, glm::dvec3(0));
        if (isWide) made.settings.patchSize = made.likeSettings.patchSize = 2 * kPatchSize;
        made.settings.linesPerBundle = int((isWide ? 250 : 1000) * pixels / 4);
        // With fewer lines than patches these gather with local rays until they have some lines,
        // which are noisier: the noise need not fall from the first.
        made.hasNoise = pixels > 1;
        cases.push_back(made);
    }
    return cases;
}

}  // namespace raybundle::stress
