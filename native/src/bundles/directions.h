// SPDX-License-Identifier: GPL-3.0-or-later
//
// Directions of bundles. Each kind of sequence is a DirectionSequence in its own file, a row of the
// table in directions.cpp, and a row of kDirectionKinds (job/choices.h), which holds its abilities.
// This file holds what all kinds share: two independent halves, roll and shift.
//
// Sources: thesis sections 4.2.1 (uniform random), 4.5 (adaptive) and 7.3.1 (quasi-Monte Carlo).
// Differs: a sequence covers a hemisphere, since a line serves both ways.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <glm/glm.hpp>
#include <memory>
#include <random>
#include <vector>

#include "job/choices.h"
#include "sampling/mix_bits.h"

namespace raybundle {

// The noise of a result falls about with this power of the number of bundles.
constexpr double kNoiseSlope = 0.65;

// A bundle: all lines along `direction`. The orthonormal frame (right, up, direction) contains the
// random roll. The pixel grid of the transillumination plane is moved by `shift`, in pixels, in
// [0, 1)^2.
struct Bundle {
    glm::dvec3 right, up, direction;
    glm::dvec2 shift;
    uint32_t half;      // 0 or 1: the independent half that the bundle belongs to
    uint32_t index;     // index in the sequence of the half
    double weight = 1;  // uniform density of directions over the density of the sequence
};

// Returns an identifier of the bundle's lines. Together with a pixel it decides by chance which
// lines pass patches that let light through (patches/opacity.h).
inline uint64_t lineName(const Bundle& bundle) {
    uint64_t name = mixBits(uint64_t(bundle.half) << 32 | bundle.index);
    // The grid's shift depends on the seed of the directions.
    for (double x : {bundle.shift.x, bundle.shift.y}) {
        uint64_t bits;
        std::memcpy(&bits, &x, sizeof bits);
        name = mixBits(name ^ bits);
    }
    return name;
}

// A direction (unit vector) and its weight (see Bundle::weight).
struct Direction {
    glm::dvec3 direction;
    double weight = 1;
};

// Generates the directions of one half of the bundles.
class DirectionSequence {
  public:
    virtual ~DirectionSequence() = default;

    // Returns the direction with this index, on the hemisphere. `random` is used for this direction
    // alone.
    virtual Direction at(uint32_t index, std::mt19937_64& random) = 0;

    // Reports the power that the bundle along `direction` transported, W, not multiplied by the
    // weight of the direction. Not called by transports that move no power while they trace.
    virtual void learn(const glm::dvec3& /*direction*/, double /*power*/) {}
};

// Returns a number uniform in [0, 1), equal on every platform (std::uniform_real_distribution is
// not).
double uniform(std::mt19937_64& random);
// Maps [0, 1)^2 to the upper hemisphere, uniformly by solid angle.
glm::dvec3 onHemisphere(double u, double v);
// Returns a uniform random rotation. Source: Shoemake, "Uniform Random Rotations" (Graphics Gems
// III, 1992).
glm::dmat3 randomRotation(std::mt19937_64& random);

// The endless sequence of bundles given by a kind, a seed and the index of its first bundle.
class Directions {
  public:
    // `first` must be even.
    Directions(DirectionKind kind, uint32_t seed, uint32_t first = 0);

    // Returns the next `count` bundles. `count` must be even. The first half of the result belongs
    // to half 0, the second to half 1.
    std::vector<Bundle> next(uint32_t count);

    // Reports the power that a bundle transported, W (see DirectionSequence::learn).
    void learn(const Bundle& bundle, double power) {
        sequences[bundle.half]->learn(bundle.direction, power);
    }

  private:
    const uint32_t seed;
    uint32_t done;  // number of bundles of both halves so far
    std::array<std::unique_ptr<DirectionSequence>, 2> sequences;
};

}  // namespace raybundle
