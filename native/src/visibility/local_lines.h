// SPDX-License-Identifier: GPL-3.0-or-later
//
// Local lines of first shots. They carry power from emitters (light sources or patch sides) to the
// sides that they meet first. Random walks, whose rays choose their source one by one, use
// transport/local_rays.h.
//
// Sources: thesis sections 2.4.2 (fig. 2.11) and 3.3 (fig. 3.5).
// Differs:
// - Lines are allotted to emitters systematically: n_k = floor(number expected up to k + xi) -
//   number sent so far. The thesis' real `numberOfRays` would be cut to 0 for weak emitters.
// - The variance is stored with the sum. For n lines of an emitter, each of which carries the power
//   w with the probability p, it is n w^2 p (1 - p). For one source of power Phi, the variance of
//   the irradiance H is H (Phi / A - H) / N.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <random>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// Returns the number of lines of each emitter such that the partial sums follow those of
// `expected`. `xi` is in [0, 1). Throws Error(INVALID_ARGUMENT) if a partial sum is not finite.
std::vector<uint64_t> allotLines(const std::vector<double>& expected, double xi);

// The end of one line.
struct LineEnd {
    static constexpr uint32_t kSky = UINT32_MAX;  // the line meets nothing
    // The line could not leave; it carries nothing.
    static constexpr uint32_t kNowhere = UINT32_MAX - 1;
    // Patch side that the line meets, or one of the constants above.
    uint32_t side = kNowhere;
    glm::vec3 weight{1.0f};  // factor on the power of a line, by channel
};

// Returns whether a line that leaves `side` meets, at `met`, a surface that covers the side there.
// No light enters the gap between the two. `distance` is the length of the line and `touchDistance`
// the largest gap, both in metres.
bool isCovered(const Patches& patches, uint32_t side, uint32_t met, const glm::vec3& direction,
               float distance);

// Returns four random numbers, uniform in [0, 1).
glm::vec4 uniformPoint(std::mt19937_64& random);

// Casts a line of an emitter and returns its end. Called from several threads.
using CastLine = std::function<LineEnd(size_t emitter, std::mt19937_64& random)>;

// The power that local lines have carried, in W by channel.
struct LocalLines {
    // Starts with all sums zero.
    LocalLines(size_t sides, size_t emitters)
        : received(sides), variance(sides), arrived(emitters), missed(emitters) {}

    // Casts counts[k] lines of each emitter k. Each line carries the power perLine[k], W. Adds the
    // received power times `scale`. `stream` seeds the random numbers. The result does not depend
    // on the number of threads. `checkCancel` is called now and then, and may throw.
    void cast(const std::vector<uint64_t>& counts, const std::vector<glm::dvec3>& perLine,
              const CastLine& castLine, const std::array<uint32_t, 3>& stream, double scale,
              const std::function<void()>& checkCancel);

    std::vector<glm::dvec3> received;  // per patch side, W
    std::vector<glm::dvec3> variance;  // per patch side: variance of `received`, W^2
    std::vector<glm::dvec3> arrived;   // per emitter: power that arrives on any side, W
    std::vector<glm::dvec3> missed;    // per emitter: power of lines that meet nothing, W
    uint64_t lines = 0;
};

}  // namespace raybundle
