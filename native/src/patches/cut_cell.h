// SPDX-License-Identifier: GPL-3.0-or-later
//
// A cell and the lines along which other cells go through it or stand on it (patches/crossings.h):
// the pieces that these leave of it, by a binary partition of the plane.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "patches/patches.h"
#include "patches/plane.h"

namespace raybundle {

// A convex part of a cell.
struct CellPiece {
    std::vector<glm::dvec3> corners;  // in order around as those of the cell, metres
    uint8_t seenCorners = 15;         // as Parent has it
};

struct Crossing {
    std::vector<CellPiece> pieces;  // empty: the cell is whole
    uint8_t parted = 0;             // bit k: a wall stands on the edge from corner k on
};

// Sine of the least angle between planes that cross: of a smaller one the line is a matter of
// rounding.
constexpr double kLeastTurn = 0.05;

class CutCell {
  public:
    // size: edge of the largest patch of the cell, metres.
    CutCell(const Cell& cell, double size);

    // Adds the line in which another cell goes through the plane of this one or stands on it.
    void meet(const Cell& other);

    // What they make of the cell, if that is anything.
    std::optional<Crossing> crossing() const;

    static Plane planeOf(const Cell& cell) {
        return {cell.origin, cell.a, cell.b, cell.normal(), cell.longestEdge()};
    }

  private:
    // Parts of a line, by the distance along it, metres.
    class Stretches {
      public:
        void add(double from, double to);
        // Length of what they cover between two places.
        double covered(double from, double to) const;
        double total() const;

      private:
        std::vector<std::array<double, 2>> all;
    };
    // A line in the plane of the cell.
    struct Line {
        glm::dvec2 point, along;  // along: unit
        Stretches walls;

        double off(const glm::dvec2& p) const;
        double at(const glm::dvec2& p) const { return glm::dot(along, p - point); }
    };
    struct Segment {
        glm::dvec2 from, to;

        double length() const { return glm::distance(from, to); }
    };
    struct Corner {
        glm::dvec2 at;     // in the plane of the cell, metres
        glm::dvec3 place;  // metres, relative to Patches::centre
    };
    using Piece = std::vector<Corner>;

    glm::dvec2 inPlane(const glm::dvec3& place) const;
    // The line of edge k of the outline.
    Line edge(size_t k) const;
    double lengthOf(size_t edge) const;
    void add(const Segment& segment);
    // Segments along each other are one line. First those with the most walls; those with few are
    // left out.
    std::vector<Line> lines() const;
    // The corners of the cell that no wall hides from the middle of a piece.
    uint8_t cornersSeenFrom(const Piece& piece, const std::vector<Line>& lines) const;
    // Cuts a piece if the line runs through enough of it: leaves what is to its left, and returns
    // the rest.
    std::optional<Piece> cut(Piece& piece, const Line& line) const;

    double size;
    glm::dvec3 origin, x, normal, y;
    Plane plane;
    Piece outline;
    std::vector<Stretches> onEdges;  // per edge of the outline
    std::vector<Segment> segments;   // inside
};

}  // namespace raybundle
