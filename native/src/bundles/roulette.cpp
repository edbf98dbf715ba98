// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/roulette.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "sampling/sobol.h"

namespace raybundle {

void Roulette::begin(const Bundle& bundle) {
    // The grid's shift depends on the seed of the directions.
    uint64_t bits;
    static_assert(sizeof bits == sizeof bundle.shift.x);
    std::memcpy(&bits, &bundle.shift.x, sizeof bits);
    seed = hash(hash(uint32_t(bits), uint32_t(bits >> 32)), 2 * bundle.index + bundle.half);
}

bool Roulette::isDrawn(uint32_t patch, double projectedArea) const {
    return double(hash(seed, patch)) * 0x1p-32 < projectedArea;
}

namespace {

// The pixels along an axis whose centres lie in [low, high), or the one in the middle if there is
// none.
struct Range {
    Range(double low, double high)
        : first(int(std::ceil(low - 0.5))), last(int(std::ceil(high - 0.5))) {
        isEnlarged = first >= last;
        if (!isEnlarged) return;
        first = int(std::floor(0.5 * (low + high)));
        last = first + 1;
    }
    // Returns the coordinate at which the polygon is cut for row or column k of the range.
    double cut(int k, double low, double high) const {
        return isEnlarged ? 0.5 * (low + high) : k + 0.5;
    }

    int first, last;
    bool isEnlarged;
};

struct Interval {
    double low = std::numeric_limits<double>::max(), high = -low;
    void add(double x) {
        low = std::min(low, x);
        high = std::max(high, x);
    }
};

Interval extent(const glm::dvec2* corners, int count, int axis) {
    Interval e;
    for (int k = 0; k < count; ++k) e.add(corners[k][axis]);
    return e;
}

// Returns the extent of the polygon along the other axis, where its coordinate `axis` equals c.
Interval crossSection(const glm::dvec2* corners, int count, int axis, double c) {
    Interval e;
    for (int k = 0; k < count; ++k) {
        const glm::dvec2 &p = corners[k], &q = corners[(k + 1) % count];
        if ((p[axis] < c) == (q[axis] < c)) continue;
        e.add(p[1 - axis] + (c - p[axis]) / (q[axis] - p[axis]) * (q[1 - axis] - p[1 - axis]));
    }
    return e;
}

}  // namespace

const std::vector<Pixel>& PolygonFiller::fill(const glm::dvec2* corners, int count) {
    pixels.clear();
    const Interval x = extent(corners, count, 0), y = extent(corners, count, 1);
    const Range columns(x.low, x.high), rows(y.low, y.high);
    filledColumns.assign(size_t(columns.last - columns.first), false);
    for (int row = rows.first; row < rows.last; ++row) {
        const Interval span = crossSection(corners, count, 1, rows.cut(row, y.low, y.high));
        if (span.low > span.high) continue;
        const Range filled(span.low, span.high);
        for (int column = filled.first; column < filled.last; ++column) {
            pixels.push_back({column, row});
            if (column >= columns.first && column < columns.last)
                filledColumns[size_t(column - columns.first)] = true;
        }
    }
    for (int column = columns.first; column < columns.last; ++column) {
        if (filledColumns[size_t(column - columns.first)]) continue;
        const Interval span = crossSection(corners, count, 0, columns.cut(column, x.low, x.high));
        if (span.low > span.high) continue;
        pixels.push_back({column, int(std::floor(0.5 * (span.low + span.high)))});
    }
    return pixels;
}

}  // namespace raybundle
