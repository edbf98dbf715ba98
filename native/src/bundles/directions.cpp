// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/directions.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>

namespace raybundle {

// Constructors of the sequences. Each has its own file, except the uniform random one below.
std::unique_ptr<DirectionSequence> lowDiscrepancyDirections(std::mt19937_64& random);
std::unique_ptr<DirectionSequence> randomDirections(std::mt19937_64& random);
std::unique_ptr<DirectionSequence> adaptiveDirections(std::mt19937_64& random);

namespace {

struct SequenceKind {
    DirectionKind value;
    // `random` is that of the half.
    std::unique_ptr<DirectionSequence> (*make)(std::mt19937_64& random);
};
constexpr SequenceKind kKinds[] = {
    {DirectionKind::LOW_DISCREPANCY, lowDiscrepancyDirections},
    {DirectionKind::RANDOM, randomDirections},
    {DirectionKind::ADAPTIVE, adaptiveDirections},
};
static_assert(hasEveryValue(kKinds));

// RANDOM: uniform and independent directions (thesis section 4.2.1).
class RandomDirections : public DirectionSequence {
  public:
    Direction at(uint32_t, std::mt19937_64& random) override {
        const double u = uniform(random);
        return {onHemisphere(u, uniform(random))};
    }
};

Bundle makeBundle(const Direction& along, uint32_t half, uint32_t index, std::mt19937_64& random) {
    const glm::dvec3& direction = along.direction;
    const glm::dvec3 axis = std::abs(direction.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
    const glm::dvec3 x = glm::normalize(glm::cross(axis, direction));
    const glm::dvec3 y = glm::cross(direction, x);
    const double roll = glm::two_pi<double>() * uniform(random);
    Bundle bundle;
    bundle.right = std::cos(roll) * x + std::sin(roll) * y;
    bundle.up = -std::sin(roll) * x + std::cos(roll) * y;
    bundle.direction = direction;
    bundle.shift.x = uniform(random);
    bundle.shift.y = uniform(random);
    bundle.half = half;
    bundle.index = index;
    bundle.weight = along.weight;
    return bundle;
}

}  // namespace

double uniform(std::mt19937_64& random) { return double(random() >> 11) * 0x1p-53; }

glm::dvec3 onHemisphere(double u, double v) {
    const double r = std::sqrt(std::max(0.0, 1 - u * u)), phi = glm::two_pi<double>() * v;
    return {r * std::cos(phi), r * std::sin(phi), u};
}

glm::dmat3 randomRotation(std::mt19937_64& random) {
    const double u = uniform(random);
    const double a = glm::two_pi<double>() * uniform(random);
    const double b = glm::two_pi<double>() * uniform(random);
    const double r0 = std::sqrt(1 - u), r1 = std::sqrt(u);
    return glm::mat3_cast(
        glm::dquat(r1 * std::cos(b), r0 * std::sin(a), r0 * std::cos(a), r1 * std::sin(b)));
}

std::unique_ptr<DirectionSequence> randomDirections(std::mt19937_64&) {
    return std::make_unique<RandomDirections>();
}

Directions::Directions(DirectionKind kind, uint32_t seed, uint32_t first)
    : seed(seed), done(first) {
    assert(first % 2 == 0 && "two halves of equal size");
    for (uint32_t half = 0; half < 2; ++half) {
        std::seed_seq words{seed, half};
        std::mt19937_64 random(words);
        sequences[half] = kKinds[size_t(kind)].make(random);
    }
}

std::vector<Bundle> Directions::next(uint32_t count) {
    assert(count % 2 == 0 && "two halves of equal size");
    std::vector<Bundle> bundles;
    bundles.reserve(count);
    for (uint32_t half = 0; half < 2; ++half)
        for (uint32_t index = done / 2; index < (done + count) / 2; ++index) {
            std::seed_seq words{seed, half, index + 1};
            std::mt19937_64 random(words);
            const Direction direction = sequences[half]->at(index, random);
            bundles.push_back(makeBundle(direction, half, index, random));
        }
    done += count;
    return bundles;
}

}  // namespace raybundle
