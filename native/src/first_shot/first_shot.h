// SPDX-License-Identifier: GPL-3.0-or-later
//
// The first shot distributes the light of the sources once, before any bundle is traced. Each kind
// of first shot has its own file and a row of the table in first_shot.cpp.
//
// Sources: thesis sections 2.4.2, 3 and 4.3.3.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "direct_light/direct_light.h"
#include "first_shot/stand_ins.h"
#include "job/progress.h"
#include "job/settings.h"
#include "patches/patches.h"

namespace raybundle {

// The result of a first shot.
struct FirstShot {
    std::vector<glm::vec3> irradiance;  // per side: mean irradiance by the sources, W/m^2
    // Set only if the first shot has also distributed reflected light, else empty. Per side, W/m^2:
    // irradiance by reflected light, and the reflected exitance that is left to the transport.
    std::vector<glm::vec3> indirect, unshot;
    std::vector<glm::vec4> angles;   // per side, GATHER only, else empty: means of angleTerms
    std::vector<Incoming> incoming;  // per side, GATHER only, if any surface is not Lambert's
    // Per side: whether `indirect` contains all light that the side reflects of the irradiance,
    // including how that light depends on the direction. Empty if this holds for no side.
    std::vector<bool> sentOn;
    std::vector<float> error;  // per side: standard error of the whole irradiance, W/m^2
    // Per side, GATHER only, else empty: index of the source that contributes most to the error.
    std::vector<uint32_t> noisiest;
    std::vector<glm::vec3> emission;                // per side: emission left to the bundles, W/m^2
    std::shared_ptr<const LightBySource> bySource;  // GATHER only: the light of each source
    // GATHER only: number of sources that were gathered while the light of others was kept.
    size_t freshSources = 0;
    // Power of the gathered sources, W. Sources without power of their own count with the light
    // that arrives.
    glm::dvec3 emitted{0.0};
    glm::dvec3 escaped{0.0};  // part of `emitted` that meets no surface, W
    uint64_t rays = 0;
    uint64_t sidesByOthers = 0;   // sides that have the light of a stand-in (stand_ins.h)
    uint64_t unblockedSides = 0;  // pairs of side and source without noise: fully visible
    uint64_t hiddenSides = 0;     // pairs of side and source that cannot face each other
    uint64_t weakSides = 0;    // pairs with fewer rays because the source gives little of the light
    uint64_t insideSides = 0;  // pairs with fewer rays because the side is the inside of a solid
};

// The input of a first shot. All references must outlive it.
struct FirstShotInput {
    const DirectLight& light;
    const Patches& patches;
    const Visibility& visibility;
    const Settings& settings;  // targetError: relative standard error to reach
    const Progress& progress;
    double linesPerBundle = 0;             // lines of a bundle through the scene's bounding sphere
    const Visibility* exchange = nullptr;  // for reflected light, if it differs; else null
    // The coarse shot of the sides of the tiles, possibly made before some tiles were cut. GATHER
    // starts from it. Null: GATHER makes its own.
    const CoarseShot* fromTiles = nullptr;
    // The light by source of the last GATHER of the same patches with the same target error. It is
    // scaled if only the strengths of sources have changed. May be null.
    std::shared_ptr<const LightBySource> before = nullptr;
    // Per side: whether the light on it is shown in the result. Light that is not shown only lights
    // other surfaces. Null: the light of all sides is shown.
    const std::vector<bool>* isShown = nullptr;
    // GATHER only: the instances, which have factors on the target error. Null: the factors are 1.
    const std::vector<Instance>* instances = nullptr;
    // GATHER only: which sides gather for other sides. Null: each side gathers for itself.
    const StandIns* standIns = nullptr;
    // GATHER only: receives the irradiance per side after the coarse pass, W/m^2. May be empty.
    std::function<void(std::vector<glm::vec3>)> showCoarse = {};
};

// The kinds of first shot, one per row of the table.
FirstShot gather(const FirstShotInput& input);
FirstShot shoot(const FirstShotInput& input);
FirstShot extendedFirstShot(const FirstShotInput& input);

// Returns the best ratio of the number of local lines in the first shot to the number of global
// lines after it (thesis eq. 3.1).
//   intersections      mean number of intersections of a random line with the scene
//   meanReflectance    mean reflectance of the scene
//   sourceReflectance  reflectance of the surfaces on which the first shot leaves light
//   share              share of the scene's area that these surfaces take, 0 to 1
double localToGlobalRatio(double intersections, double meanReflectance, double sourceReflectance,
                          double share);

// Returns the reflectance of a side for the light of the first shot, which may depend on its angle.
glm::vec3 shotReflectance(const Patches& patches, const FirstShot& shot, size_t side);

// Runs a first shot of the given kind.
FirstShot firstShot(FirstShotKind kind, const FirstShotInput& input);

}  // namespace raybundle
