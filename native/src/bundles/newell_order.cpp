// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/newell_order.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "bundles/depth_order.h"

namespace raybundle {
namespace {

constexpr double kRoundingOfRadius = 1e-6;
constexpr double kShapesPerCell = 4;
constexpr int kMaxCells = 2048;  // along each axis of the plane

using Interval = std::pair<double, double>;

// Returns the range of a coordinate over the corners of a patch. `corner` is the coordinate of its
// first corner, `da` and `db` are the changes along its edges.
Interval interval(double corner, double da, double db, bool isTriangle) {
    if (isTriangle) return {corner + std::min({0.0, da, db}), corner + std::max({0.0, da, db})};
    return {corner + std::min(0.0, da) + std::min(0.0, db),
            corner + std::max(0.0, da) + std::max(0.0, db)};
}

}  // namespace

NewellOrder::NewellOrder(const Patches& patches)
    : patches(patches),
      coincidence(DepthOrder(patches).coincidence()),
      rounding(kRoundingOfRadius * double(patches.radius)),
      frames(patches.parents.size()) {}

uint64_t NewellOrder::sort(const Bundle& bundle, std::vector<uint32_t>& drawn) {
    cycles = 0;
    place(bundle, drawn);
    fillGrid();
    findEdges();
    draw(drawn);
    return cycles;
}

void NewellOrder::place(const Bundle& bundle, const std::vector<uint32_t>& drawn) {
    direction = bundle.direction;
    auto turned = [&](const glm::dvec3& v) {
        return glm::dvec3(glm::dot(v, bundle.right), glm::dot(v, bundle.up),
                          glm::dot(v, bundle.direction));
    };
    for (size_t k = 0; k < frames.size(); ++k) {
        const Parent& parent = patches.parents[k];
        ParentFrame& f = frames[k];
        f.origin = turned(glm::dvec3(parent.origin));
        f.a = turned(glm::dvec3(parent.a)) / double(parent.countA);
        f.b = turned(glm::dvec3(parent.b)) / double(parent.countB);
        f.normal = glm::normalize(glm::cross(f.a, f.b));
        if (f.normal.z < 0) f.normal = -f.normal;
        const glm::dvec2 along[3] = {f.a, f.b, glm::dvec2(f.b - f.a)};
        f.axisCount = parent.isTriangle ? 3 : 2;
        for (int axis = 0; axis < f.axisCount; ++axis) {
            const double length = glm::length(along[axis]);
            f.axes[axis] =
                length > 0 ? glm::dvec2(-along[axis].y, along[axis].x) / length : glm::dvec2(1, 0);
        }
    }

    byDepth.clear();
    std::vector<Shape> unsorted;
    unsorted.reserve(drawn.size());
    for (uint32_t patch : drawn) {
        Shape s;
        s.parent = patches.parentOf[patch];
        const Parent& parent = patches.parents[s.parent];
        const ParentFrame& f = frames[s.parent];
        // The first corner is that of (0, 0). The second shows whether a triangle is upside down.
        const uint32_t inParent = patch - parent.firstPatch;
        // Length of the patch's edges relative to a tile's.
        const double scale = std::ldexp(1.0, -parent.levelOf(inParent));
        const glm::dvec2 counts = glm::dvec2(parent.countA, parent.countB) / scale;
        const glm::dvec2 st = glm::dvec2(parent.pointOn(inParent, {0, 0})) * counts;
        s.turn = parent.isTriangle && parent.pointOn(inParent, {1, 0}).x < float(st.x / counts.x)
                     ? -scale
                     : scale;
        // Whole numbers, except for the rounding to float.
        s.corner = f.origin + scale * (std::round(st.x) * f.a + std::round(st.y) * f.b);
        std::tie(s.nearest, s.farthest) =
            interval(s.corner.z, s.turn * f.a.z, s.turn * f.b.z, parent.isTriangle);
        byDepth.emplace_back(s.nearest, uint32_t(unsorted.size()));
        unsorted.push_back(s);
    }
    std::sort(byDepth.begin(), byDepth.end());
    shapes.clear();
    patchOf.clear();
    for (const auto& [depth, k] : byDepth) {
        shapes.push_back(unsorted[k]);
        patchOf.push_back(drawn[k]);
    }
}

void NewellOrder::fillGrid() {
    bounds.clear();
    glm::dvec2 low(std::numeric_limits<double>::max()), high(-low);
    for (size_t k = 0; k < shapes.size(); ++k) {
        const Shape& s = shapes[k];
        const ParentFrame& f = frames[s.parent];
        const bool isTriangle = patches.parents[s.parent].isTriangle;
        const Interval x = interval(s.corner.x, s.turn * f.a.x, s.turn * f.b.x, isTriangle);
        const Interval y = interval(s.corner.y, s.turn * f.a.y, s.turn * f.b.y, isTriangle);
        low = glm::min(low, glm::dvec2(x.first, y.first));
        high = glm::max(high, glm::dvec2(x.second, y.second));
        bounds.push_back({float(x.first), float(x.second), float(y.first), float(y.second),
                          uint32_t(k), s.parent, 0, 0});
    }
    if (shapes.empty()) return;
    const glm::dvec2 size = high - low;
    const double cell = std::sqrt(kShapesPerCell * size.x * size.y / double(shapes.size()));
    auto cellCount = [&](double length) {
        return cell > 0 ? int(std::clamp(std::ceil(length / cell), 1.0, double(kMaxCells))) : 1;
    };
    columns = cellCount(size.x);
    rows = cellCount(size.y);
    const glm::dvec2 perMetre(size.x > 0 ? columns / size.x : 0, size.y > 0 ? rows / size.y : 0);
    auto column = [&](float x) {
        return std::clamp(int((double(x) - low.x) * perMetre.x), 0, columns - 1);
    };
    auto row = [&](float y) {
        return std::clamp(int((double(y) - low.y) * perMetre.y), 0, rows - 1);
    };
    // Count the entries of each cell, then fill the cells.
    cellEnd.assign(size_t(columns) * size_t(rows) + 1, 0);
    for (Entry& e : bounds) {
        e.column = uint16_t(column(e.x0));
        e.row = uint16_t(row(e.y0));
    }
    auto forEachCell = [&](const Entry& e, const auto& visit) {
        const int lastColumn = column(e.x1), lastRow = row(e.y1);
        for (int y = e.row; y <= lastRow; ++y)
            for (int x = e.column; x <= lastColumn; ++x)
                visit(size_t(y) * size_t(columns) + size_t(x));
    };
    for (const Entry& e : bounds) forEachCell(e, [&](size_t c) { ++cellEnd[c + 1]; });
    for (size_t c = 1; c < cellEnd.size(); ++c) cellEnd[c] += cellEnd[c - 1];
    entries.resize(cellEnd.back());
    // During this loop, cellEnd[c] moves from the beginning of cell c to its end.
    for (const Entry& e : bounds) forEachCell(e, [&](size_t c) { entries[cellEnd[c]++] = e; });
}

void NewellOrder::findEdges() {
    edges.clear();
    if (shapes.empty()) return;
    uint32_t begin = 0;
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            const uint32_t end = cellEnd[size_t(row) * size_t(columns) + size_t(column)];
            for (uint32_t k = begin; k < end; ++k) {
                const Entry& e = entries[k];
                for (uint32_t l = k + 1; l < end; ++l) {
                    const Entry& f = entries[l];
                    if (e.parent == f.parent) continue;
                    // Test (1).
                    if (e.x0 >= f.x1 || f.x0 >= e.x1 || e.y0 >= f.y1 || f.y0 >= e.y1) continue;
                    // Of the cells that both shapes cover, only the first compares them.
                    if (std::max(e.column, f.column) != column || std::max(e.row, f.row) != row)
                        continue;
                    const Order order = compare(shapes[e.shape], shapes[f.shape]);
                    if (order == Order::FIRST) edges.emplace_back(e.shape, f.shape);
                    if (order == Order::SECOND) edges.emplace_back(f.shape, e.shape);
                }
            }
            begin = end;
        }
}

