// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light per patch side of one bake, with the values that a comparison needs, and its error
// relative to another bake with the same patches.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "scene/scene.h"

namespace raybundle::bench {

// The light on the patch sides that have a result, in the order of the patches. All arrays are per
// side.
struct PatchLight {
    std::vector<float> area;     // m^2
    std::vector<float> exposed;  // share of the side that nothing covers; 1 except in a reference
    std::vector<glm::vec3> direct;    // irradiance, W/m^2
    std::vector<glm::vec3> indirect;  // irradiance, W/m^2
    uint32_t bundles = 0;             // number of bundles of the bake
    double estimatedError = 0;        // relative noise that the bake states

    size_t size() const { return area.size(); }
};

// Returns the light on the patches of `bake`, which must have run on `scene`.
PatchLight patchLight(const Scene& scene, const Bake& bake);

// Computes the light that is taken as the truth. The indirect light is that of a LINE_REUSE bake of
// `bundles` bundles with the patches of the settings `like`. The direct light is sampled much more
// finely than by any first shot.
PatchLight referenceLight(const Scene& scene, const Settings& like, int bundles);

// The error of the light relative to a reference, weighted by exposed area. `noise`, `maximum` and
// `p99` are relative to the RMS of the reference.
struct LightError {
    double noise = 0;    // RMSE over RGB
    double bias = 0;     // mean / mean of the reference - 1
    double maximum = 0;  // of a single side
    double p99 = 0;      // the error on 99 % of the area is below this
    double area = 0;     // compared area, m^2
};

// The component of the light that is compared, and the sides where.
enum class Part {
    ALL,      // direct + indirect light on all sides
    UNLIT,    // direct + indirect light on sides with almost no direct light in the reference
    INDIRECT  // indirect light on all sides
};

// Returns the error of `light`. Throws Error if `light` and `reference` have different patches.
LightError lightError(const PatchLight& light, const PatchLight& reference, Part part);

// Write and read a file that holds a PatchLight. readPatchLight throws Error if the file does not
// hold one.
void writePatchLight(const std::string& path, const PatchLight& light);
PatchLight readPatchLight(const std::string& path);

}  // namespace raybundle::bench
