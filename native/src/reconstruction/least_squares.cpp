// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/least_squares.h"

#include <tbb/parallel_for.h>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>

namespace raybundle {
namespace {

// Of patches more covered than this, the light of the exposed share is too uncertain to bound
// others.
constexpr float kHalfCovered = 0.5f;
// A face with more than this share exposed touches nothing.
constexpr double kOpen = 0.99;
constexpr double kTolerance = 1e-6;
// Sweeps that keep the values within bounds end at this share of the brightest patch.
constexpr double kSettled = 1e-4;
constexpr int kMaxSweeps = 100;

// A symmetric matrix as the sum of small ones. Each entry is kept once, however many add to it: a
// list of all that is added would take ten times the memory.
class SymmetricSum {
  public:
    explicit SymmetricSum(size_t size) : rows(size) {}

    // To (i, j) and, if they differ, to (j, i).
    void add(uint32_t i, uint32_t j, double value) {
        std::vector<Entry>& row = rows[std::max(i, j)];
        const uint32_t column = std::min(i, j);
        const auto found = std::find_if(row.begin(), row.end(),
                                        [&](const Entry& e) { return e.column == column; });
        if (found != row.end())
            found->value += value;
        else
            row.push_back({column, value});
    }

    // valueAt(a, b), symmetric, at (node[a], node[b]); a node may occur several times.
    template <size_t N, class ValueAt>
    void add(const std::array<uint32_t, N>& node, const ValueAt& valueAt) {
        for (size_t a = 0; a < N; ++a)
            for (size_t b = 0; b <= a; ++b)
                if (const double value = valueAt(a, b); value != 0)
                    add(node[a], node[b], a != b && node[a] == node[b] ? 2 * value : value);
    }

    // weight * stencil * stencil^T.
    template <size_t N>
    void addSquare(const std::array<uint32_t, N>& node, const std::array<double, N>& stencil,
                   double weight) {
        add(node, [&](size_t a, size_t b) { return weight * stencil[a] * stencil[b]; });
    }

    Eigen::SparseMatrix<double> matrix() const {
        const Eigen::Index n = Eigen::Index(rows.size());
        Eigen::SparseMatrix<double> lower(n, n);
        std::vector<int> counts(rows.size(), 0);
        for (const auto& row : rows)
            for (const Entry& entry : row) ++counts[entry.column];
        lower.reserve(counts);
        // In the order of rows, so that columns are.
        for (Eigen::Index i = 0; i < n; ++i)
            for (const Entry& entry : rows[size_t(i)])
                lower.insertBackUncompressed(i, entry.column) = entry.value;
        lower.makeCompressed();
        return lower.selfadjointView<Eigen::Lower>();
    }

