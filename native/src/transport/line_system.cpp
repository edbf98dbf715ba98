// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/line_system.h"

#include <tbb/parallel_reduce.h>

#include <functional>

namespace raybundle {
namespace {

constexpr size_t kGrain = 2048;  // sides per task of a sum

// Returns sum_j c_ij x_j of row i. `Value` is float or Eigen::Array4f.
template <class Value>
Value rowTimes(const LineCounts& counts, Half half, size_t row, const std::vector<Value>& x,
               const Value& zero) {
    const LineRows::LinesOf<float>& lines = LineRows::linesOf<float>();
    // Several sums, so that additions do not wait for each other.
    constexpr int kSums = 4;
    Value sums[kSums] = {zero, zero, zero, zero};
    for (size_t h = 0; h < 2; ++h) {
        if (half != Half::BOTH && half != Half(h)) continue;
        const uint32_t* e = counts.rows(h).first(uint32_t(row));
        const uint32_t* const last = counts.rows(h).last(uint32_t(row));
        for (; e + kSums <= last; e += kSums)
            for (int k = 0; k < kSums; ++k)
                sums[k] += lines[e[k] & 255] * x[LineRows::sideOf(e[k])];
        for (; e < last; ++e) sums[0] += lines[*e & 255] * x[LineRows::sideOf(*e)];
    }
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

}  // namespace

glm::dvec3 dot(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b,
               const std::vector<bool>* which) {
    return tbb::parallel_deterministic_reduce(
        tbb::blocked_range<size_t>(0, a.size(), kGrain), glm::dvec3(0.0),
        [&](const auto& range, glm::dvec3 sum) {
            for (size_t i = range.begin(); i < range.end(); ++i)
                if (!which || (*which)[i]) sum += glm::dvec3(a[i]) * glm::dvec3(b[i]);
            return sum;
        },
        std::plus<>());
}

float weightedLines(const LineCounts& counts, Half half, size_t side, const std::vector<float>& x) {
    return float(linesOf(counts.sky[side], half)) + rowTimes<float>(counts, half, side, x, 0.0f);
}

glm::vec3 LineSystem::brought(size_t side) const {
    const Eigen::Array4f sum =
        rowTimes<Eigen::Array4f>(counts, half, side, sent, Eigen::Array4f::Zero());
    return {sum[0], sum[1], sum[2]};
}

}  // namespace raybundle
