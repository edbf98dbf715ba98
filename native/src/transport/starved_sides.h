// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sides that few lines met: they gather the light that LINE_REUSE has solved for with local rays
// of their own. Starved sides that these rays meet do so too, and what starved sides send each
// other is found by iteration.
//
// Source: thesis section 2.4.2 (local lines, fig. 2.11).
// Differs: rays start all over the side in a cosine distribution, as the lines that meet it do, so
// that rays and lines are weighted alike.
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

// How starved sides gather. References must outlive it.
struct StarvedRays {
    const Visibility& visibility;
    // If the patches are those of clusters, `visibility` is of the patches that these are made of;
    // null: it is of the patches themselves.
    const Clusters* clusters;
    uint32_t minLines;  // a side that fewer lines met is starved
    uint32_t seed;
};

// The patches, and what is known of the light on them before the rays. References must outlive it.
struct StarvedInput : LitSurfaces {
    const LineCounts& counts;
    const FirstShot& shot;
    const glm::vec3 worldRadiance;  // W/(m^2 sr)
    const DirectedLight& directedLight;
};

class StarvedSides {
  public:
    // Everything passed must outlive the object. irradiance: per side, what the lines bring; the
    // functions below add to it what the rays bring.
    StarvedSides(const StarvedInput& input, const StarvedRays& rays, Irradiance& irradiance);

    // Casts the rays of the starved sides among the wanted ones (per side), and of starved sides
    // that these rays meet. Adds the direct light that the rays bring.
    void castRays(const std::vector<bool>& wanted);

    // Adds the reflected light that these rays bring. reflected: exitance by reflection per side,
    // as the solve found it, W/m^2.
    void addReflected(const std::vector<glm::vec3>& reflected);

    // The sides that gather.
    size_t count() const { return starved.size(); }

  private:
    void find(const std::vector<bool>& wanted);
    void castRaysOf(size_t k);
    bool sweep(std::vector<glm::vec3>& sent, std::vector<glm::vec3>& next);

    const StarvedInput& input;
    const StarvedRays& how;
    const Patches& surface;  // that the rays start on
    const HandOver shotLight;
    Irradiance& irradiance;

    std::vector<uint32_t> starved;  // the sides that gather
    std::vector<bool> isOther;      // per side: starved, but does not gather yet
    size_t raysPerSide = 0;
    std::vector<uint32_t> hits;  // per ray of each of them: the side that it met, or UINT32_MAX
    // Per side that gathers: the number of lines and rays that brought its light.
    std::vector<float> weights;
    // Per side that gathers: the sum, over lines and rays, of the light that does not depend on
    // what starved sides send: the indirect irradiance by its lines, and light by direction.
    std::vector<glm::vec3> known;
};

}  // namespace raybundle
