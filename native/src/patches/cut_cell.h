// SPDX-License-Identifier: GPL-3.0-or-later
//
// A cell and the lines along which other cells pass through it or stand on it
// (patches/crossings.h), and the pieces into which these lines divide the cell, by a binary
// partition of its plane.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "patches/patches.h"
#include "patches/plane.h"

namespace raybundle {

// A convex piece of a cell.
struct CellPiece {
    // In order around, as those of the cell; m, relative to Patches::centre.
    std::vector<glm::dvec3> corners;
    uint8_t seenCorners = 15;  // as Parent::seenCorners
};

// How walls divide a cell.
struct Crossing {
    std::vector<CellPiece> pieces;  // empty if the cell stays whole
    uint8_t parted = 0;             // bit k: a wall stands on the edge from corner k to the next
};

// Sine of the smallest angle between planes that cross. At smaller angles rounding determines the
// line of intersection.
constexpr double kLeastTurn = 0.05;

// Collects the walls that meet a cell, and divides the cell along them.
class CutCell {
  public:
    // Constructs a cell without walls. `size` is the edge length of the cell's largest patch, m.
    CutCell(const Cell& cell, double size);

    // Adds the segment along which another cell passes through the plane of this one or stands on
    // it.
    void meet(const Cell& other);

    // Returns the pieces of the cell and its parted edges, or nullopt if the walls change neither.
    std::optional<Crossing> crossing() const;

    // Returns the plane of a cell, with the cell's longest edge as extent.
    static Plane planeOf(const Cell& cell) {
        return {cell.origin, cell.a, cell.b, cell.normal(), cell.longestEdge()};
    }

  private:
    // A union of intervals along a line, m.
    class Stretches {
      public:
        void add(double from, double to);
        // Returns the length of the union between two positions, m.
        double covered(double from, double to) const;
        double total() const;

      private:
        std::vector<std::array<double, 2>> all;
    };
    // A line in the plane of the cell, with the intervals on which walls stand.
    struct Line {
        glm::dvec2 point, along;  // m; `along` is a unit vector
        Stretches walls;

        // Returns the signed distance of a point from the line, m; positive on the left.
        double off(const glm::dvec2& p) const;
        // Returns the position of a point along the line, m.
        double at(const glm::dvec2& p) const { return glm::dot(along, p - point); }
    };
    // The segment along which a wall meets the plane of the cell; m.
    struct Segment {
        glm::dvec2 from, to;

        double length() const { return glm::distance(from, to); }
    };
    // A corner of a piece.
    struct Corner {
        glm::dvec2 at;     // in the plane of the cell, m
        glm::dvec3 place;  // m, relative to Patches::centre
    };
    using Piece = std::vector<Corner>;

    // Returns the coordinates of a point in the plane of the cell, m.
    glm::dvec2 inPlane(const glm::dvec3& place) const;
    // Returns the line along edge k of the outline, without walls.
    Line edge(size_t k) const;
    double lengthOf(size_t edge) const;
    // Adds a wall: to the edge of the outline on which the segment lies, or to the walls inside.
    void add(const Segment& segment);
    // Returns the lines along which to cut, those with the longest walls first. Segments along one
    // line are joined; lines with short walls are left out.
    std::vector<Line> lines() const;
    // Returns the corners of the cell that no wall hides from the middle of a piece, as bits.
    uint8_t cornersSeenFrom(const Piece& piece, const std::vector<Line>& lines) const;
    // Cuts a piece along a line if walls stand along enough of it. The piece keeps the part to the
    // left of the line; returns the other part, or nullopt if the piece stays whole.
    std::optional<Piece> cut(Piece& piece, const Line& line) const;

    double size;
    glm::dvec3 origin, x, normal, y;
    Plane plane;
    Piece outline;
    std::vector<Stretches> onEdges;  // per edge of the outline: walls on it
    std::vector<Segment> segments;   // walls inside the cell
};

}  // namespace raybundle
