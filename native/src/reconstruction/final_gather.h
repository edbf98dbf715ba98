// SPDX-License-Identifier: GPL-3.0-or-later
//
// Final gather: the light that reaches a point from other surfaces and from the world, by rays from
// the point itself that look up what the patches send which they meet.
//
// Source: Reichert, "A Two-Pass Radiosity Method Driven by Lights and Viewer Position" (1992), and
// Lischinski, Tampieri and Greenberg, "Combining Hierarchical Radiosity and Discontinuity Meshing"
// (1993): a last bounce at the places of interest takes away what patches and their interpolation
// blur.
// Differs:
// - Light of the sources is left out: DirectLight gathers it better.
// - Only where the interpolation leaves the light of the patches around, or where another surface
//   is nearer than patches are wide and there are too few to tell: elsewhere it is nearer to the
//   truth than rays are, whose noise differs from point to point.
// - Where a ray ends nearer than the patch there is wide, the light of the sources is sampled at
//   its end: the mean of the patch is not what shines into a narrow gap.
// - As many rays as the error needs. The receivers of a vertex share one sequence of Sobol points,
//   which are stratified together where they look the same way; the spread of its parts tells.
#pragma once

#include <vector>

#include "direct_light/direct_light.h"
#include "patches/lit_surfaces.h"
#include "reconstruction/least_squares.h"
#include "reconstruction/smooth_regions.h"
#include "sampling/sobol.h"
#include "transport/sent_light.h"
#include "transport/set_light.h"
#include "visibility/visibility.h"

namespace raybundle {

class FinalGather {
  public:
    // The light of one set, or what belongs to none. meanLight: of all that is baked, W/m^2;
    // targetError: relative to it, or to the light of what is brighter. References must outlive the object.
    FinalGather(const LitSurfaces& surfaces, const Visibility& visibility, const SetLight& light,
                float meanLight, float targetError);

    // What arrives at a point, W/m^2.
    struct Light {
        glm::vec3 carried{0.0f};  // emission that is no source, and the world's
        glm::vec3 reflected{0.0f};
        double variance = 0;  // of the total, in the mean of the channels; only of gather()
        glm::vec3 total() const { return carried + reflected; }
    };
    // A receiver and its share in a mean.
    struct Share {
        const Receiver* receiver;
        float share;
    };
    // The mean of some receivers, whose shares sum to 1. brightness: of all light there, about,
    // W/m^2.
    Light gather(const std::vector<Share>& receivers, float brightness) const;

    // Whether the receiver's face has too few patches to tell whether interpolation follows the
    // light, and a surface is so near that it may not: nearer than its patch is wide, or than the
    // receiver's is long.
    bool isNear(const Receiver& receiver) const;

    // Per node of an instance: whether the light there is to be gathered. carried, reflected: per
    // node, as reconstructed.
    std::vector<bool> isWanted(const InstanceRange& range, const SmoothRegions& regions,
                               rb_side side, const std::vector<glm::vec3>& carried,
                               const std::vector<glm::vec3>& reflected) const;

  private:
    void addRays(const Receiver& receiver, const SobolPoints& points, uint32_t first,
                 uint32_t count, Light& sum) const;
    float width(uint32_t side) const;  // of a patch, metres

    const LitSurfaces surfaces;
    const Patches& patches;
    const Visibility& visibility;
    const SetLight& light;
    const std::vector<glm::vec3>& emission;  // per side, without sources, W/m^2
    const SentLight sent;
    const glm::vec3 world;  // exitance, W/m^2
    const float targetError;
    const float error;  // W/m^2
};

}  // namespace raybundle
