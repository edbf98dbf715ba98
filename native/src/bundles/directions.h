// SPDX-License-Identifier: GPL-3.0-or-later
//
// Directions of bundles. Each kind is a DirectionSequence in a file of its own, a row of the table
// in directions.cpp, and a row of kDirectionKinds (job/choices.h), which says what it can do.
// What all kinds have in common (two independent halves, roll, shift) is here.
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

// The noise of what bundles tell falls with their number to about this power.
constexpr double kNoiseSlope = 0.65;

// One bundle: all lines along `direction`. The orthonormal frame (right, up, direction) carries the
// random roll; shift in [0, 1)^2 moves the pixel grid, in pixels.
struct Bundle {
    glm::dvec3 right, up, direction;
    glm::dvec2 shift;
    uint32_t half;      // 0 or 1: of the two independent sets, for the error estimate
    uint32_t index;     // in the half's sequence
    double weight = 1;  // uniform density of directions over that of the sequence
};

// The name of its lines, to be joined with a pixel, where patches let lines through by chance
// (patches/opacity.h).
inline uint64_t lineName(const Bundle& bundle) {
    uint64_t name = mixBits(uint64_t(bundle.half) << 32 | bundle.index);
    // The grid's shift carries the seed of the directions.
    for (double x : {bundle.shift.x, bundle.shift.y}) {
        uint64_t bits;
        std::memcpy(&bits, &x, sizeof bits);
        name = mixBits(name ^ bits);
    }
    return name;
}

// A direction with its weight (see Bundle).
struct Direction {
    glm::dvec3 direction;
    double weight = 1;
};

// The directions of one half.
class DirectionSequence {
  public:
    virtual ~DirectionSequence() = default;

    // Direction `index` on the hemisphere; `random` is for this direction alone.
    virtual Direction at(uint32_t index, std::mt19937_64& random) = 0;

    // Tells how much power the bundle along a direction transported, W, without the weight it had.
    // Not called by transports that transport nothing while they trace.
    virtual void learn(const glm::dvec3& /*direction*/, double /*power*/) {}
};

// Uniform in [0, 1), alike on every platform (std::uniform_real_distribution is not).
double uniform(std::mt19937_64& random);
// From [0, 1)^2 to the upper hemisphere, by area.
glm::dvec3 onHemisphere(double u, double v);
// Shoemake, "Uniform Random Rotations" (Graphics Gems III, 1992).
glm::dmat3 randomRotation(std::mt19937_64& random);

// The bundles of an endless sequence given by kind and seed.
class Directions {
  public:
    Directions(DirectionKind kind, uint32_t seed, uint32_t first = 0);

    // The next `count` bundles: count is even and half of them belong to each half, those of the
    // first coming first.
    std::vector<Bundle> next(uint32_t count);

    void learn(const Bundle& bundle, double power) {
        sequences[bundle.half]->learn(bundle.direction, power);
    }

  private:
    const uint32_t seed;
    uint32_t done;  // bundles of both halves
    std::array<std::unique_ptr<DirectionSequence>, 2> sequences;
};

}  // namespace raybundle
