// SPDX-License-Identifier: GPL-3.0-or-later
//
// The symmetric matrix C of the line counts of some bundles, and sums over sides, for the solve of
// LINE_REUSE (transport/line_reuse.h).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "bundles/line_counts.h"
#include "transport/line_reuse.h"
#include "transport/transport.h"

namespace raybundle {

// Returns the sum of a_i b_i over the sides that `which` marks (null: over all sides), by channel.
// The sum is computed in double precision, in an order that does not depend on the number of
// threads.
glm::dvec3 dot(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b,
               const std::vector<bool>* which = nullptr);

// Returns the number of a side's lines in the bundles of `half`. `lines` has the number for each
// half.
inline uint32_t linesOf(const std::array<uint32_t, 2>& lines, Half half) {
    return half == Half::BOTH ? lines[0] + lines[1] : lines[size_t(half)];
}

// Returns the weighted number of lines of a side: lines to a side j count x_j times, lines that
// leave the scene count once. `x` is per side.
float weightedLines(const LineCounts& counts, Half half, size_t side, const std::vector<float>& x);

// Multiplies the line counts of a half, or of both, with the light that sides send along their
// lines.
class LineSystem {
  public:
    // `weights` must be those of `half`. All references must outlive the object.
    LineSystem(const LineCounts& counts, Half half, const LineWeights& weights)
        : counts(counts), half(half), weights(weights), sent(counts.sideCount()) {}

    size_t sideCount() const { return sent.size(); }
    // Return x_i and m_i of a side (LineWeights).
    float x(size_t side) const { return weights.x[side]; }
    float m(size_t side) const { return weights.m[side]; }
    // Returns the number of lines of a side that leave the scene, unweighted.
    float skyLines(size_t side) const { return float(linesOf(counts.sky[side], half)); }

    // Makes each side i send valueAt(i) along each of its lines, until the next call.
    template <class ValueAt>
    void send(const ValueAt& valueAt) {
        forEachSide(sent.size(), [&](size_t i) {
            const glm::vec3 value = valueAt(i);
            sent[i] = {value.x, value.y, value.z, 0};
        });
    }
    // Returns the sum of the values that the lines of a side bring: sum_j c_ij valueAt(j).
    glm::vec3 brought(size_t side) const;

  private:
    const LineCounts& counts;
    const Half half;
    const LineWeights& weights;
    // Per side: the value it sends. Padded, so that one SIMD register holds the channels.
    std::vector<Eigen::Array4f> sent;
};

}  // namespace raybundle
