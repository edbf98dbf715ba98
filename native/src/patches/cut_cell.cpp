// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/cut_cell.h"

#include <algorithm>
#include <cmath>

namespace raybundle {
namespace {

// Tolerances, all relative to the edge length of the largest patch of the cell. A point closer to a
// plane or line than kWithin lies in it.
constexpr double kWithin = 0.02;
// Walls on a line have at least the total length kLong. A line cuts a piece if walls stand along at
// least kLeastCut of it within the piece, or along kMostOfPiece of its length within the piece.
constexpr double kLong = 0.5, kLeastCut = 0.1;
constexpr double kMostOfPiece = 0.9;
// Least width of a part that is cut off.
constexpr double kNarrowest = 0.03;
// A shorter segment is only a corner that touches the cell.
constexpr double kShortest = 1e-6;
// Lengths are compared in steps of this size, so that rounding does not order equal lengths unless
// the border between two steps lies between them.
constexpr double kStep = 0.0937;
constexpr size_t kMostPieces = 64;
constexpr size_t kMostSegments = 1 << 12;  // number of segments used: the longest

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

std::vector<glm::dvec3> cornersOf(const Cell& cell) {
    std::vector<glm::dvec3> corners;
    for (int k = 0; k < cell.cornerCount(); ++k) corners.push_back(cell.position(k));
    return corners;
}

}  // namespace

void CutCell::Stretches::add(double from, double to) {
    all.push_back({std::min(from, to), std::max(from, to)});
}

double CutCell::Stretches::covered(double from, double to) const {
    std::vector<std::array<double, 2>> sorted = all;
    std::sort(sorted.begin(), sorted.end());
    double sum = 0, done = from;
    for (const auto& [low, high] : sorted) {
        const double end = std::min(high, to);
        if (end <= done) continue;
        sum += end - std::max(low, done);
        done = end;
    }
    return sum;
}

double CutCell::Stretches::total() const { return covered(-INFINITY, INFINITY); }

double CutCell::Line::off(const glm::dvec2& p) const { return cross(along, p - point); }

CutCell::CutCell(const Cell& cell, double size)
    : size(size),
      origin(cell.origin),
      x(glm::normalize(glm::dvec3(cell.a))),
      normal(cell.normal()),
      y(glm::cross(normal, x)),
      plane(planeOf(cell)) {
    for (const glm::dvec3& place : cornersOf(cell)) outline.push_back({inPlane(place), place});
    onEdges.resize(outline.size());
}

void CutCell::meet(const Cell& other) {
    if (glm::length(glm::cross(normal, other.normal())) < kLeastTurn) return;
    const std::vector<glm::dvec3> corners = cornersOf(other);
    const size_t n = corners.size();
    std::array<double, 4> height{};
    std::array<int, 4> sign{};
    for (size_t k = 0; k < n; ++k) {
        const double within = std::max(kWithin * size, plane.halfThickness(corners[k]));
        height[k] = plane.height(corners[k]);
        sign[k] = height[k] > within ? 1 : height[k] < -within ? -1 : 0;
    }
    std::vector<glm::dvec3> ends;
    for (size_t k = 0; k < n; ++k) {
        const size_t next = (k + 1) % n;
        if (sign[k] == 0) ends.push_back(corners[k]);
        if (sign[k] * sign[next] < 0)
            ends.push_back(
                glm::mix(corners[k], corners[next], height[k] / (height[k] - height[next])));
    }
    if (ends.size() == 2) add({inPlane(ends[0]), inPlane(ends[1])});
}

std::optional<Crossing> CutCell::crossing() const {
    Crossing result;
    for (size_t k = 0; k < outline.size(); ++k)
        if (onEdges[k].covered(0, lengthOf(k)) >= kLong * lengthOf(k))
            result.parted |= uint8_t(1u << k);
    std::vector<Piece> pieces{outline};
    const std::vector<Line> all = lines();
    for (const Line& line : all) {
        const size_t count = pieces.size();
        for (size_t k = 0; k < count && pieces.size() < kMostPieces; ++k)
            if (auto other = cut(pieces[k], line)) pieces.push_back(std::move(*other));
    }
    if (pieces.size() > 1) {
        uint8_t seen = 0;
        for (const Piece& piece : pieces) {
            CellPiece& out = result.pieces.emplace_back();
            for (const Corner& corner : piece) out.corners.push_back(corner.place);
            out.seenCorners = cornersSeenFrom(piece, all);
            seen |= out.seenCorners;
        }
        // A corner that no piece sees, because a wall almost stands on it, counts as seen by all
        // pieces.
        for (CellPiece& piece : result.pieces) piece.seenCorners |= uint8_t(15 & ~seen);
    }
    if (result.pieces.empty() && result.parted == 0) return std::nullopt;
    return result;
}

glm::dvec2 CutCell::inPlane(const glm::dvec3& place) const {
    const glm::dvec3 d = place - origin;
    return {glm::dot(d, x), glm::dot(d, y)};
}

double CutCell::lengthOf(size_t edge) const {
    return glm::distance(outline[edge].at, outline[(edge + 1) % outline.size()].at);
}

CutCell::Line CutCell::edge(size_t k) const {
    const glm::dvec2 start = outline[k].at;
    return {start, (outline[(k + 1) % outline.size()].at - start) / lengthOf(k), {}};
}

void CutCell::add(const Segment& segment) {
    for (size_t k = 0; k < outline.size(); ++k) {
        const Line line = edge(k);
        if (std::abs(line.off(segment.from)) > kWithin * size ||
            std::abs(line.off(segment.to)) > kWithin * size)
            continue;
        onEdges[k].add(line.at(segment.from), line.at(segment.to));
        return;
    }
    // Find the part inside the cell. A segment that has one is kept whole.
    double from = 0, to = 1;
    for (size_t k = 0; k < outline.size(); ++k) {
        const Line line = edge(k);
        const double start = line.off(segment.from), slope = line.off(segment.to) - start;
        if (slope > 0)
            from = std::max(from, -start / slope);
        else if (slope < 0)
            to = std::min(to, -start / slope);
        else if (start < 0)
            return;
    }
    if ((to - from) * segment.length() > kShortest * size) segments.push_back(segment);
}

std::vector<CutCell::Line> CutCell::lines() const {
    std::vector<Segment> longest = segments;
    std::stable_sort(longest.begin(), longest.end(),
                     [](const Segment& a, const Segment& b) { return a.length() > b.length(); });
    longest.resize(std::min(longest.size(), kMostSegments));
    std::vector<Line> lines;
    for (const Segment& segment : longest) {
        auto line = std::find_if(lines.begin(), lines.end(), [&](const Line& l) {
            return std::abs(l.off(segment.from)) <= kWithin * size &&
                   std::abs(l.off(segment.to)) <= kWithin * size;
        });
        if (line == lines.end())
            line = lines.insert(line,
                                {segment.from, (segment.to - segment.from) / segment.length(), {}});
        line->walls.add(line->at(segment.from), line->at(segment.to));
    }
    lines.erase(std::remove_if(lines.begin(), lines.end(),
                               [&](const Line& line) { return line.walls.total() < kLong * size; }),
                lines.end());
    // In steps, so that rounding does not order walls of equal length. Of these, the line closest
    // to the first corner comes first.
    auto rank = [&](const Line& l) {
        return std::make_pair(-std::round(l.walls.total() / (kStep * size)),
                              std::round(std::abs(l.off(outline[0].at)) / (kStep * size)));
    };
    std::stable_sort(lines.begin(), lines.end(),
                     [&](const Line& a, const Line& b) { return rank(a) < rank(b); });
    return lines;
}

uint8_t CutCell::cornersSeenFrom(const Piece& piece, const std::vector<Line>& lines) const {
    glm::dvec2 middle(0.0);
    for (const Corner& corner : piece) middle += corner.at / double(piece.size());
    uint8_t seen = 15;
    for (size_t k = 0; k < outline.size(); ++k)
        for (const Line& line : lines) {
            const double here = line.off(middle), there = line.off(outline[k].at);
            if (here * there >= 0 || std::abs(there) < kNarrowest * size) continue;
            const double at = line.at(glm::mix(middle, outline[k].at, here / (here - there)));
            const double near = kWithin * size;
            if (line.walls.covered(at - near, at + near) > near) seen &= uint8_t(~(1u << k));
        }
    return seen;
}

std::optional<CutCell::Piece> CutCell::cut(Piece& piece, const Line& line) const {
    double least = 0, most = 0;
    for (const Corner& corner : piece) {
        least = std::min(least, line.off(corner.at));
        most = std::max(most, line.off(corner.at));
    }
    if (std::min(-least, most) < kNarrowest * size) return std::nullopt;
    Piece left, right;
    std::vector<double> ends;
    for (size_t k = 0; k < piece.size(); ++k) {
        const Corner &corner = piece[k], &next = piece[(k + 1) % piece.size()];
        const double off = line.off(corner.at), offNext = line.off(next.at);
        if (off >= 0) left.push_back(corner);
        if (off <= 0) right.push_back(corner);
        if (off == 0) ends.push_back(line.at(corner.at));
        if (off * offNext >= 0) continue;
        const double share = off / (off - offNext);
        const Corner between{glm::mix(corner.at, next.at, share),
                             glm::mix(corner.place, next.place, share)};
        ends.push_back(line.at(between.at));
        left.push_back(between);
        right.push_back(between);
    }
    if (ends.size() != 2) return std::nullopt;
    const auto [from, to] = std::minmax(ends[0], ends[1]);
    if (line.walls.covered(from, to) < std::min(kLeastCut * size, kMostOfPiece * (to - from)))
        return std::nullopt;
    piece = std::move(left);
    return right;
}

}  // namespace raybundle
