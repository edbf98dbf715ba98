// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/directions.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>
#include <random>

namespace raybundle {
namespace {

// std::uniform_real_distribution differs between standard libraries; results must not.
double uniform(std::mt19937_64& random) { return double(random() >> 11) * 0x1p-53; }

// Shoemake, "Uniform Random Rotations" (Graphics Gems III, 1992).
glm::dquat randomRotation(std::mt19937_64& random) {
    const double u = uniform(random);
    const double a = glm::two_pi<double>() * uniform(random);
    const double b = glm::two_pi<double>() * uniform(random);
    const double r0 = std::sqrt(1 - u), r1 = std::sqrt(u);
    return glm::dquat(r1 * std::cos(b), r0 * std::sin(a), r0 * std::cos(a), r1 * std::sin(b));
}

Bundle makeBundle(const glm::dvec3& direction, uint32_t half, std::mt19937_64& random) {
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
    return bundle;
}

glm::dvec3 onHemisphere(double u, double v) {
    const double r = std::sqrt(std::max(0.0, 1 - u * u)), phi = glm::two_pi<double>() * v;
    return {r * std::cos(phi), r * std::sin(phi), u};
}

// Bundle `index` of a half with low discrepancy: the R2 sequence, whose steps are the powers of the
// inverse of the plastic number, mapped to the hemisphere by area.
glm::dvec3 lowDiscrepancyDirection(uint32_t index) {
    constexpr double kPlastic = 1.32471795724474602596;
    const double u = std::fmod(0.5 + index / kPlastic, 1.0);
    const double v = std::fmod(0.5 + index / (kPlastic * kPlastic), 1.0);
    return onHemisphere(u, v);
}

}  // namespace

std::vector<Bundle> bundles(DirectionKind kind, uint32_t seed, uint32_t first, uint32_t count) {
    assert(first % 2 == 0 && count % 2 == 0 && "two halves of equal size");
    std::vector<Bundle> result;
    result.reserve(count);
    for (uint32_t half = 0; half < 2; ++half) {
        std::seed_seq setWords{seed, half};
        std::mt19937_64 setRandom(setWords);
        const glm::dquat rotation = randomRotation(setRandom);
        for (uint32_t index = first / 2; index < (first + count) / 2; ++index) {
            std::seed_seq words{seed, half, index + 1};
            std::mt19937_64 random(words);
            const glm::dvec3 direction = kind == DirectionKind::RANDOM
                                             ? onHemisphere(uniform(random), uniform(random))
                                             : rotation * lowDiscrepancyDirection(index);
            result.push_back(makeBundle(direction, half, random));
        }
    }
    return result;
}

}  // namespace raybundle
