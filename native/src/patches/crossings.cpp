// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/crossings.h"

#include <tbb/parallel_sort.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <tuple>
#include <unsupported/Eigen/BVH>

#include "job/cancellation.h"
#include "scene/disjoint_sets.h"

namespace raybundle {
namespace {

// Walls, and surfaces that walls cut, are at least this wide, in patch edges of the cell that is
// cut. Narrower objects, such as leaves and the legs of chairs and handles, let little light
// through.
constexpr double kLeastWidth = 1;
// A wall that rises less than this above a face, in patch edges of the face, blocks little of the
// light across it.
constexpr double kLeastHeight = 0.5;
// Margin of the boxes, in patch edges.
constexpr double kMargin = 0.02;
// Limit of the tests for all cells together: kTestsPerCell for each cell, and kTests more.
constexpr size_t kTestsPerCell = 32, kTests = 1 << 20;
// Least limit of the number of pieces of all cells.
constexpr size_t kLeastPieces = 1 << 14;
// Cells that are tested in parallel between two checks of the limits.
constexpr size_t kTogether = 1 << 12;

using Box = Eigen::AlignedBox3d;
using Tree = Eigen::KdBVH<double, 3, uint32_t>;  // of cells or walls

Eigen::Vector3d eigen(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

Box boxOf(const Cell& cell) {
    Box box;
    for (int k = 0; k < cell.cornerCount(); ++k) box.extend(eigen(cell.position(k)));
    return box;
}

// Edge k of a cell, which joins corner k to the next.
struct CellEdge {
    uint32_t low = 0, high = 0;  // vertices, low < high
    uint32_t cell = 0;
    int k = 0;
};

// Returns the edges of all cells with patches, sorted so that equal edges are adjacent.
std::vector<CellEdge> sortedEdges(const std::vector<Cell>& cells, const CellVertices& vertices) {
    std::vector<CellEdge> edges;
    edges.reserve(4 * cells.size());
    for (uint32_t c = 0; c < cells.size(); ++c) {
        throwIfCancelledAt(c);
        if (!cells[c].hasPatches) continue;
        const int n = cells[c].cornerCount();
        for (int k = 0; k < n; ++k) {
            const uint32_t from = vertices[c][size_t(k)], to = vertices[c][size_t((k + 1) % n)];
            edges.push_back({std::min(from, to), std::max(from, to), c, k});
        }
    }
    tbb::parallel_sort(edges.begin(), edges.end(), [](const CellEdge& a, const CellEdge& b) {
        return std::tie(a.low, a.high, a.cell, a.k) < std::tie(b.low, b.high, b.cell, b.k);
    });
    return edges;
}

// Returns whether two planes through a common edge are parallel within kLeastTurn. The arguments
// are unit normals.
bool areInOnePlane(const glm::dvec3& normal, const glm::dvec3& other) {
    return glm::length(glm::cross(normal, other)) <= kLeastTurn;
}

// Returns for each of `count` cells at an edge the number of its plane: cells in one plane have one
// number. At most 64 planes are compared; at an edge with more planes, the later cells have one
// number each. `ofCells` holds the normals of all cells.
std::vector<size_t> planesOf(const std::vector<glm::dvec3>& ofCells, const CellEdge* edges,
                             size_t count) {
    constexpr size_t kMostCompared = 64;
    std::vector<size_t> planes;
    std::vector<glm::dvec3> normals;  // per plane
    for (size_t k = 0; k < count; ++k) {
        const glm::dvec3& normal = ofCells[edges[k].cell];
        const size_t most = std::min(normals.size(), kMostCompared);
        size_t plane = 0;
        while (plane < most && !areInOnePlane(normal, normals[plane])) ++plane;
        if (plane == most) {
            plane = normals.size();
            normals.push_back(normal);
        }
        planes.push_back(plane);
    }
    return planes;
}

// Walls: sets of cells that continue each other without a bend.
struct Walls {
    std::vector<uint32_t> of;  // per cell: its wall
    std::vector<double> area;  // per wall, m^2
    std::vector<Box> box;      // per wall

    // Returns the mean width of a wall, m: its area over the diagonal of its box.
    double width(uint32_t wall) const { return area[wall] / box[wall].diagonal().norm(); }
};

// Finds the walls. Also marks the edges at which cells of one plane meet cells of another plane
// that stand on them, joined by vertices, as parted. `boxes` is per cell.
Walls findWalls(const std::vector<Cell>& cells, const std::vector<Box>& boxes,
                const CellVertices& vertices, std::map<uint32_t, Crossing>& crossings) {
    const std::vector<CellEdge> edges = sortedEdges(cells, vertices);
    std::vector<glm::dvec3> normals(cells.size());  // of cells with patches
    parallelFor(size_t(0), cells.size(), [&](size_t c) {
        if (cells[c].hasPatches) normals[c] = cells[c].normal();
    });
    DisjointSets joined(cells.size());
    for (size_t first = 0; first < edges.size();) {
        size_t end = first;
        while (end < edges.size() && edges[end].low == edges[first].low &&
               edges[end].high == edges[first].high)
            ++end;
        // Most edges have two cells, which part nothing, or one.
        if (end - first <= 2) {
            const uint32_t a = edges[first].cell, b = edges[end - 1].cell;
            if (areInOnePlane(normals[a], normals[b])) joined.join(a, b);
            first = end;
            continue;
        }
        const std::vector<size_t> planes = planesOf(normals, &edges[first], end - first);
        std::map<size_t, std::vector<uint32_t>> inPlane;  // positions from `first` on
        for (uint32_t k = 0; k < planes.size(); ++k) inPlane[planes[k]].push_back(k);
        for (const auto& [plane, members] : inPlane)
            for (uint32_t k : members) {
                joined.join(edges[first + k].cell, edges[first + members[0]].cell);
                if (members.size() > 1 && inPlane.size() > 1)
                    crossings[edges[first + k].cell].parted |= uint8_t(1u << edges[first + k].k);
            }
        first = end;
    }
    Walls walls;
    std::vector<uint32_t> numberOf(cells.size(), UINT32_MAX);
    for (uint32_t c = 0; c < cells.size(); ++c) {
        throwIfCancelledAt(c);
        uint32_t& number = numberOf[joined.root(c)];
        if (number == UINT32_MAX) {
            number = uint32_t(walls.area.size());
            walls.area.push_back(0);
            walls.box.push_back({});
        }
        walls.of.push_back(number);
        walls.area[number] += cells[c].area();
        walls.box[number].extend(boxes[c]);
    }
    return walls;
}

// Visits the objects in all parts of a tree whose boxes meet `box`. Eigen::BVIntersect is not used
// because it allocates for each query.
template <class Visit>
void forEachIn(const Tree& tree, Tree::Index part, const Box& box, const Visit& visit) {
    Tree::VolumeIterator inner = nullptr, innerEnd = nullptr;
    Tree::ObjectIterator leaf = nullptr, leafEnd = nullptr;
    tree.getChildren(part, inner, innerEnd, leaf, leafEnd);
    for (; leaf != leafEnd; ++leaf) visit(*leaf);
    while (innerEnd != inner)
        if (tree.getVolume(*--innerEnd).intersects(box)) forEachIn(tree, *innerEnd, box, visit);
}

// Spatial index of the cells of wide walls.
class CellsByPlace {
  public:
    // `cellsOf` is per wall, and empty for narrow walls; `boxes` is per cell.
    CellsByPlace(const Walls& all, const std::vector<std::vector<uint32_t>>& cellsOf,
                 const std::vector<Box>& boxes)
        : cellsOf(cellsOf), trees(cellsOf.size()) {
        parallelFor(size_t(0), cellsOf.size(), [&](size_t wall) {
            if (cellsOf[wall].size() < 2) return;
            std::vector<Box> own;
            for (uint32_t c : cellsOf[wall]) own.push_back(boxes[c]);
            trees[wall].init(cellsOf[wall].begin(), cellsOf[wall].end(), own.begin(), own.end());
        });
        std::vector<uint32_t> wide;
        std::vector<Box> ofWide;
        for (uint32_t wall = 0; wall < cellsOf.size(); ++wall) {
            if (cellsOf[wall].empty()) continue;
            wide.push_back(wall);
            ofWide.push_back(all.box[wall]);
        }
        walls.init(wide.begin(), wide.end(), ofWide.begin(), ofWide.end());
    }

    // Visit the walls that may meet a box, or the cells of one wall that may.
    template <class Visit>
    void forEachWall(const Box& box, const Visit& visit) const {
        forEachIn(walls, walls.getRootIndex(), box, visit);
    }
    template <class Visit>
    void forEachCell(uint32_t wall, const Box& box, const Visit& visit) const {
        if (cellsOf[wall].size() > 1)
            forEachIn(trees[wall], trees[wall].getRootIndex(), box, visit);
        else
            visit(cellsOf[wall].front());
    }

  private:
    const std::vector<std::vector<uint32_t>>& cellsOf;  // per wall
    std::vector<Tree> trees;                            // per wall: its cells, if there are several
    Tree walls;
};

// Returns whether two cells have a common edge. a and b are their vertices, nA and nB their numbers
// of corners.
bool haveCommonEdge(const std::array<uint32_t, 4>& a, int nA, const std::array<uint32_t, 4>& b,
                    int nB) {
    auto placeInB = [&](uint32_t vertex) {
        for (int k = 0; k < nB; ++k)
            if (b[size_t(k)] == vertex) return k;
        return -1;
    };
    for (int k = 0; k < nA; ++k) {
        const int from = placeInB(a[size_t(k)]);
        if (from < 0) continue;
        const int to = placeInB(a[size_t((k + 1) % nA)]);
        if (to >= 0 && (to == (from + 1) % nB || from == (to + 1) % nB)) return true;
    }
    return false;
}

// Returns whether a box reaches at least `least` metres from the plane.
bool isHigh(const Box& box, const Plane& plane, double least) {
    const Eigen::Vector3d middle = box.center();
    const double height = std::abs(plane.height({middle.x(), middle.y(), middle.z()}));
    return height + 0.5 * eigen(glm::abs(plane.normal)).dot(Eigen::Vector3d(box.sizes())) >= least;
}

}  // namespace

Crossings findCrossings(const std::vector<Cell>& cells, const std::vector<double>& sizes,
                        const CellVertices& vertices) {
    Crossings result;
    std::vector<Box> boxes(cells.size());
    parallelFor(size_t(0), cells.size(), [&](size_t c) { boxes[c] = boxOf(cells[c]); });
    const Walls walls = findWalls(cells, boxes, vertices, result.ofCell);
    auto isWide = [&](uint32_t wall, double size) {
        return walls.width(wall) >= kLeastWidth * size;
    };
    std::vector<std::vector<uint32_t>> cellsOf(walls.area.size());
    std::vector<double> length(cells.size());  // per cell: longest edge over the edge of a patch
    std::vector<uint32_t> order;
    for (uint32_t c = 0; c < cells.size(); ++c) {
        throwIfCancelledAt(c);
        if (!cells[c].hasPatches || !isWide(walls.of[c], sizes[c])) continue;
        order.push_back(c);
        cellsOf[walls.of[c]].push_back(c);
        length[c] = cells[c].longestEdge() / sizes[c];
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](uint32_t a, uint32_t b) { return length[a] > length[b]; });
    const CellsByPlace places(walls, cellsOf, boxes);
    const size_t mostTests = kTestsPerCell * cells.size() + kTests;
    const size_t mostPieces = std::max(cells.size() / 4, kLeastPieces);
    std::atomic<size_t> tests = 0;
    size_t pieces = 0;
    for (size_t first = 0; first < order.size() && result.isAll; first += kTogether) {
        const size_t end = std::min(first + kTogether, order.size());
        std::vector<std::optional<Crossing>> found(end - first);
        parallelFor(first, end, [&](size_t k) {
            const uint32_t c = order[k];
            const double size = sizes[c], ofPatch = size * std::min(length[c], 1.0);
            Box box = boxes[c];
            box.min().array() -= kMargin * ofPatch;
            box.max().array() += kMargin * ofPatch;
            std::optional<Plane> plane;
            std::optional<CutCell> crossed;
            size_t own = 0;
            places.forEachWall(box, [&](uint32_t wall) {
                ++own;
                if (wall == walls.of[c] || !isWide(wall, size)) return;
                if (!plane) plane = CutCell::planeOf(cells[c]);
                if (!isHigh(walls.box[wall], *plane, kLeastHeight * size)) return;
                places.forEachCell(wall, box, [&](uint32_t other) {
                    ++own;
                    if (haveCommonEdge(vertices[c], cells[c].cornerCount(), vertices[other],
                                       cells[other].cornerCount()))
                        return;
                    if (!crossed) crossed.emplace(cells[c], ofPatch);
                    crossed->meet(cells[other]);
                });
            });
            if (crossed) found[k - first] = crossed->crossing();
            tests += own;
        });
        for (size_t k = first; k < end; ++k) {
            if (!found[k - first]) continue;
            Crossing& crossing = result.ofCell[order[k]];
            crossing.parted |= found[k - first]->parted;
            pieces += found[k - first]->pieces.size();
            if (pieces <= mostPieces) crossing.pieces = std::move(found[k - first]->pieces);
        }
        result.isAll = pieces <= mostPieces && (tests <= mostTests || end == order.size());
    }
    return result;
}

}  // namespace raybundle