  private:
    struct Entry {
        uint32_t column;
        double value;
    };
    std::vector<std::vector<Entry>> rows;  // of the lower triangle
};

// The nodes of a cell; a triangle repeats its first, with weight 0 wherever it is used.
std::array<uint32_t, 4> nodesOf(const Cell& cell, const SmoothRegions& regions) {
    std::array<uint32_t, 4> node;
    for (int k = 0; k < 4; ++k) node[k] = regions.nodeOf[cell.corner[cell.corner[k] < 0 ? 0 : k]];
    return node;
}

double areaOf(const Cell& cell) {
    return glm::length(glm::cross(glm::dvec3(cell.a), glm::dvec3(cell.b))) *
           (cell.isTriangle() ? 0.5 : 1.0);
}

// Slope of the interpolation across an edge of a cell, away from the edge: a stencil over the
// cell's nodes, per metre, and the height of the cell over the edge.
struct EdgeSlope {
    std::array<double, 4> stencil{0, 0, 0, 0};
    double height = 0;
};

EdgeSlope slopeAcross(const Cell& cell, int32_t from, int32_t to) {
    EdgeSlope slope;
    const int n = cell.isTriangle() ? 3 : 4;
    int start = 0, finish = 0;
    for (int k = 0; k < n; ++k) {
        if (cell.corner[k] == from) start = k;
        if (cell.corner[k] == to) finish = k;
    }
    glm::dvec3 far(0.0);
    for (int k = 0; k < n; ++k)
        if (k != start && k != finish) far += glm::dvec3(cell.position(k)) / double(n - 2);
    const glm::dvec3 origin = glm::dvec3(cell.position(start));
    const glm::dvec3 edge = glm::dvec3(cell.position(finish)) - origin;
    const double along = glm::dot(far - origin, edge) / glm::dot(edge, edge);
    slope.height = glm::length(far - origin - along * edge);
    for (int k = 0; k < n; ++k)
        if (k != start && k != finish) slope.stencil[k] = 1 / (slope.height * (n - 2));
    slope.stencil[start] -= (1 - along) / slope.height;
    slope.stencil[finish] -= along / slope.height;
    return slope;
}

// openness: per cell from range.firstCell on, the share of its area that is exposed. Light on the
// two sides of a covered strip (a wall on a floor) has nothing to do with each other.
void addRegularization(const Patches& patches, const InstanceRange& range,
                       const SmoothRegions& regions, const std::vector<double>& openness,
                       double weight, SymmetricSum& sum) {
    for (const SmoothEdge& edge : regions.edges) {
        const Cell& cell0 = patches.cells[edge.cell[0]];
        const Cell& cell1 = patches.cells[edge.cell[1]];
        const EdgeSlope s0 = slopeAcross(cell0, edge.corner[0], edge.corner[1]);
        const EdgeSlope s1 = slopeAcross(cell1, edge.corner[2], edge.corner[3]);
        if (!(s0.height > 0) || !(s1.height > 0)) continue;
        const std::array<uint32_t, 4> n0 = nodesOf(cell0, regions), n1 = nodesOf(cell1, regions);
        std::array<uint32_t, 8> node;
        std::array<double, 8> stencil;
        for (int k = 0; k < 4; ++k) {
            node[k] = n0[k];
            node[k + 4] = n1[k];
            stencil[k] = s0.stencil[k];
            stencil[k + 4] = s1.stencil[k];
        }
        const double height = 0.5 * (s0.height + s1.height);
        const double open = std::min(openness[edge.cell[0] - range.firstCell],
                                     openness[edge.cell[1] - range.firstCell]);
        sum.addSquare(node, stencil,
                      weight * open * (areaOf(cell0) + areaOf(cell1)) * height * height);
    }
    for (uint32_t c = range.firstCell; c < range.lastCell; ++c)
        if (!patches.cells[c].isTriangle())
            sum.addSquare(nodesOf(patches.cells[c], regions), std::array<double, 4>{1, -1, 1, -1},
                          weight * openness[c - range.firstCell] * areaOf(patches.cells[c]));
}

// Brings a solution of the normal equations within its bounds by projected Gauss-Seidel sweeps: the
// least squares under the bounds, in which neighbours make up for what a bound cuts off, so that
// the mean light stays.
void keepWithin(const Eigen::SparseMatrix<double>& matrix, const Eigen::VectorXd& rhs,
                const Eigen::VectorXd& low, const Eigen::VectorXd& high, double scale,
                Eigen::VectorXd& solution) {
    const Eigen::VectorXd inside = solution.cwiseMax(low).cwiseMin(high);
    if ((inside - solution).cwiseAbs().maxCoeff() <= kSettled * scale) {
        solution = inside;
        return;
    }
    solution = inside;
    for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
        double change = 0;
        for (Eigen::Index v = 0; v < solution.size(); ++v) {
            double residual = rhs[v], diagonal = 0;
            // Symmetric: a column is a row.
            for (Eigen::SparseMatrix<double>::InnerIterator at(matrix, v); at; ++at) {
                residual -= at.value() * solution[at.row()];
                if (at.row() == v) diagonal = at.value();
            }
            if (diagonal <= 0) continue;
            const double next = std::clamp(solution[v] + residual / diagonal, low[v], high[v]);
            change = std::max(change, std::abs(next - solution[v]));
            solution[v] = next;
        }
        if (change <= kSettled * scale) break;
    }
}

}  // namespace

