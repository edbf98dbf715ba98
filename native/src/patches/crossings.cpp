// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/crossings.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numeric>
#include <tuple>
#include <unsupported/Eigen/BVH>

#include "bake/cancellation.h"

namespace raybundle {
namespace {

// Only what is so wide, in edges of a patch of what is cut, goes through something or is gone through:
// leaves, the legs of chairs and handles let little light through.
constexpr double kLeastWidth = 1;
// What rises less over a face, in edges of a patch, stops little of the light across it.
constexpr double kLeastHeight = 0.5;
// Half the thickness of boxes, in edges of a patch.
constexpr double kMargin = 0.02;
// Tests whether something crosses a cell, of all cells together: so many a cell and these.
constexpr size_t kTestsPerCell = 32, kTests = 1 << 20;
// Pieces that all cells may be cut into.
constexpr size_t kLeastPieces = 1 << 14;
constexpr size_t kTogether = 1 << 12;  // cells

using Box = Eigen::AlignedBox3d;
using Tree = Eigen::KdBVH<double, 3, uint32_t>;  // of cells or walls

Eigen::Vector3d eigen(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

Box boxOf(const Cell& cell) {
    Box box;
    for (int k = 0; k < (cell.isTriangle() ? 3 : 4); ++k) box.extend(eigen(cell.position(k)));
    return box;
}

double areaOf(const Cell& cell) {
    return glm::length(glm::cross(glm::dvec3(cell.a), glm::dvec3(cell.b))) *
           (cell.isTriangle() ? 0.5 : 1.0);
}

// Edge k of a cell.
struct CellEdge {
    uint32_t low = 0, high = 0;  // vertices
    uint32_t cell = 0;
    int k = 0;
};

// Of the cells with patches; those of one edge side by side.
std::vector<CellEdge> sortedEdges(const std::vector<Cell>& cells, const VertexOf& vertexOf) {
    std::vector<CellEdge> edges;
    for (uint32_t c = 0; c < cells.size(); ++c) {
        throwIfCancelledAt(c);
        if (!cells[c].hasPatches) continue;
        const int n = cells[c].isTriangle() ? 3 : 4;
        for (int k = 0; k < n; ++k) {
            const uint32_t from = vertexOf(cells[c], k), to = vertexOf(cells[c], (k + 1) % n);
            edges.push_back({std::min(from, to), std::max(from, to), c, k});
        }
    }
    std::sort(edges.begin(), edges.end(), [](const CellEdge& a, const CellEdge& b) {
        return std::tie(a.low, a.high, a.cell, a.k) < std::tie(b.low, b.high, b.cell, b.k);
    });
    return edges;
}

template <class Visit>
void forEachEdge(const std::vector<CellEdge>& edges, const Visit& visit) {
    for (size_t i = 0; i < edges.size();) {
        size_t end = i;
        while (end < edges.size() && edges[end].low == edges[i].low &&
               edges[end].high == edges[i].high)
            ++end;
        visit(i, end);
        i = end;
    }
}

bool isTurned(const Cell& a, const Cell& b) {
    return glm::length(glm::cross(a.normal(), b.normal())) > kLeastTurn;
}

// Parts the edges at which cells of two planes or more stand beside those of a third, by common
// vertices.
void partAtJunctions(const std::vector<Cell>& cells, const std::vector<CellEdge>& edges,
                     std::map<uint32_t, Crossing>& crossings) {
    forEachEdge(edges, [&](size_t first, size_t end) {
        if (end - first <= 2) return;
        for (size_t k = first; k < end; ++k) {
            size_t turned = 0;
            for (size_t m = first; m < end; ++m)
                turned += isTurned(cells[edges[k].cell], cells[edges[m].cell]);
            if (turned > 0 && turned < end - first - 1)
                crossings[edges[k].cell].parted |= uint8_t(1u << edges[k].k);
        }
    });
}

// Cells that go on into each other without a bend.
struct Walls {
    std::vector<uint32_t> of;  // per cell
    std::vector<double> area;  // per wall, m^2
    std::vector<Box> box;      // per wall

    // In the mean, metres.
    double width(uint32_t wall) const { return area[wall] / box[wall].diagonal().norm(); }
};

Walls findWalls(const std::vector<Cell>& cells, const std::vector<CellEdge>& edges) {
    std::vector<uint32_t> parent(cells.size());
    std::iota(parent.begin(), parent.end(), 0u);
    auto root = [&](uint32_t c) {
        while (parent[c] != c) c = parent[c] = parent[parent[c]];
        return c;
    };
    forEachEdge(edges, [&](size_t first, size_t end) {
        for (size_t k = first; k < end; ++k)
            for (size_t m = k + 1; m < end; ++m)
                if (!isTurned(cells[edges[k].cell], cells[edges[m].cell]))
                    parent[root(edges[m].cell)] = root(edges[k].cell);
    });
    Walls walls;
    std::vector<uint32_t> numberOf(cells.size(), UINT32_MAX);
    for (uint32_t c = 0; c < cells.size(); ++c) {
        throwIfCancelledAt(c);
        uint32_t& number = numberOf[root(c)];
        if (number == UINT32_MAX) {
            number = uint32_t(walls.area.size());
            walls.area.push_back(0);
            walls.box.push_back({});
        }
        walls.of.push_back(number);
        walls.area[number] += areaOf(cells[c]);
        walls.box[number].extend(boxOf(cells[c]));
    }
    return walls;
}

// Visits what is in a tree whose boxes meet another box.
template <class Visit>
struct MeetBox {
    const Box& box;
    const Visit& visit;

    bool intersectVolume(const Box& volume) const { return volume.intersects(box); }
    bool intersectObject(uint32_t index) const {
        visit(index);
        return false;
    }
};

template <class Visit>
void forEachIn(const Tree& tree, const Box& box, const Visit& visit) {
    MeetBox<Visit> query{box, visit};
    Eigen::BVIntersect(tree, query);
}

// The cells of wide walls, by place.
class CellsByPlace {
  public:
    // cellsOf: per wall; boxes: per cell.
    CellsByPlace(const Walls& all, const std::vector<std::vector<uint32_t>>& cellsOf,
                 const std::vector<Box>& boxes)
        : trees(cellsOf.size()) {
        parallelFor(size_t(0), cellsOf.size(), [&](size_t wall) {
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

    // The walls that may meet a box, and the cells of one that may.
    template <class Visit>
    void forEachWall(const Box& box, const Visit& visit) const {
        forEachIn(walls, box, visit);
    }
    template <class Visit>
    void forEachCell(uint32_t wall, const Box& box, const Visit& visit) const {
        forEachIn(trees[wall], box, visit);
    }

  private:
    std::vector<Tree> trees;  // per wall
    Tree walls;
};

bool haveCommonEdge(const Cell& a, const Cell& b, const VertexOf& vertexOf) {
    std::array<uint32_t, 4> ofB;
    const int nA = a.isTriangle() ? 3 : 4, nB = b.isTriangle() ? 3 : 4;
    for (int k = 0; k < nB; ++k) ofB[size_t(k)] = vertexOf(b, k);
    auto placeInB = [&](uint32_t vertex) {
        for (int k = 0; k < nB; ++k)
            if (ofB[size_t(k)] == vertex) return k;
        return -1;
    };
    for (int k = 0; k < nA; ++k) {
        const int from = placeInB(vertexOf(a, k));
        if (from < 0) continue;
        const int to = placeInB(vertexOf(a, (k + 1) % nA));
        if (to >= 0 && (to == (from + 1) % nB || from == (to + 1) % nB)) return true;
    }
    return false;
}

// Whether what is within a box rises over a plane by at least so much, metres.
bool isHigh(const Box& box, const Plane& plane, double least) {
    const Eigen::Vector3d middle = box.center();
    const double height = std::abs(plane.height({middle.x(), middle.y(), middle.z()}));
    return height + 0.5 * eigen(glm::abs(plane.normal)).dot(Eigen::Vector3d(box.sizes())) >= least;
}

}  // namespace

Crossings findCrossings(const std::vector<Cell>& cells, const std::vector<double>& sizes,
                        const VertexOf& vertexOf) {
    Crossings result;
    const std::vector<CellEdge> edges = sortedEdges(cells, vertexOf);
    partAtJunctions(cells, edges, result.ofCell);

    const Walls walls = findWalls(cells, edges);
    auto isWide = [&](uint32_t wall, double size) {
        return walls.width(wall) >= kLeastWidth * size;
    };
    std::vector<std::vector<uint32_t>> cellsOf(walls.area.size());
    std::vector<Box> boxes(cells.size());
    std::vector<double> length(cells.size());  // of the longest edge over that of a patch
    std::vector<uint32_t> order;
    for (uint32_t c = 0; c < cells.size(); ++c) {
        throwIfCancelledAt(c);
        if (!cells[c].hasPatches || !isWide(walls.of[c], sizes[c])) continue;
        order.push_back(c);
        cellsOf[walls.of[c]].push_back(c);
        boxes[c] = boxOf(cells[c]);
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
            CutCell crossed(cells[c], ofPatch);
            size_t own = 0;
            places.forEachWall(box, [&](uint32_t wall) {
                ++own;
                if (wall == walls.of[c] || !isWide(wall, size) ||
                    !isHigh(walls.box[wall], crossed.ownPlane(), kLeastHeight * size))
                    return;
                places.forEachCell(wall, box, [&](uint32_t other) {
                    ++own;
                    if (!haveCommonEdge(cells[c], cells[other], vertexOf))
                        crossed.meet(cells[other]);
                });
            });
            found[k - first] = crossed.crossing();
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
