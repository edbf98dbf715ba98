// SPDX-License-Identifier: GPL-3.0-or-later
//
// The first shot: the light of the sources, distributed once before any bundle. Each kind is a file
// of its own and a row of the table in first_shot.cpp.
//
// Sources: thesis sections 2.4.2, 3 and 4.3.3.
#pragma once

#include <cstdint>
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

struct FirstShot {
    std::vector<glm::vec3> irradiance;  // per side, mean over it, from the sources, W/m^2
    // Where the first shot went on with reflected light: irradiance from it, and the reflected
    // exitance that is left to the transport, per side, W/m^2; else both are empty.
    std::vector<glm::vec3> indirect, unshot;
    std::vector<glm::vec4> angles;   // per side, of GATHER: means of angleTerms; else empty
    std::vector<Incoming> incoming;  // per side, of GATHER, if any surface is not Lambert's
    // Per side: all that it reflects of the irradiance is in `indirect`, by direction too; empty:
    // of none.
    std::vector<bool> sentOn;
    std::vector<float> error;  // per side, standard error of all irradiance, W/m^2
    std::vector<uint32_t>
        noisiest;  // per side, of GATHER: the source with most of that; else empty
    std::vector<glm::vec3> emission;  // per side: emission that the bundles are to carry, W/m^2
    std::shared_ptr<const LightBySource> bySource;  // of GATHER: what came from each source
    glm::dvec3 emitted{0.0};  // power of the gathered sources, W; without a power: what arrives
    glm::dvec3 escaped{0.0};  // part of it that meets no surface, W
    uint64_t rays = 0;
    uint64_t sidesByOthers = 0;   // that have the light of others that stand for them (stand_ins.h)
    uint64_t unblockedSides = 0;  // side and source pairs without noise: wholly visible
    uint64_t hiddenSides = 0;     // side and source pairs that cannot face each other
    uint64_t weakSides = 0;    // pairs with fewer rays since the source gives little of the light
    uint64_t insideSides = 0;  // pairs with fewer rays since the side is the inside of a solid
};

// What first shots are made of. References must outlive them.
struct FirstShotInput {
    const DirectLight& light;
    const Patches& patches;
    const Visibility& visibility;
    const Settings& settings;  // targetError: relative standard error to reach
    const Progress& progress;
    double linesPerBundle = 0;             // lines of a bundle through the scene's bounding sphere
    const Visibility* exchange = nullptr;  // of reflected light, where it differs
    // The coarse shot of the sides of the tiles, perhaps before some were cut: what
    // GATHER begins with. Null: it makes its own.
    const CoarseShot* fromTiles = nullptr;
    // Of the last GATHER of the same patches to the same error, to be scaled if the strengths of
    // sources are all that has changed; or null.
    std::shared_ptr<const LightBySource> before = nullptr;
    // Per side: whether its light is shown, and not only that of what it lights; null: all is.
    const std::vector<bool>* isShown = nullptr;
    // Of GATHER: which sides gather for which; null: each for itself.
    const StandIns* standIns = nullptr;
};

// The first shots, one a row of the table.
FirstShot gather(const FirstShotInput& input);
FirstShot shoot(const FirstShotInput& input);
FirstShot extendedFirstShot(const FirstShotInput& input);

// The best number of local lines of the first shot over global lines after it (thesis eq. 3.1).
// intersections: of a random line with the scene, mean; meanReflectance: of the scene;
// sourceReflectance: of the surfaces that the first shot leaves light on; share: of the scene's
// area that they take, 0 to 1.
double localToGlobalRatio(double intersections, double meanReflectance, double sourceReflectance,
                          double share);

// What a side reflects of the first shot's light.
glm::vec3 shotReflectance(const Patches& patches, const FirstShot& shot, size_t side);

// Receivers that are beside each other, by their numbers: those of the sides of neighbouring tiles
// that gather, for themselves or for others; the patches of a cut one stand beside each other.
std::vector<ReceiverPair> neighbouringGatherers(const Patches& patches, const StandIns& standIns);

// A first shot of a kind.
FirstShot firstShot(FirstShotKind kind, const FirstShotInput& input);

}  // namespace raybundle
