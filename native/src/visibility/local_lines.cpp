// SPDX-License-Identifier: GPL-3.0-or-later
#include "visibility/local_lines.h"

#include <algorithm>
#include <cmath>

#include "job/cancellation.h"
#include "job/error.h"
#include "patches/coincidence.h"

namespace raybundle {
namespace {

// kBatch lines share a random generator. The cancel flag is checked every kSlice lines.
constexpr uint64_t kBatch = 1024, kSlice = 256 * kBatch;

// Sums the weights of one emitter's lines on each side, until they are added to the sums of all
// emitters.
class Tally {
  public:
    explicit Tally(size_t sides) : weight(sides), squares(sides) {}

    void add(uint32_t side, const glm::dvec3& w) {
        if (weight[side] == glm::dvec3(0.0)) touched.push_back(side);
        weight[side] += w;
        squares[side] += w * w;
    }

    // Adds the sums times `scale`, and their variance, to `sums`. Resets the sums.
    void moveTo(LocalLines& sums, uint64_t lines, const glm::dvec3& perLine, double scale) {
        const double n = double(lines);
        for (uint32_t side : touched) {
            glm::dvec3& w = weight[side];
            glm::dvec3& w2 = squares[side];
            // The variance of a single line is unknown. Its second moment is an upper bound, close
            // if p is small.
            const glm::dvec3 variance = lines > 1 ? n / (n - 1) * (w2 - w * w / n) : w2;
            sums.received[side] += scale * w * perLine;
            sums.variance[side] +=
                scale * scale * glm::max(glm::dvec3(0.0), variance) * perLine * perLine;
            w = w2 = glm::dvec3(0.0);
        }
        touched.clear();
    }

  private:
    std::vector<glm::dvec3> weight, squares;  // per side
    std::vector<uint32_t> touched;            // sides with a non-zero weight
};

}  // namespace

std::vector<uint64_t> allotLines(const std::vector<double>& expected, double xi) {
    std::vector<uint64_t> counts(expected.size());
    double sum = 0;
    uint64_t sent = 0;
    for (size_t k = 0; k < expected.size(); ++k) {
        sum += expected[k];
        if (!std::isfinite(sum))
            throw invalidArgument(
                "the lights are too bright: their power is not a finite number; reduce their "
                "strength");
        const uint64_t upTo = uint64_t(std::floor(sum + xi));
        counts[k] = upTo - sent;
        sent = upTo;
    }
    return counts;
}

bool isCovered(const Patches& patches, uint32_t side, uint32_t met, const glm::vec3& direction,
               float distance) {
    return distance * glm::dot(direction, patches.normal(side)) <=
               patches.islandAt(side).touchDistance &&
           pointAgainst(patches, side, met);
}

glm::vec4 uniformPoint(std::mt19937_64& random) {
    glm::vec4 u;
    for (int k = 0; k < 4; ++k) u[k] = float(random() >> 40) * 0x1p-24f;
    return u;
}

void LocalLines::cast(const std::vector<uint64_t>& counts, const std::vector<glm::dvec3>& perLine,
                      const CastLine& castLine, const std::array<uint32_t, 3>& stream, double scale,
                      const std::function<void()>& checkCancel) {
    std::vector<uint64_t> end(counts.size());  // per emitter: lines of all emitters up to this one
    uint64_t total = 0;
    for (size_t k = 0; k < counts.size(); ++k) end[k] = total += counts[k];
    lines += total;

    Tally tally(received.size());
    std::vector<LineEnd> ends(size_t(std::min(kSlice, total)));
    size_t emitter = 0;
    uint64_t left = counts.empty() ? 0 : counts[0];  // lines of the emitter that are not yet added
    for (uint64_t slice = 0; slice < total; slice += kSlice) {
        checkCancel();
        const uint64_t sliceEnd = std::min(slice + kSlice, total);
        parallelFor(uint64_t(0), (sliceEnd - slice + kBatch - 1) / kBatch, [&](uint64_t b) {
            const uint64_t first = slice + b * kBatch, last = std::min(first + kBatch, sliceEnd);
            std::seed_seq seeds{stream[0], stream[1], stream[2], uint32_t(first / kBatch)};
            std::mt19937_64 random(seeds);
            size_t k = size_t(std::upper_bound(end.begin(), end.end(), first) - end.begin());
            for (uint64_t line = first; line < last; ++line) {
                while (line >= end[k]) ++k;
                ends[line - slice] = castLine(k, random);
            }
        });
        // Add in the order of the lines, whatever thread cast them.
        for (uint64_t line = slice; line < sliceEnd; ++line) {
            while (left == 0) {
                tally.moveTo(*this, counts[emitter], perLine[emitter], scale);
                left = counts[++emitter];
            }
            --left;
            const LineEnd& lineEnd = ends[line - slice];
            if (lineEnd.side == LineEnd::kNowhere || lineEnd.weight == glm::vec3(0.0f)) continue;
            const glm::dvec3 weight(lineEnd.weight);
            if (lineEnd.side == LineEnd::kSky) {
                missed[emitter] += scale * weight * perLine[emitter];
            } else {
                arrived[emitter] += scale * weight * perLine[emitter];
                tally.add(lineEnd.side, weight);
            }
        }
    }
    if (total > 0) tally.moveTo(*this, counts[emitter], perLine[emitter], scale);
}

}  // namespace raybundle
