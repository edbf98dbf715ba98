// SPDX-License-Identifier: GPL-3.0-or-later
//
// First shots on small scenes, and functions that compare first shots.
#pragma once

#include <glm/glm.hpp>
#include <string>

#include "first_shot/first_shot.h"
#include "job/settings.h"
#include "patches/patches.h"
#include "scene/scene.h"
#include "visibility/visibility.h"

namespace raybundle::test {

// A scene that is subdivided once for several first shots.
class ShotScene {
  public:
    explicit ShotScene(const Scene& scene, float patchSize = 10);

    FirstShot shoot(FirstShotKind kind, int lines, int seed = 0, float targetError = 0.02f,
                    double linesPerBundle = 0, int bundles = 0) const;

    const Scene scene;
    const Patches patches;
    const Visibility visibility;
};

// Relative error of sampled light. At most 256 stratified samples per side and source leave about
// half a per cent of noise (0.0037 relative RMS in a test room); twice as much is safe for a single
// side.
constexpr double kSampled = 0.01;
// Relative error of a closed form in float, at sampled points of a patch that is small compared
// with its distance from the light.
constexpr double kExact = 2e-4;

// Light that was gathered with an error far below kSampled.
struct GatheredShot {
    Patches patches;
    FirstShot light;

    // Return the irradiance on the front or the back of the first patch of an instance, W/m^2.
    float front(uint32_t instance = 0) const { return at(instance, 0); }
    float back(uint32_t instance = 0) const { return at(instance, 1); }
    float at(uint32_t instance, uint32_t side) const;
};
GatheredShot gatherFinely(const Scene& scene, float patchSize = 10);

// Adds a receiver with an edge of 2 mm around a point. It faces up by default.
void placeReceiver(Scene& scene, const glm::vec3& at = glm::vec3(0), const glm::vec3& u = {1, 0, 0},
                   const glm::vec3& v = {0, 1, 0});

// Mean irradiance over the fronts or backs (side 0 or 1) of all patches of an instance, and an
// upper bound of its standard error, W/m^2. It is a bound because sides compete for the
// same lines, so that their errors partly cancel.
struct Mean {
    double value = 0, error = 0;
};
Mean meanLight(const Patches& patches, const FirstShot& shot, uint32_t instance, uint32_t side = 0);

// Returns the power that arrives from the sources on all sides, W.
glm::dvec3 arriving(const Patches& patches, const FirstShot& shot);

}  // namespace raybundle::test
