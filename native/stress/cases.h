// SPDX-License-Identifier: GPL-3.0-or-later
//
// Scenes that are hard on numbers, each with what a bake of it must give.
#pragma once

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "job/settings.h"
#include "scene/scene.h"

namespace raybundle::stress {

// As printf does.
inline std::string printed(const char* format, double value) {
    char text[64];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

struct Case {
    std::string group, name;
    Scene scene;
    Settings settings;

    // What is expected, one of three:
    // - light: irradiance on every side that is baked, W/m^2, but on what is covered, where it is
    //   0;
    // - like: another scene whose corners have the same light;
    // - neither: whatever keeps the energy balanced.
    std::optional<double> light;
    std::shared_ptr<const Scene> like;
    Settings likeSettings{};
    // Largest relative deviation from `light`, or relative RMS difference from `like`.
    double tolerance = 1e-3;
    // Of the energy: that of what is emitted which is lost.
    double balance = 1e-3;
    // Its noise is compared at several numbers of bundles.
    bool hasNoise = false;
    // What a warning, or the error with which the bake ends, must contain.
    std::string says;
};

// In the order of the table. isQuick: without those that take more than a few seconds.
std::vector<Case> materialCases();
std::vector<Case> scaleCases();
std::vector<Case> geometryCases(bool isQuick);

}  // namespace raybundle::stress
