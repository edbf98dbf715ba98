// SPDX-License-Identifier: GPL-3.0-or-later
//
// First shots on small scenes and ways to compare them.
#pragma once

#include <glm/glm.hpp>
#include <string>

#include "first_shot/first_shot.h"
#include "job/settings.h"
#include "patches/patches.h"
#include "scene/scene.h"
#include "visibility/visibility.h"

namespace raybundle::test {

// A scene that is cut into patches once and shot at several times.
class ShotScene {
  public:
    explicit ShotScene(const Scene& scene, float patchSize = 10);

    FirstShot shoot(const std::string& kind, int lines, int seed = 0, float targetError = 0.02f,
                    double linesPerBundle = 0, int bundles = 0) const;

    const Scene scene;
    const Patches patches;
    const Visibility visibility;
};

// Mean over the fronts or backs (side 0 or 1) of all patches of an instance, and its standard
// error, an upper bound: sides compete for the same lines.
struct Mean {
    double value = 0, error = 0;
};
Mean meanLight(const Patches& patches, const FirstShot& shot, uint32_t instance, uint32_t side = 0);

// Power that arrives from the sources on all sides, W.
glm::dvec3 arriving(const Patches& patches, const FirstShot& shot);

}  // namespace raybundle::test
