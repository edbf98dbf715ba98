// SPDX-License-Identifier: GPL-3.0-or-later
//
// The painter's order by the tests of Newell, Newell and Sancha: patches are sorted by depth, and
// before a patch is drawn, those that belong before it are moved in front.
//
// Sources: thesis section 4.1.1 and figures 4.3-4.7; Newell, Newell, Sancha, "A Solution to the
// Hidden Surface Problem" (1972). The tests, for two patches whose extents in depth overlap: (1)
// their extents on the plane do not overlap; (2), (3) one lies wholly on one side of the other's
// plane; (4) their projections do not overlap.
// Differs:
// - As a graph: each pair that fails tests (1) and (4) gets an edge from the patch that must be
//   drawn first, found by depth, or by tests (2) and (3); a walk in order of depth draws what must
//   come before a patch, and then the patch. That moves patches as the thesis says, but looks at
//   each pair once (a grid over the plane finds the pairs), and it also compares a patch that was
//   moved with those whose extents in depth do not overlap.
// - Where each patch is cut by the plane of the other, depth within the overlap of the projections
//   decides; if it changes sign there, the patches intersect, which counts as a cycle.
// - A patch that comes round to itself is a cycle: it is drawn anyway, as the thesis' flag has it,
//   and counted. The thesis rules cycles out for closed objects, which three interlocked bars
//   refute; it does not split patches, and nor is it done here.
// - Patches of one parent are coplanar and need no order. Coinciding surfaces come in the order of
//   comesBefore() (patches/coincidence.h).
// - Only patches that cover a pixel are sorted. With ROULETTE patches also share pixels where their
//   projections do not overlap; there the order is that of their nearest points.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include "bundles/painter.h"
#include "patches/patches.h"

namespace raybundle {

class NewellOrder : public PatchOrder {
  public:
    // `patches` must outlive the object.
    explicit NewellOrder(const Patches& patches);

    uint64_t sort(const Bundle& bundle, std::vector<uint32_t>& drawn) override;

  private:
    // Vectors hold metres along right, up and direction of the bundle.
    struct ParentFrame {
        glm::dvec3 origin, a, b;  // a and b: edges of a tile
        glm::dvec3 normal;        // unit, along the direction
        glm::dvec2 axes[3];       // unit normals of the edges' projections
        int axisCount;            // 2 for a parallelogram
    };
    struct Shape {
        glm::dvec3 corner;  // with edges turn * a and turn * b of the parent
        double turn;        // 1, for a patch of a cut tile less; negative: a triangle upside down
        double nearest, farthest;
        uint32_t parent;
    };
    // A shape in a cell of the grid.
    struct Entry {
        float x0, x1, y0, y1;
        uint32_t shape, parent;
        uint16_t column, row;  // first cell of the shape
    };
    enum class Order { NONE, FIRST, SECOND };  // which of two shapes is to be drawn first

    void place(const Bundle& bundle, const std::vector<uint32_t>& drawn);
    void fillGrid();
    void findEdges();
    Order compare(const Shape& p, const Shape& q);
    bool doProjectionsOverlap(const Shape& p, const Shape& q) const;
    // Signed distances of the corners of p from the plane of parent q, metres, growing along the
    // direction.
    std::pair<double, double> distances(const Shape& p, uint32_t q) const;
    Order compareInOverlap(const Shape& p, const Shape& q);
    Order compareCoplanar(const Shape& p, const Shape& q, double distance) const;
    void draw(std::vector<uint32_t>& drawn);

    const Patches& patches;
    const double coincidence;  // metres
    const double rounding;     // of positions, metres

    glm::dvec3 direction{0, 0, 1};
    std::vector<ParentFrame> frames;  // per parent
    std::vector<Shape> shapes;        // per patch drawn, in order of depth
    std::vector<uint32_t> patchOf;    // per shape
    std::vector<std::pair<double, uint32_t>> byDepth;
    std::vector<Entry> bounds;      // per shape
    std::vector<Entry> entries;     // cell by cell
    std::vector<uint32_t> cellEnd;  // per cell, into entries
    int columns = 1, rows = 1;
    std::vector<std::pair<uint32_t, uint32_t>> edges;  // (before, after), shapes
    std::vector<uint32_t> edgeBegin, before;           // per shape: the shapes to be drawn first
    uint64_t cycles = 0;
};

}  // namespace raybundle
