// SPDX-License-Identifier: GPL-3.0-or-later
//
// Starved sides are sides that few lines met. They gather the light that LINE_REUSE has solved for
// with local rays of their own. Starved sides that these rays meet gather too. The light that
// starved sides send each other is found by iteration.
//
// Source: thesis section 2.4.2 (local lines, fig. 2.11).
// Differs: rays start all over the side with a cosine distribution, as the lines that meet the side
// do, so that rays and lines have equal weights.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "bundles/line_counts.h"
#include "first_shot/directed_light.h"
#include "first_shot/first_shot.h"
#include "patches/clusters.h"
#include "patches/patches.h"
#include "transport/transport.h"
#include "visibility/visibility.h"

namespace raybundle {

// How starved sides gather. All references must outlive the object.
struct StarvedRays {
    const Visibility& visibility;
    // The clusters between which light is exchanged; `visibility` is then of clusters->members().
    // Null: each patch exchanges light by itself, and `visibility` is of the patches.
    const Clusters* clusters;
    uint32_t minLines;  // a side is starved if fewer lines met it
    // Seed of the rays.
    uint32_t seed;
};

// The surfaces, the line counts and the light before rays are cast, per side of the patches or
// clusters between which light is exchanged. All references must outlive the object.
struct StarvedInput : LitSurfaces {
    const LineCounts& counts;
    const FirstShot& shot;
    const glm::vec3 worldRadiance;  // W/(m^2 sr)
    const DirectedLight& directedLight;
};

// The rays of the starved sides, and the light that they bring.
class StarvedSides {
  public:
    // `irradiance` is per side the light that the lines bring. The functions below add the light of
    // the rays to it. All references must outlive the object.
    StarvedSides(const StarvedInput& input, const StarvedRays& rays, Irradiance& irradiance);

    // Casts rays from the starved sides that `wanted` marks (per side), and from starved sides that
    // these rays meet. Adds the direct light that the rays bring.
    void castRays(const std::vector<bool>& wanted);

    // Adds the reflected light that the rays bring. `reflected` is the reflected exitance R of the
    // last solve, per side, W/m^2. Only after castRays().
    void addReflected(const std::vector<glm::vec3>& reflected);

    // Returns the number of sides that cast rays.
    size_t count() const { return starved.size(); }

  private:
    void find(const std::vector<bool>& wanted);
    void castRaysOf(size_t k);
    bool sweep(std::vector<glm::vec3>& sent, std::vector<glm::vec3>& next);

    const StarvedInput& input;
    const StarvedRays& how;
    const Patches& surface;  // patches on which rays start
    const HandOver shotLight;
    Irradiance& irradiance;

    std::vector<uint32_t> starved;  // sides that cast rays
    // Per side: whether it is starved but does not cast rays yet.
    std::vector<bool> isOther;
    size_t raysPerSide = 0;
    // For each ray of each side in `starved`: the side that it met, or UINT32_MAX.
    std::vector<uint32_t> hits;
    // Per side in `starved`: number of lines and rays that brought its light.
    std::vector<float> weights;
    // Per side in `starved`: sum, over lines and rays, of the light that does not depend on the
    // exitance of starved sides, W/m^2. It consists of the indirect irradiance by lines, and of
    // light by direction along rays.
    std::vector<glm::vec3> known;
};

}  // namespace raybundle
