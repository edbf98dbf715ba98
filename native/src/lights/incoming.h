// SPDX-License-Identifier: GPL-3.0-or-later
//
// Where the light of the sources comes from at a receiver: a few directions, each chosen with the
// probability of its share of the light.
//
// Source: Vitter, "Random Sampling with a Reservoir" (1985), weighted by the light. Talbot, Cline
// and Egbert, "Importance Resampling for Global Illumination" (2005): what is chosen of few samples
// has to be weighted with what they hold in all, or a large source near by seems to be more at its
// rim, from where less comes.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/packing.hpp>

#include "sampling/sobol.h"

namespace raybundle {

class Incoming {
  public:
    static constexpr size_t kCount = 4;

    // What the samples would have all light be, over what it is: light by direction counts so many
    // times. 1 in the mean over receivers.
    float weight = 1;

    // Unit vectors towards the sources, good to 1e-4; where no light was added, any.
    glm::vec3 direction(size_t k) const {
        const glm::vec2 p = glm::unpackSnorm2x16(packed[k]);
        glm::vec3 d(p, 1 - std::abs(p.x) - std::abs(p.y));
        if (d.z < 0) d = glm::vec3(folded(d), d.z);
        return glm::normalize(d);
    }

    // More light, from a unit vector; share: of it in all the light so far, itself included.
    // random: differs from call to call and from receiver to receiver.
    void add(const glm::vec3& direction, float share, uint32_t random) {
        const glm::vec3 d =
            direction / (std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z));
        const uint32_t bits = glm::packSnorm2x16(d.z < 0 ? folded(d) : glm::vec2(d));
        for (uint32_t k = 0; k < kCount; ++k)
            if (isChosen(share, random, k)) packed[k] = bits;
    }
    void add(const Incoming& other, float share, uint32_t random) {
        for (uint32_t k = 0; k < kCount; ++k)
            if (isChosen(share, random, k)) packed[k] = other.packed[k];
    }

  private:
    // Octahedra: the lower half lies folded over the upper one.
    static glm::vec2 folded(const glm::vec3& d) {
        return {std::copysign(1 - std::abs(d.y), d.x), std::copysign(1 - std::abs(d.x), d.y)};
    }
    static bool isChosen(float share, uint32_t random, uint32_t k) {
        return float(hash(random, k) >> 8) * 0x1p-24f < share;
    }

    std::array<uint32_t, kCount> packed{};
};

}  // namespace raybundle
