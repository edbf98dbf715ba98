// SPDX-License-Identifier: GPL-3.0-or-later
//
// The strengths of the sources of a scene, apart from everything else that a bake depends on. Light
// is linear in them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "job/settings.h"
#include "scene/scene.h"

namespace raybundle {

// The strengths of all sources of a scene by number, RGB: that of each lamp, the emission of each
// material (one number per side and term of SurfaceColor), and the constant radiance of the world.
class SourceStrengths {
  public:
    SourceStrengths(const Scene& scene, const Settings& settings);

    // Returns whether two bakes have equal input but for the strengths. Equal hashes (64 bits) are
    // assumed to mean equal input.
    bool areOfSameBake(const SourceStrengths& other) const {
        return others == other.others && values.size() == other.values.size();
    }

    // The functions below require areOfSameBake(before).
    //
    // Returns the numbers of the strengths that differ from those before.
    std::vector<size_t> changedSince(const SourceStrengths& before) const;
    // Returns how many times as strong the sources with these numbers have become, by channel. A
    // channel in which they are and were dark has the factor 1. Returns nothing if the factors of
    // these sources differ, or if a dark channel has become bright.
    std::optional<glm::dvec3> growthSince(const SourceStrengths& before,
                                          const std::vector<size_t>& these) const;

  private:
    uint64_t others;                 // hash of everything but the strengths
    std::vector<glm::dvec3> values;  // by number
};

// Returns the scene with the sources of these numbers (SourceStrengths) apart: in a light set, the
// only one. Returns nothing if that is not possible: the scene has light sets, or these sources
// share an object or the world with light that is not among them. `these` must be ascending.
std::optional<Scene> partedScene(const Scene& scene, const std::vector<size_t>& these);

}  // namespace raybundle
