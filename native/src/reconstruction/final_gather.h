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
// - Only where the interpolation leaves the light of the patches around: elsewhere it is nearer to
//   the truth than rays are, whose noise differs from point to point.
// - As many rays as the error needs: the spread of several independently shifted Sobol sets tells.
#pragma once

#include <vector>

#include "patches/patches.h"
#include "reconstruction/least_squares.h"
#include "reconstruction/smooth_regions.h"
#include "transport/direct_light.h"
#include "transport/set_light.h"
#include "visibility/visibility.h"

namespace raybundle {

class FinalGather {
  public:
    // The light of one set, or what belongs to none; `error`, W/m^2, is what it may be off. All
    // must outlive the object.
    FinalGather(const Patches& patches, const Visibility& visibility, const SetLight& light,
                float error);

    // What arrives at a point, W/m^2.
    struct Light {
        glm::vec3 carried{0.0f};  // emission that is no source, and the world's
        glm::vec3 reflected{0.0f};
        glm::vec3 total() const { return carried + reflected; }
    };
    // receivers: how many share the error, because their mean counts.
    Light gather(const Receiver& receiver, size_t receivers) const;

    // Per node of an instance: whether the light there is to be gathered. carried, reflected: per
    // node, as reconstructed. exposed: per side, the share of it that counts.
    std::vector<bool> isWanted(const InstanceRange& range, const SmoothRegions& regions,
                               rb_side side, const std::vector<float>& exposed,
                               const std::vector<glm::vec3>& carried,
                               const std::vector<glm::vec3>& reflected) const;

  private:
    const Patches& patches;
    const Visibility& visibility;
    const SetLight& light;
    const std::vector<glm::vec3>& emission;  // per side, without sources, W/m^2
    std::vector<glm::vec3> reflected;        // per side, W/m^2
    const glm::vec3 world;                   // exitance, W/m^2
    const float error;                       // W/m^2
};

}  // namespace raybundle
