// SPDX-License-Identifier: GPL-3.0-or-later
//
// The directions from which the light of the sources arrives at a receiver: a few directions, each
// chosen with a probability equal to its share of the light.
//
// Sources: Vitter, "Random Sampling with a Reservoir" (1985), here weighted by the light. Talbot,
// Cline and Egbert, "Importance Resampling for Global Illumination" (2005): a direction chosen from
// few samples must be weighted by the total light of these samples. Otherwise a large source close
// by seems to send more light from its rim than it does.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/packing.hpp>

#include "sampling/sobol.h"

namespace raybundle {

// A reservoir of directions, octahedrally encoded, that the light of one receiver arrives from.
class Incoming {
  public:
    // Number of directions that are kept.
    static constexpr size_t kCount = 4;

    // Ratio of the irradiance that the samples alone would give to the actual irradiance, brightest
    // channel. Light that depends on the direction is multiplied by it. Its mean over receivers is
    // 1.
    float weight = 1;

    // Returns the k-th direction as a unit vector towards the sources, accurate to 1e-4. The
    // direction is arbitrary if no light was added.
    glm::vec3 direction(size_t k) const {
        const glm::vec2 p = glm::unpackSnorm2x16(packed[k]);
        glm::vec3 d(p, 1 - std::abs(p.x) - std::abs(p.y));
        if (d.z < 0) d = glm::vec3(folded(d), d.z);
        return glm::normalize(d);
    }

    // Adds light that arrives from a direction (unit vector). `share` is the fraction of this light
    // in all light added so far, this light included. `random` must differ between calls and
    // between receivers.
    void add(const glm::vec3& direction, float share, uint32_t random) {
        const glm::vec3 d =
            direction / (std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z));
        const uint32_t bits = glm::packSnorm2x16(d.z < 0 ? folded(d) : glm::vec2(d));
        for (uint32_t k = 0; k < kCount; ++k)
            if (isChosen(share, random, k)) packed[k] = bits;
    }
    // Adds the light that `other` holds; `share` and `random` are as above.
    void add(const Incoming& other, float share, uint32_t random) {
        for (uint32_t k = 0; k < kCount; ++k)
            if (isChosen(share, random, k)) packed[k] = other.packed[k];
    }

  private:
    // Octahedral encoding: the lower half of the octahedron is folded over the upper half.
    static glm::vec2 folded(const glm::vec3& d) {
        return {std::copysign(1 - std::abs(d.y), d.x), std::copysign(1 - std::abs(d.x), d.y)};
    }
    static bool isChosen(float share, uint32_t random, uint32_t k) {
        return float(hash(random, k) >> 8) * 0x1p-24f < share;
    }

    std::array<uint32_t, kCount> packed{};
};

}  // namespace raybundle
