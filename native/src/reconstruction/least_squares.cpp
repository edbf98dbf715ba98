// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/least_squares.h"

#include <Eigen/IterativeLinearSolvers>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "job/cancellation.h"
#include "patches/side.h"
#include "reconstruction/fit_terms.h"

namespace raybundle {
namespace {

// The light of the patches at a node bounds the value of the node. A patch does not count if its
// exposed share is below this fraction of that of the most exposed patch at the node, because so
// small a share is too uncertain.
constexpr float kLeastBounding = 0.4f;
// A face touches another surface if less than this share of it is exposed.
constexpr double kTouched = 0.9;
// Maximum number of steps of the iteration.
constexpr Eigen::Index kMaxIterations = 2000;
// Maximum relative residual of a fit that is shown.
constexpr double kMostResidual = 1e-3;
// Bounds of the shape of a face over its edge, in lengths of the edge: the least height, and how
// far beyond the ends of the edge the other corners lie at most. Thinner faces are treated as if
// they had this shape, since rounding errors would decide their slopes.
constexpr double kLeastHeight = 0.02;
constexpr double kMostAlong = 3;
// How far values may exceed the range of the light of the patches around them: by half of the
// difference between this range and that of the patches further around, as a slope does that
// continues to the border. Upwards, values may exceed the range by no more than the share
// kMostAbove of its upper end.
constexpr double kBeyond = 0.5;
constexpr double kMostAbove = 0.2;

// A diagonal preconditioner that throws Error(CANCELLED) in the next iteration after a bake was
// cancelled.
class CancellableJacobi : public Eigen::DiagonalPreconditioner<double> {
  public:
    template <class Rhs>
    auto solve(const Eigen::MatrixBase<Rhs>& b) const {
        throwIfCancelled();
        return Eigen::DiagonalPreconditioner<double>::solve(b);
    }
};

// Returns the nodes of a cell. The fourth node of a triangle repeats the first, with weight 0
// wherever it is used.
std::array<uint32_t, 4> nodesOf(const Cell& cell, const SmoothRegions& regions) {
    std::array<uint32_t, 4> node;
    for (int k = 0; k < 4; ++k) node[k] = regions.nodeOf[cell.corner[cell.corner[k] < 0 ? 0 : k]];
    return node;
}

// The slope of the interpolation across an edge of a cell, away from the edge, times the height of
// the cell over the edge. It is given as a stencil over the cell's nodes; `height` is in m.
struct EdgeSlope {
    std::array<double, 4> stencil{0, 0, 0, 0};
    double height = 0;
};

// Returns the slope of a cell across the edge from corner `from` to corner `to`. The height is 0 if
// the edge has no length.
EdgeSlope slopeAcross(const Cell& cell, int32_t from, int32_t to) {
    EdgeSlope slope;
    const int n = cell.cornerCount();
    int start = 0, finish = 0;
    for (int k = 0; k < n; ++k) {
        if (cell.corner[k] == from) start = k;
        if (cell.corner[k] == to) finish = k;
    }
    glm::dvec3 opposite(0.0);
    for (int k = 0; k < n; ++k)
        if (k != start && k != finish) opposite += glm::dvec3(cell.position(k)) / double(n - 2);
    const glm::dvec3 origin = glm::dvec3(cell.position(start));
    const glm::dvec3 edge = glm::dvec3(cell.position(finish)) - origin;
    const double length = glm::length(edge);
    const double along = glm::dot(opposite - origin, edge) / (length * length);
    if (!std::isfinite(along)) return slope;
    slope.height = std::max(glm::length(opposite - origin - along * edge), kLeastHeight * length);
    const double at = std::clamp(along, -kMostAlong, 1 + kMostAlong);
    for (int k = 0; k < n; ++k)
        if (k != start && k != finish) slope.stencil[k] = 1.0 / (n - 2);
    slope.stencil[start] -= 1 - at;
    slope.stencil[finish] -= at;
    return slope;
}

// Adds a penalty on changes of slope across the edges of smooth regions, and on the twist of quads.
// `openness` is, per cell from range.firstCell on, the share of its area that is exposed and not
// separated from the rest of the cell by a wall. The penalty is reduced to this share, since the
// light on the two sides of a covered strip (a wall on a floor) is unrelated.
void addRegularization(const Patches& patches, const InstanceSide& surface,
                       const std::vector<double>& openness, double weight, FitTerms& terms) {
    const InstanceRange& range = surface.range;
    const SmoothRegions& regions = surface.regions;
    std::array<uint32_t, 8> node;
    std::array<double, 8> stencil;
    size_t step = 0;
    for (const SmoothEdge& edge : regions.edges) {
        throwIfCancelledAt(step++);
        const Cell& cell0 = patches.cells[edge.cell[0]];
        const Cell& cell1 = patches.cells[edge.cell[1]];
        const EdgeSlope s0 = slopeAcross(cell0, edge.corner[0], edge.corner[1]);
        const EdgeSlope s1 = slopeAcross(cell1, edge.corner[2], edge.corner[3]);
        if (!(s0.height > 0) || !(s1.height > 0)) continue;
        const std::array<uint32_t, 4> n0 = nodesOf(cell0, regions), n1 = nodesOf(cell1, regions);
        // The difference of the slopes is multiplied by the harmonic mean of the heights. This
        // bounds the stencil even if one of the faces is very thin.
        const double both = s0.height + s1.height;
        for (int k = 0; k < 4; ++k) {
            node[k] = n0[k];
            node[k + 4] = n1[k];
            stencil[k] = s0.stencil[k] * 2 * s1.height / both;
            stencil[k + 4] = s1.stencil[k] * 2 * s0.height / both;
        }
        const double open = std::min(openness[edge.cell[0] - range.firstCell],
                                     openness[edge.cell[1] - range.firstCell]);
        terms.addSquare(node, stencil, weight * open * (cell0.area() + cell1.area()));
    }
    for (uint32_t c = range.firstCell; c < range.lastCell; ++c)
        if (!patches.cells[c].isTriangle()) {
            const std::array<uint32_t, 4> n = nodesOf(patches.cells[c], regions);
            std::copy(n.begin(), n.end(), node.begin());
            std::fill(node.begin() + 4, node.end(), n[0]);
            terms.addSquare(node, {1, -1, 1, -1, 0, 0, 0, 0},
                            weight * openness[c - range.firstCell] * patches.cells[c].area());
        }
}

// The least and the most light of patches, per node.
struct Range {
    Eigen::VectorXd least, most;