NewellOrder::Order NewellOrder::compare(const Shape& p, const Shape& q) {
    if (!doProjectionsOverlap(p, q)) return Order::NONE;  // test (4)
    if (p.farthest <= q.nearest - coincidence) return Order::FIRST;
    if (q.farthest <= p.nearest - coincidence) return Order::SECOND;
    // Tests (2) and (3).
    const auto [pLow, pHigh] = distances(p, q.parent);
    if (pLow >= -rounding && pHigh <= rounding) return compareCoplanar(p, q, 0.5 * (pLow + pHigh));
    if (pHigh <= rounding) return Order::FIRST;
    if (pLow >= -rounding) return Order::SECOND;
    const auto [qLow, qHigh] = distances(q, p.parent);
    if (qLow >= -rounding && qHigh <= rounding) {
        const Order order = compareCoplanar(q, p, 0.5 * (qLow + qHigh));
        return order == Order::FIRST ? Order::SECOND : Order::FIRST;
    }
    if (qHigh <= rounding) return Order::SECOND;
    if (qLow >= -rounding) return Order::FIRST;
    return compareInOverlap(p, q);
}

bool NewellOrder::doProjectionsOverlap(const Shape& p, const Shape& q) const {
    const ParentFrame &f = frames[p.parent], &g = frames[q.parent];
    const bool isTriangleP = f.axisCount == 3, isTriangleQ = g.axisCount == 3;
    // The projections do not overlap if they are separated along the normal of an edge.
    auto isApart = [&](const glm::dvec2& axis) {
        const auto [pLow, pHigh] =
            interval(glm::dot(axis, glm::dvec2(p.corner)), p.turn * glm::dot(axis, glm::dvec2(f.a)),
                     p.turn * glm::dot(axis, glm::dvec2(f.b)), isTriangleP);
        const auto [qLow, qHigh] =
            interval(glm::dot(axis, glm::dvec2(q.corner)), q.turn * glm::dot(axis, glm::dvec2(g.a)),
                     q.turn * glm::dot(axis, glm::dvec2(g.b)), isTriangleQ);
        return std::min(pHigh, qHigh) - std::max(pLow, qLow) <= rounding;
    };
    for (int k = 0; k < f.axisCount; ++k)
        if (isApart(f.axes[k])) return false;
    for (int k = 0; k < g.axisCount; ++k)
        if (isApart(g.axes[k])) return false;
    return true;
}