std::vector<std::vector<glm::vec3>> leastSquares(
    const Patches& patches, const InstanceRange& range, const SmoothRegions& regions, rb_side side,
    const std::vector<float>& exposed, float regularization,
    const std::vector<const std::vector<glm::vec3>*>& fields) {
    const size_t columns = 3 * fields.size();
    const Eigen::Index nodes = regions.nodeCount;
    if (nodes == 0) return std::vector<std::vector<glm::vec3>>(fields.size());
    SymmetricSum sum(regions.nodeCount);
    Eigen::MatrixXd rhs = Eigen::MatrixXd::Zero(nodes, Eigen::Index(columns));
    Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(nodes, Eigen::Index(columns));
    Eigen::VectorXd weightSum = Eigen::VectorXd::Zero(nodes);
    std::vector<double> highest(columns, 0);
    // Range of the well exposed patches around each node.
    Eigen::MatrixXd least = Eigen::MatrixXd::Constant(nodes, Eigen::Index(columns), INFINITY);
    Eigen::MatrixXd most = Eigen::MatrixXd::Constant(nodes, Eigen::Index(columns), -INFINITY);
    std::vector<double> openness(range.lastCell - range.firstCell, 0);

    // Add up the patches of each parent in a 4 x 4 matrix over the corners of its cell.
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        const Parent& parent = patches.parents[p];
        const Cell& cell = patches.cells[parent.cell];
        const std::array<uint32_t, 4> node = nodesOf(cell, regions);
        const glm::vec2 centroid = parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
        std::array<std::array<double, 4>, 4> square{};
        for (uint32_t k = 0; k < parent.patchCount(); ++k) {
            const uint32_t index = 2 * (parent.firstPatch + k) + uint32_t(side);
            const std::array<float, 4> w =
                cell.weights(parent.position(parent.pointOn(k, centroid)));
            const float open = std::max(exposed[index], kLeastExposure);
            const double weight = double(patches.area[index / 2]) * open;
            openness[parent.cell - range.firstCell] += weight / areaOf(cell);
            for (int a = 0; a < 4; ++a) {
                for (int b = 0; b < 4; ++b) square[a][b] += weight * w[a] * w[b];
                if (w[a] == 0) continue;
                weightSum[node[a]] += weight * w[a];
                for (size_t c = 0; c < columns; ++c) {
                    const double value = double((*fields[c / 3])[index][int(c % 3)]);
                    rhs(node[a], Eigen::Index(c)) += weight * w[a] * value;
                    if (open <= kHalfCovered) continue;
                    highest[c] = std::max(highest[c], value);
                    double& low = least(node[a], Eigen::Index(c));
                    double& high = most(node[a], Eigen::Index(c));
                    low = std::min(low, value);
                    high = std::max(high, value);
                }
            }
        }
        sum.add(node, [&](size_t a, size_t b) { return square[a][b]; });
    }
    addRegularization(patches, range, regions, openness, double(regularization), sum);

    // At a contact the exposed part of a face is small, and its slope uncertain: the value there
    // stays within what is seen around it.
    std::vector<bool> atContact(size_t(nodes), false);
    for (uint32_t c = range.firstCell; c < range.lastCell; ++c)
        if (openness[c - range.firstCell] < kOpen)
            for (uint32_t v : nodesOf(patches.cells[c], regions)) atContact[v] = true;

    // Start from the area-weighted mean; nodes without a patch (degenerate faces) keep zero.
    for (Eigen::Index v = 0; v < nodes; ++v) {
        if (weightSum[v] > 0)
            mean.row(v) = rhs.row(v) / weightSum[v];
        else
            sum.add(uint32_t(v), uint32_t(v), 1);
    }
    const Eigen::SparseMatrix<double> matrix = sum.matrix();

    std::vector<std::vector<glm::vec3>> result(fields.size(),
                                               std::vector<glm::vec3>(size_t(nodes)));
    tbb::parallel_for(size_t(0), columns, [&](size_t c) {
        if (highest[c] <= 0) return;
        Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
        solver.setTolerance(kTolerance);
        solver.compute(matrix);
        Eigen::VectorXd solution =
            solver.solveWithGuess(rhs.col(Eigen::Index(c)), mean.col(Eigen::Index(c)));
        Eigen::VectorXd low = Eigen::VectorXd::Zero(nodes);
        Eigen::VectorXd high = Eigen::VectorXd::Constant(nodes, INFINITY);
        for (Eigen::Index v = 0; v < nodes; ++v)
            if (atContact[size_t(v)] && least(v, Eigen::Index(c)) <= most(v, Eigen::Index(c))) {
                low[v] = std::max(least(v, Eigen::Index(c)), 0.0);
                high[v] = std::max(most(v, Eigen::Index(c)), 0.0);
            }
        keepWithin(matrix, rhs.col(Eigen::Index(c)), low, high, highest[c], solution);
        for (Eigen::Index v = 0; v < nodes; ++v)
            result[c / 3][size_t(v)][int(c % 3)] = float(solution[v]);
    });
    return result;
}

}  // namespace raybundle