    explicit Range(Eigen::Index nodes)
        : least(Eigen::VectorXd::Constant(nodes, INFINITY)),
          most(Eigen::VectorXd::Constant(nodes, -INFINITY)) {}
    void add(Eigen::Index node, double low, double high) {
        least[node] = std::min(least[node], low);
        most[node] = std::max(most[node], high);
    }
};

// A patch side at a node, and the share of the side that is exposed and counts at the node.
struct PatchAtNode {
    uint32_t node = 0, side = 0;
    float share = 0;
};

// Returns per node the range that spans the mean at the node and the light of its patches. Patches
// that are less exposed extend the range by a part of their difference from the mean, so that a
// small change of the exposed shares, which are estimates from lines, changes the range only a
// little.
Range rangeAround(const Eigen::VectorXd& mean, const std::vector<PatchAtNode>& patchesAt,
                  const std::vector<float>& mostExposed, const std::vector<glm::vec3>& field,
                  int channel) {
    Range range(mean.size());
    for (const PatchAtNode& one : patchesAt) {
        const double share = std::max(one.share / mostExposed[one.node] - kLeastBounding, 0.0f) /
                             (1 - kLeastBounding);
        const double from = mean[one.node],
                     value = from + share * (double(field[one.side][channel]) - from);
        range.add(one.node, std::min(from, value), std::max(from, value));
    }
    return range;
}

// Returns per node the range of `range` over all nodes of the cells that the node belongs to.
Range around(const Range& range, const std::vector<std::array<uint32_t, 4>>& cells) {
    Range wide = range;
    for (const std::array<uint32_t, 4>& node : cells) {
        double low = INFINITY, high = -INFINITY;
        for (uint32_t v : node) {
            low = std::min(low, range.least[v]);
            high = std::max(high, range.most[v]);
        }
        for (uint32_t v : node) wide.add(v, low, high);
    }
    return wide;
}

using Fields = std::vector<const std::vector<glm::vec3>*>;  // each per side

// The normal equations of an instance, and the bounds of their solutions. There is one right-hand
// side, a column, for each channel of each field.
class NormalEquations {
  public:
    NormalEquations(const LitSurfaces& surfaces, const InstanceSide& surface, float regularization,
                    const Fields& fields, double tolerance)
        : patches(surfaces.patches),
          surface(surface),
          exposed(surfaces.exposed),
          fields(fields),
          tolerance(tolerance),
          terms(surface.regions.nodeCount),
          rhs(Eigen::MatrixXd::Zero(nodes(), Eigen::Index(columns()))),
          mostExposed(size_t(nodes()), 0.0f) {
        const InstanceRange& range = surface.range;
        for (uint32_t c = range.firstCell; c < range.lastCell; ++c)
            // No surface covers slivers.
            openness.push_back(patches.cells[c].hasPatches ? 0.0 : 1.0);
        const CornerWeights weights(surfaces, range, surface.side);
        for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
            throwIfCancelledAt(p);
            addParent(p, weights);
        }
        addRegularization(patches, surface, openness, double(regularization), terms);
        matrix = terms.matrix();
        throwIfCancelled();
        findOpenAt();
    }