std::pair<double, double> NewellOrder::distances(const Shape& p, uint32_t parent) const {
    const ParentFrame &f = frames[p.parent], &g = frames[parent];
    return interval(glm::dot(g.normal, p.corner - g.origin), p.turn * glm::dot(g.normal, f.a),
                    p.turn * glm::dot(g.normal, f.b), f.axisCount == 3);
}

NewellOrder::Order NewellOrder::compareCoplanar(const Shape& p, const Shape& q,
                                                double distance) const {
    const Parent &a = patches.parents[p.parent], &b = patches.parents[q.parent];
    const bool coincide = std::abs(distance) <= coincidence && areParallel(a, b);
    bool isFirst = distance < 0;
    if (coincide) {
        auto enters = [&](const Parent& parent) {
            return glm::dot(glm::dvec3(parent.normal), direction) < 0;
        };
        isFirst = comesBefore(patches, p.parent, enters(a), q.parent, enters(b));
    }
    return isFirst ? Order::FIRST : Order::SECOND;
}

NewellOrder::Order NewellOrder::compareInOverlap(const Shape& p, const Shape& q) {
    // Returns the corners of a projection, in either orientation.
    auto cornersOf = [&](const Shape& s) {
        const ParentFrame& f = frames[s.parent];
        const glm::dvec2 c(s.corner), a = s.turn * glm::dvec2(f.a), b = s.turn * glm::dvec2(f.b);
        if (f.axisCount == 3) return std::vector<glm::dvec2>{c, c + a, c + b};
        return std::vector<glm::dvec2>{c, c + a, c + a + b, c + b};
    };
    auto cross = [](const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; };
    // Clip p by the edges of q (Sutherland and Hodgman).
    std::vector<glm::dvec2> overlap = cornersOf(p), clipped;
    const std::vector<glm::dvec2> by = cornersOf(q);
    const double turn = cross(by[1] - by[0], by[2] - by[0]) < 0 ? -1 : 1;
    for (size_t k = 0; k < by.size(); ++k) {
        const glm::dvec2 from = by[k], edge = by[(k + 1) % by.size()] - from;
        clipped.clear();
        for (size_t c = 0; c < overlap.size(); ++c) {
            const glm::dvec2 here = overlap[c], there = overlap[(c + 1) % overlap.size()];
            const double u = turn * cross(edge, here - from);
            const double v = turn * cross(edge, there - from);
            if (u >= 0) clipped.push_back(here);
            if ((u >= 0) != (v >= 0)) clipped.push_back(here + u / (u - v) * (there - here));
        }
        overlap.swap(clipped);
    }
    const ParentFrame &f = frames[p.parent], &g = frames[q.parent];
    if (overlap.empty()) return Order::NONE;
    auto depth = [](const ParentFrame& plane, const glm::dvec2& at) {
        const glm::dvec2 d = at - glm::dvec2(plane.origin);
        return plane.origin.z - glm::dot(glm::dvec2(plane.normal), d) / plane.normal.z;
    };
    double low = std::numeric_limits<double>::max(), high = -low, sum = 0;
    for (const glm::dvec2& at : overlap) {
        const double further = depth(g, at) - depth(f, at);
        low = std::min(low, further);
        high = std::max(high, further);
        sum += further;
    }
    const double slant = std::min(f.normal.z, g.normal.z);
    if (low * slant < -rounding && high * slant > rounding) ++cycles;
    return sum > 0 ? Order::FIRST : Order::SECOND;
}

