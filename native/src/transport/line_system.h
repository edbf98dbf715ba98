// SPDX-License-Identifier: GPL-3.0-or-later
//
// The symmetric matrix C of the line counts of some bundles, and sums of fields per side, as the
// solve of LINE_REUSE (transport/line_reuse.h) needs them.
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

// The sum of a_i b_i over the sides that `which` holds for (null: all), by channel. It is summed in
// double precision, in an order that does not depend on the number of threads.
glm::dvec3 dot(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b,
               const std::vector<bool>* which = nullptr);

// Of the lines of a side in each half, those of the bundles that an estimate looks at.
inline uint32_t linesOf(const std::array<uint32_t, 2>& lines, Half half) {
    return half == Half::BOTH ? lines[0] + lines[1] : lines[size_t(half)];
}

// The lines of a side, each counted x_j times, j the side at its other end, and once where it
// leaves the scene. x: per side.
float weightedLines(const LineCounts& counts, Half half, size_t side, const std::vector<float>& x);

// Multiplies the line counts of a half, or of both, with what the sides send along their lines.
class LineSystem {
  public:
    // Everything passed must outlive the object. weights: of the same half.
    LineSystem(const LineCounts& counts, Half half, const LineWeights& weights)
        : counts(counts), half(half), weights(weights), sent(counts.sideCount()) {}

    size_t sideCount() const { return sent.size(); }
    // x_i and m_i of a side.
    float x(size_t side) const { return weights.x[side]; }
    float m(size_t side) const { return weights.m[side]; }
    // Lines of a side that leave the scene.
    float skyLines(size_t side) const { return float(linesOf(counts.sky[side], half)); }

    // From now on side i sends valueAt(i) along each of its lines.
    template <class ValueAt>
    void send(const ValueAt& valueAt) {
        forEachSide(sent.size(), [&](size_t i) {
            const glm::vec3 value = valueAt(i);
            sent[i] = {value.x, value.y, value.z, 0};
        });
    }
    // What all lines of a side bring of that: sum_j c_ij value_j.
    glm::vec3 brought(size_t side) const;

  private:
    const LineCounts& counts;
    const Half half;
    const LineWeights& weights;
    // Per side. Padded, so that one SIMD register holds the channels.
    std::vector<Eigen::Array4f> sent;
};

}  // namespace raybundle
