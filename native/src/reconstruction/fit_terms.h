// SPDX-License-Identifier: GPL-3.0-or-later
//
// The terms of a least-squares fit of corner values to the light of patches. They are kept one by
// one, so that the fit can be brought within bounds without changing its mean.
//
// Source: flux-corrected transport for finite elements (Kuzmin, Löhner and Turek, "Flux-Corrected
// Transport", 2nd ed., 2012, chapters 6 and 7) and its limiter (Zalesak, "Fully Multidimensional
// Flux-Corrected Transport Algorithms for Fluids", 1979). The area-weighted mean around each node
// is within all bounds and has the same integral as the fit. The contributions of a term to its
// nodes, which lead from the mean to the fit, sum to zero. Any share of them may therefore be left
// out.
// Differs: contributions are first reduced only around nodes that are out of bounds. Zalesak's
// limiter treats increases and decreases separately and therefore also reduces contributions that
// do no harm.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <cstdint>
#include <vector>

namespace raybundle {

// The terms of a fit, the matrix of its normal equations, and its limiter. Nodes are indices below
// the number given to the constructor.
class FitTerms {
  public:
    explicit FitTerms(uint32_t nodes)
        : nodeCount(nodes), mass(Eigen::VectorXd::Zero(Eigen::Index(nodes))) {}

    // Adds the term of the patches of one cell, or of a part of it. `square[a][b]` is the sum over
    // these patches of weight[a] * weight[b] * area, m^2, where weight[a] is the interpolation
    // weight of node[a] at the patch. A node may occur several times.
    void addPatches(const std::array<uint32_t, 4>& node,
                    const std::array<std::array<double, 4>, 4>& square);

    // Adds the term weight * (sum over k of stencil[k] * value of node[k])^2. The stencil must sum
    // to zero. `weight` is in m^2; the term is ignored unless `weight` is positive.
    void addSquare(const std::array<uint32_t, 8>& node, const std::array<double, 8>& stencil,
                   double weight);

    // Returns the matrix of the normal equations, m^2. A node that occurs in no term has 1 on the
    // diagonal.
    Eigen::SparseMatrix<double> matrix() const;

    // Returns the area that counts for each node, m^2. The sum over the nodes is the weighted area
    // of all patches.
    const Eigen::VectorXd& areas() const { return mass; }

    // Returns the solution of the normal equations limited to the bounds [low, high]. All arguments
    // are per node, in one unit of light. `mean`, the right-hand side divided by areas(), must be
    // within the bounds. `solution` may be approximate. The sum of the result weighted by areas()
    // equals that of `mean`. A node without area keeps its solution, clamped to the bounds.
    Eigen::VectorXd within(const Eigen::VectorXd& low, const Eigen::VectorXd& high,
                           const Eigen::VectorXd& mean, const Eigen::VectorXd& solution) const;

  private:
    class Limiter;
    // The term of the patches of a cell, see addPatches().
    struct CellTerm {
        std::array<uint32_t, 4> node;
        std::array<std::array<float, 4>, 4> square;  // m^2
    };
    // The term of a squared difference, see addSquare().
    struct Square {
        std::array<uint32_t, 8> node;
        std::array<float, 8> stencil;
        double weight;  // m^2
    };

    // Calls visit(term, nodes, amounts) for each term with isWanted(nodes). `term` is the index of
    // the term, and `amounts` its contributions to its nodes at the given values, m^2 times the
    // unit of the values. The amounts of a term sum to zero.
    template <class IsWanted, class Visit>
    void forEachFlux(const Eigen::VectorXd& values, const IsWanted& isWanted,
                     const Visit& visit) const;

    uint32_t nodeCount;
    std::vector<CellTerm> ofPatches;
    std::vector<Square> squares;
    Eigen::VectorXd mass;  // per node, m^2
};

}  // namespace raybundle