void NewellOrder::draw(std::vector<uint32_t>& drawn) {
    const size_t n = shapes.size();
    edgeBegin.assign(n + 1, 0);
    for (const auto& [first, second] : edges) ++edgeBegin[second + 1];
    for (size_t k = 1; k <= n; ++k) edgeBegin[k] += edgeBegin[k - 1];
    before.resize(edges.size());
    // Fill the predecessors of each shape.
    std::vector<uint32_t> next(edgeBegin.begin(), edgeBegin.end() - 1);
    for (const auto& [first, second] : edges) before[next[second]++] = first;

    enum : uint8_t { WAITING, OPEN, DRAWN };
    std::vector<uint8_t> state(n, WAITING);
    std::vector<uint32_t> stack;  // shapes whose predecessors are being drawn
    std::copy(edgeBegin.begin(), edgeBegin.end() - 1, next.begin());
    drawn.clear();
    for (uint32_t start = 0; start < n; ++start) {
        if (state[start] != WAITING) continue;
        stack.push_back(start);
        state[start] = OPEN;
        while (!stack.empty()) {
            const uint32_t shape = stack.back();
            if (next[shape] == edgeBegin[shape + 1]) {
                drawn.push_back(patchOf[shape]);
                state[shape] = DRAWN;
                stack.pop_back();
                continue;
            }
            const uint32_t first = before[next[shape]++];
            if (state[first] == OPEN) {
                ++cycles;
            } else if (state[first] == WAITING) {
                state[first] = OPEN;
                stack.push_back(first);
            }
        }
    }
}

}  // namespace raybundle
