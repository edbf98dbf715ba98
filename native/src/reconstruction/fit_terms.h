// SPDX-License-Identifier: GPL-3.0-or-later
//
// The terms of a least-squares fit of corner values to the light of patches, kept one by one, and
// how the fit is brought within bounds without a change of its mean.
//
// Source: flux-corrected transport for finite elements (Kuzmin, Löhner and Turek, "Flux-Corrected
// Transport", 2nd ed., 2012, chapters 6 and 7) and its limiter (Zalesak, "Fully Multidimensional
// Flux-Corrected Transport Algorithms for Fluids", 1979). The area-weighted mean around each node
// is within all bounds and has the same integral as the fit; what each term adds to it sums to
// zero over the term's nodes, so that any share of it may be left out.
// Differs: what is left out is at first only around nodes that are out of bounds, since Zalesak's
// limiter, which looks at increases and decreases apart, cuts where nothing is wrong.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <cstdint>
#include <vector>

namespace raybundle {

class FitTerms {
  public:
    explicit FitTerms(uint32_t nodes)
        : nodeCount(nodes), mass(Eigen::VectorXd::Zero(Eigen::Index(nodes))) {}

    // What the patches of a cell add, m^2: the sum of weight[a] * weight[b] * area over them. A
    // node may occur several times.
    void addPatches(const std::array<uint32_t, 4>& node,
                    const std::array<std::array<double, 4>, 4>& square);

    // weight * (stencil . values)^2; the stencil sums to zero.
    void addSquare(const std::array<uint32_t, 8>& node, const std::array<double, 8>& stencil,
                   double weight);

    // Of the normal equations. A node that no term holds has 1 on the diagonal.
    Eigen::SparseMatrix<double> matrix() const;

    // The area that counts for each node, m^2; they sum to that of all patches.
    const Eigen::VectorXd& areas() const { return mass; }

    // The solution of the normal equations, or what came near it, within bounds, which `mean` (the
    // right-hand side by areas()) must keep. The sum of values by areas() is that of `mean`. Of
    // nodes without area the solution stays, within the bounds.
    Eigen::VectorXd within(const Eigen::VectorXd& low, const Eigen::VectorXd& high,
                           const Eigen::VectorXd& mean, const Eigen::VectorXd& solution) const;

  private:
    class Limiter;
    struct CellTerm {
        std::array<uint32_t, 4> node;
        std::array<std::array<float, 4>, 4> square;  // m^2
    };
    struct Square {
        std::array<uint32_t, 8> node;
        std::array<float, 8> stencil;
        double weight;  // m^2
    };

    // Calls visit(term, nodes, amounts) for what each term moves to each of its nodes, m^2 times
    // the values, of those whose nodes are wanted; the amounts of a term sum to zero.
    template <class IsWanted, class Visit>
    void forEachFlux(const Eigen::VectorXd& values, const IsWanted& isWanted,
                     const Visit& visit) const;

    uint32_t nodeCount;
    std::vector<CellTerm> ofPatches;
    std::vector<Square> squares;
    Eigen::VectorXd mass;  // per node, m^2
};

}  // namespace raybundle
