// SPDX-License-Identifier: GPL-3.0-or-later
//
// Numerically difficult scenes, each with the result that its bake must have.
#pragma once

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "job/settings.h"
#include "scene/scene.h"

namespace raybundle::stress {

// Returns `value` formatted as printf does.
inline std::string printed(const char* format, double value) {
    char text[64];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

// A scene, the settings of its bake and the expected result.
struct Case {
    std::string group, name;
    Scene scene;
    Settings settings;

    // The expected light, one of three:
    // - `light`: the irradiance of every baked side, W/m^2. Covered parts, which get no light, are
    //   exempt.
    // - `like`: another scene whose corners have equal light.
    // - neither: any light with a balanced energy.
    std::optional<double> light;
    std::shared_ptr<const Scene> like;
    Settings likeSettings{};
    // Largest relative deviation from `light`, or relative RMS difference from `like`.
    double tolerance = 1e-3;
    // Largest share of the emitted energy that may be lost.
    double balance = 1e-3;
    // Whether the noise is compared at several numbers of bundles.
    bool hasNoise = false;
    // Text that a warning, or the error with which the bake ends, must contain.
    std::string says;
};

// Return the cases in the order of the table. If `isQuick` is set, cases that take more than a few
// seconds are left out or made smaller.
std::vector<Case> materialCases();
std::vector<Case> scaleCases();
std::vector<Case> geometryCases(bool isQuick);

}  // namespace raybundle::stress
