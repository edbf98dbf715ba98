// SPDX-License-Identifier: GPL-3.0-or-later
//
// Local lines that carry power from emitters (light sources, patch sides) to the sides that they
// meet first, and what they bring: for first shots. (Rays that choose their source one by one, for
// walks: transport/local_rays.h.)
//
// Sources: thesis sections 2.4.2 (fig. 2.11) and 3.3 (fig. 3.5).
// Differs:
// - Lines are allotted to emitters systematically, n_k = floor(expected up to k + xi) - sent: the
//   thesis' real `numberOfRays` would be cut to 0 for weak emitters.
// - The variance is kept with the sum: of n lines of an emitter, each of which brings its power w
//   with probability p, n w^2 p (1 - p). For one source of power Phi that is H (Phi / A - H) / N.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <random>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

// Whole numbers of lines whose partial sums follow those of the expected numbers; xi in [0, 1).
// Throws Error(INVALID_ARGUMENT) where one is no finite number.
std::vector<uint64_t> allotLines(const std::vector<double>& expected, double xi);

// Where one line ended.
struct LineEnd {
    static constexpr uint32_t kSky = UINT32_MAX;          // met nothing
    static constexpr uint32_t kNowhere = UINT32_MAX - 1;  // could not leave: nothing was carried
    uint32_t side = kNowhere;
    glm::vec3 weight{1.0f};  // times the power of a line, by channel
};

// Whether a line that left a side met at once what covers the side there: it is dark in between.
bool isCovered(const Patches& patches, uint32_t side, uint32_t met, const glm::vec3& direction,
               float distance);

// Four random numbers, uniform in [0, 1).
glm::vec4 uniformPoint(std::mt19937_64& random);

// Casts a line of an emitter.
using CastLine = std::function<LineEnd(size_t emitter, std::mt19937_64& random)>;

// What lines brought; power in W of each channel.
struct LocalLines {
    // No lines yet.
    LocalLines(size_t sides, size_t emitters)
        : received(sides), variance(sides), arrived(emitters), missed(emitters) {}

    // Casts counts[k] lines of emitter k with the power perLine[k] each, and adds what they bring
    // times `scale`. `stream` names their random numbers. The result does not depend on the number
    // of threads.
    void cast(const std::vector<uint64_t>& counts, const std::vector<glm::dvec3>& perLine,
              const CastLine& castLine, const std::array<uint32_t, 3>& stream, double scale,
              const std::function<void()>& checkCancel);

    std::vector<glm::dvec3> received;  // per side
    std::vector<glm::dvec3> variance;  // per side, of what it received, W^2
    std::vector<glm::dvec3> arrived;   // per emitter: on any side
    std::vector<glm::dvec3> missed;    // per emitter: met nothing
    uint64_t lines = 0;
};

}  // namespace raybundle