    size_t columns() const { return 3 * fields.size(); }

    // Returns the solution of a column within its bounds, per node. Empty if the column has no
    // light. `isSolved` is set to false if the iteration did not converge; the result is then made
    // from the area-weighted means.
    Eigen::VectorXd solve(size_t column, bool& isSolved) const {
        isSolved = true;
        // Start from the area-weighted mean. Nodes without a patch (of degenerate faces) keep zero.
        Eigen::VectorXd mean = Eigen::VectorXd::Zero(nodes());
        for (Eigen::Index v = 0; v < nodes(); ++v)
            if (terms.areas()[v] > 0) mean[v] = rhs(v, Eigen::Index(column)) / terms.areas()[v];
        const Range bounds = findBounds(mean, column);
        if (mean.maxCoeff() <= 0) return {};
        Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper,
                                 CancellableJacobi>
            solver;
        solver.setTolerance(tolerance);
        solver.setMaxIterations(kMaxIterations);
        solver.compute(matrix);
        Eigen::VectorXd fit = solver.solveWithGuess(rhs.col(Eigen::Index(column)), mean);
        // A result that did not come near the solution may have any value.
        if (!(solver.error() <= kMostResidual)) {
            fit = mean;
            isSolved = false;
        }
        return terms.within(bounds.least, bounds.most, mean, fit);
    }

  private:
    Eigen::Index nodes() const { return surface.regions.nodeCount; }

    // Adds the terms of the patches of a parent, summed in a 4 x 4 matrix over the corners of its
    // cell.
    void addParent(uint32_t p, const CornerWeights& weights) {
        const Parent& parent = patches.parents[p];
        const Cell& cell = patches.cells[parent.cell];
        const std::array<uint32_t, 4> node = nodesOf(cell, surface.regions);
        const std::array<float, 4>& counts = weights.countsAt(p);
        const double joined = double(*std::min_element(counts.begin(), counts.end()));
        std::array<std::array<double, 4>, 4> square{};
        for (uint32_t k = 0; k < parent.patchCount(); ++k) {
            const uint32_t index = 2 * (parent.firstPatch + k) + uint32_t(surface.side);
            const auto [w, all] = weights.of(p, k);
            const float open = std::max(exposed[index], kLeastExposure);
            const double weight = double(patches.area[patchOf(index)]) * open * double(all);
            openness[parent.cell - surface.range.firstCell] += joined * weight / cell.area();
            for (int a = 0; a < 4; ++a) {
                for (int b = 0; b < 4; ++b) square[a][b] += weight * w[a] * w[b];
                if (w[a] == 0) continue;
                patchesAt.push_back({node[a], index, open * counts[size_t(a)]});
                mostExposed[node[a]] = std::max(mostExposed[node[a]], patchesAt.back().share);
                for (size_t c = 0; c < columns(); ++c) {
                    const double value = double((*fields[c / 3])[index][int(c % 3)]);
                    rhs(node[a], Eigen::Index(c)) += weight * w[a] * value;
                }
            }
        }
        terms.addPatches(node, square);
    }

