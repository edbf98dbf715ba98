// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light per patch side of one bake, as far as comparison needs it, and its error against that
// of another bake with the same patches.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "scene/scene.h"

namespace raybundle::bench {

// Of the sides with a result, in the order of the patches.
struct PatchLight {
    std::vector<float> area;          // m^2
    std::vector<float> exposed;       // share that nothing covers; 1 except in a reference
    std::vector<glm::vec3> direct;    // irradiance, W/m^2
    std::vector<glm::vec3> indirect;  // irradiance, W/m^2
    uint32_t bundles = 0;             // of the bake
    double estimatedError = 0;        // that the bake states

    size_t size() const { return area.size(); }
};

// After a run of the bake on the scene.
PatchLight patchLight(const Scene& scene, const Bake& bake);

// What is taken for the truth: the indirect light is that of a LINE_REUSE bake of `bundles` bundles
// with the patches of `like`; the direct light is sampled much more finely than by any first shot.
PatchLight referenceLight(const Scene& scene, const Settings& like, int bundles);

// Weighted by exposed area; noise, maximum and p99 are relative to the RMS of the reference.
struct LightError {
    double noise = 0;    // RMSE over RGB
    double bias = 0;     // mean / mean of the reference - 1
    double maximum = 0;  // of one side
    double p99 = 0;      // 99 % of the area have less
    double area = 0;     // of what was compared, m^2
};

// What of the light is compared, and where.
enum class Part {
    ALL,      // direct + indirect, everywhere
    UNLIT,    // direct + indirect, where the reference has next to no direct light
    INDIRECT  // indirect, everywhere
};

// Throws Error if the two do not have the same patches.
LightError lightError(const PatchLight& light, const PatchLight& reference, Part part);

// A file with a PatchLight. Reading throws Error if there is none.
void writePatchLight(const std::string& path, const PatchLight& light);
PatchLight readPatchLight(const std::string& path);

}  // namespace raybundle::bench
