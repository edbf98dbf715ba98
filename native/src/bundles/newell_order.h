// SPDX-License-Identifier: GPL-3.0-or-later
//
// The painter's order by the tests of Newell, Newell and Sancha: patches are sorted by depth, and
// before a patch is drawn, the patches that must come before it are moved in front of it.
//
// Sources: thesis section 4.1.1 and figures 4.3-4.7; Newell, Newell, Sancha, "A Solution to the
// Hidden Surface Problem" (1972). The tests are, for two patches whose extents in depth overlap:
// (1) their extents on the plane do not overlap; (2), (3) one lies wholly on one side of the
// other's plane; (4) their projections do not overlap.
// Differs:
// - The order is computed as a graph. Each pair that fails tests (1) and (4) gets an edge from the
//   patch that must be drawn first, which depth or tests (2) and (3) determine. A walk in order of
//   depth draws first what must come before a patch, and then the patch. Patches are thereby moved
//   as in the thesis, but each pair is compared only once (a grid over the plane finds the pairs),
//   and a moved patch is also compared with patches whose extents in depth do not overlap.
// - If each patch is cut by the plane of the other, the depths within the overlap of the
//   projections decide. If the difference in depth changes sign there, the patches intersect, which
//   counts as a cycle.
// - A patch that must come before itself is a cycle. It is drawn anyway, as with the flag of the
//   thesis, and counted. The thesis rules out cycles for closed objects, but three interlocked bars
//   are a counterexample. As in the thesis, patches are not split.
// - Patches of one parent are coplanar and need no order. Coinciding surfaces are in the order of
//   comesBefore() (patches/coincidence.h).
// - Only patches that cover a pixel are sorted. With ROULETTE, patches also share pixels where
//   their projections do not overlap. The order is then that of their nearest points.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include "bundles/painter.h"
#include "patches/patches.h"

namespace raybundle {

// The order of PAINTER_NEWELL.
class NewellOrder : public PatchOrder {
  public:
    // `patches` must outlive the object.
    explicit NewellOrder(const Patches& patches);

    uint64_t sort(const Bundle& bundle, std::vector<uint32_t>& drawn) override;

  private:
    // A parent in the frame of the bundle: vectors are in metres along right, up and direction.
    struct ParentFrame {
        glm::dvec3 origin, a, b;  // a and b: edges of a tile
        glm::dvec3 normal;        // unit, turned to point along the direction
        glm::dvec2 axes[3];       // unit normals of the edges' projections
        int axisCount;            // 2 for a parallelogram
    };
    // A patch in the frame of the bundle.
    struct Shape {
        glm::dvec3 corner;  // the edges at the corner are turn * a and turn * b of the parent
        // 1, or less for a patch of a cut tile. Negative for a triangle that is upside down.
        double turn;
        // Range of depths, metres.
        double nearest, farthest;
        uint32_t parent;
    };
    // A shape in a cell of the grid, with its bounds on the plane in metres.
    struct Entry {
        float x0, x1, y0, y1;
        uint32_t shape, parent;
        uint16_t column, row;  // first cell that the shape covers
    };
    enum class Order { NONE, FIRST, SECOND };  // the shape of two that must be drawn first

    void place(const Bundle& bundle, const std::vector<uint32_t>& drawn);
    void fillGrid();
    void findEdges();
    Order compare(const Shape& p, const Shape& q);
    bool doProjectionsOverlap(const Shape& p, const Shape& q) const;
    // Returns the range of the signed distances of p's corners from the plane of parent q, metres.
    // They increase along the direction.
    std::pair<double, double> distances(const Shape& p, uint32_t q) const;
    Order compareInOverlap(const Shape& p, const Shape& q);
    Order compareCoplanar(const Shape& p, const Shape& q, double distance) const;
    void draw(std::vector<uint32_t>& drawn);

    const Patches& patches;
    const double coincidence;  // metres
    const double rounding;     // rounding error of positions, metres

    glm::dvec3 direction{0, 0, 1};
    std::vector<ParentFrame> frames;  // per parent
    std::vector<Shape> shapes;        // per drawn patch, in order of depth
    std::vector<uint32_t> patchOf;    // per shape
    std::vector<std::pair<double, uint32_t>> byDepth;
    std::vector<Entry> bounds;      // per shape
    std::vector<Entry> entries;     // grouped by cell
    std::vector<uint32_t> cellEnd;  // per cell: end of its range in `entries`
    int columns = 1, rows = 1;
    std::vector<std::pair<uint32_t, uint32_t>> edges;  // (first, second) shapes in order of drawing
    std::vector<uint32_t> edgeBegin, before;           // per shape: shapes that must be drawn first
    uint64_t cycles = 0;
};

}  // namespace raybundle