    // Finds the nodes of all cells, and per node the least openness of its cells. Near a contact
    // the exposed part of a face is small, and its slope uncertain.
    void findOpenAt() {
        openAt.assign(size_t(nodes()), 1.0);
        for (uint32_t c = surface.range.firstCell; c < surface.range.lastCell; ++c) {
            throwIfCancelledAt(c);
            cells.push_back(nodesOf(patches.cells[c], surface.regions));
            for (uint32_t v : cells.back())
                openAt[v] = std::min(openAt[v], openness[c - surface.range.firstCell]);
        }
    }

    // Returns the bounds of the values at all nodes. Near a contact, a value may not exceed the
    // light around it; and the more of the faces is covered, the less may a value lie below that
    // light.
    Range findBounds(const Eigen::VectorXd& mean, size_t column) const {
        const Range seen =
            rangeAround(mean, patchesAt, mostExposed, *fields[column / 3], int(column % 3));
        const Range wide = around(seen, cells);
        throwIfCancelled();
        Range bounds(nodes());
        bounds.least = Eigen::VectorXd::Zero(nodes());
        bounds.most = Eigen::VectorXd::Constant(nodes(), INFINITY);
        for (Eigen::Index v = 0; v < nodes(); ++v) {
            const double least = seen.least[v], most = seen.most[v];
            if (!(least <= most)) continue;
            const double open = openAt[size_t(v)];
            const double below = kBeyond * std::max(0.0, 2 * open - 1) * (wide.most[v] - least);
            const double above = std::clamp((open - kTouched) / (1 - kTouched), 0.0, 1.0) *
                                 std::min(kBeyond * (most - wide.least[v]), kMostAbove * most);
            bounds.least[v] = std::min(std::max(least - below, 0.0), mean[v]);
            bounds.most[v] = std::max(most + above, mean[v]);
        }
        return bounds;
    }

    const Patches& patches;
    const InstanceSide& surface;
    const std::vector<float>& exposed;
    const Fields& fields;
    const double tolerance;
    FitTerms terms;
    Eigen::MatrixXd rhs;
    Eigen::SparseMatrix<double> matrix;
    std::vector<PatchAtNode> patchesAt;
    std::vector<float> mostExposed;              // per node
    std::vector<double> openness;                // per cell, see addRegularization()
    std::vector<double> openAt;                  // per node: the least openness of its cells
    std::vector<std::array<uint32_t, 4>> cells;  // per cell: its nodes
};

}  // namespace

LeastSquaresFit leastSquares(const LitSurfaces& surfaces, const InstanceSide& surface,
                             float regularization,
                             const std::vector<const std::vector<glm::vec3>*>& fields,
                             double tolerance) {
    const size_t nodes = surface.regions.nodeCount;
    if (nodes == 0) return {std::vector<std::vector<glm::vec3>>(fields.size())};
    const NormalEquations equations(surfaces, surface, regularization, fields, tolerance);
    std::vector<std::vector<glm::vec3>> result(fields.size(), std::vector<glm::vec3>(nodes));
    std::atomic<bool> areSolved = true;
    parallelFor(size_t(0), equations.columns(), [&](size_t c) {
        throwIfCancelled();
        bool isSolved = true;
        const Eigen::VectorXd solution = equations.solve(c, isSolved);
        if (!isSolved) areSolved = false;
        for (Eigen::Index v = 0; v < solution.size(); ++v)
            result[c / 3][size_t(v)][int(c % 3)] = float(std::max(solution[v], 0.0));
    });
    return {std::move(result), areSolved};
}

}  // namespace raybundle
