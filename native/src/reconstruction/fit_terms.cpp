// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/fit_terms.h"

#include <algorithm>

#include "job/cancellation.h"

namespace raybundle {
namespace {

// Maximum number of passes that reduce terms only around nodes out of bounds. Zalesak's limiter
// then removes what is still out of bounds.
constexpr int kMaxPasses = 40;
// A value that is out of bounds by no more than this share of the largest value counts as within.
constexpr double kSettled = 1e-6;

// A symmetric matrix that is the sum of small symmetric matrices. Each entry is stored once,
// however many small matrices add to it. A list of all contributions would take ten times the
// memory.
class SymmetricSum {
  public:
    explicit SymmetricSum(size_t size) : rows(size) {}

    // Adds a value to the entry (i, j) and, if i and j differ, to (j, i).
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

    // Adds the symmetric N x N matrix valueAt(a, b) to the entries (node[a], node[b]). A node may
    // occur several times.
    template <size_t N, class ValueAt>
    void add(const std::array<uint32_t, N>& node, const ValueAt& valueAt) {
        for (size_t a = 0; a < N; ++a)
            for (size_t b = 0; b <= a; ++b)
                if (const double value = valueAt(a, b); value != 0)
                    add(node[a], node[b], a != b && node[a] == node[b] ? 2 * value : value);
    }

    // Returns the matrix. A row without entries gets 1 on the diagonal, so that the matrix can be
    // solved.
    Eigen::SparseMatrix<double> matrix() {
        for (uint32_t i = 0; i < rows.size(); ++i)
            if (rows[i].empty()) add(i, i, 1);
        const Eigen::Index n = Eigen::Index(rows.size());
        Eigen::SparseMatrix<double> lower(n, n);
        std::vector<int> counts(rows.size(), 0);
        for (const auto& row : rows)
            for (const Entry& entry : row) ++counts[entry.column];
        lower.reserve(counts);
        // Insert row by row, so that the entries of each column are sorted.
        for (Eigen::Index i = 0; i < n; ++i) {
            throwIfCancelledAt(size_t(i));
            for (const Entry& entry : rows[size_t(i)])
                lower.insertBackUncompressed(i, entry.column) = entry.value;
        }
        lower.makeCompressed();
        throwIfCancelled();
        return lower.selfadjointView<Eigen::Lower>();
    }

  private:
    struct Entry {
        uint32_t column;
        double value;
    };
    std::vector<std::vector<Entry>> rows;  // per row: its entries in the lower triangle
};

}  // namespace

void FitTerms::addPatches(const std::array<uint32_t, 4>& node,
                          const std::array<std::array<double, 4>, 4>& square) {
    CellTerm& term = ofPatches.emplace_back();
    term.node = node;
    for (size_t a = 0; a < 4; ++a)
        for (size_t b = 0; b < 4; ++b) {
            term.square[a][b] = float(square[a][b]);
            mass[node[a]] += double(term.square[a][b]);
        }
}

void FitTerms::addSquare(const std::array<uint32_t, 8>& node, const std::array<double, 8>& stencil,
                         double weight) {
    if (!(weight > 0)) return;
    Square& term = squares.emplace_back();
    term.node = node;
    std::copy(stencil.begin(), stencil.end(), term.stencil.begin());
    term.weight = weight;
}

Eigen::SparseMatrix<double> FitTerms::matrix() const {
    SymmetricSum sum(nodeCount);
    size_t step = 0;
    for (const CellTerm& term : ofPatches) {
        throwIfCancelledAt(step++);
        sum.add(term.node, [&](size_t a, size_t b) { return double(term.square[a][b]); });
    }
    for (const Square& term : squares) {
        throwIfCancelledAt(step++);
        sum.add(term.node, [&](size_t a, size_t b) {
            return term.weight * double(term.stencil[a]) * double(term.stencil[b]);
        });
    }
    return sum.matrix();
}

template <class IsWanted, class Visit>
void FitTerms::forEachFlux(const Eigen::VectorXd& values, const IsWanted& isWanted,
                           const Visit& visit) const {
    size_t index = 0;
    for (const CellTerm& term : ofPatches) {
        throwIfCancelledAt(index);
        if (isWanted(term.node)) {
            std::array<double, 4> amount{};
            for (size_t a = 0; a < 4; ++a)
                for (size_t b = 0; b < 4; ++b)
                    amount[a] +=
                        double(term.square[a][b]) * (values[term.node[a]] - values[term.node[b]]);
            visit(index, term.node, amount);
        }
        ++index;
    }
    for (const Square& term : squares) {
        throwIfCancelledAt(index);
        if (isWanted(term.node)) {
            double slope = 0;
            for (size_t a = 0; a < 8; ++a) slope += double(term.stencil[a]) * values[term.node[a]];
            std::array<double, 8> amount;
            for (size_t a = 0; a < 8; ++a)
                amount[a] = -term.weight * double(term.stencil[a]) * slope;
            visit(index, term.node, amount);
        }
        ++index;
    }
}

// Reduces the contributions that the terms add to the area-weighted mean, until all values are
// within their bounds.
class FitTerms::Limiter {
  public:
    using Vector = Eigen::VectorXd;  // per node

    Limiter(const FitTerms& terms, const Vector& low, const Vector& high, const Vector& mean,
            const Vector& solution)
        : terms(terms),
          low(low),
          high(high),
          mean(mean),
          solution(solution),
          settled(kSettled * std::max(mean.cwiseAbs().maxCoeff(), solution.cwiseAbs().maxCoeff())) {
    }

    // Returns whether the solution itself is within bounds.
    bool isWithin() const {
        bool isWithin = true;
        for (Eigen::Index v = 0; v < solution.size(); ++v)
            isWithin = isWithin && !isOut(v, solution[v]);
        return isWithin;
    }

    // Starts with all contributions of all terms: the values are then those of the solution.
    void addAll() {
        added = Vector::Zero(mean.size());
        terms.forEachFlux(solution, kAny, [&](size_t, const auto& node, const auto& amount) {
            for (size_t a = 0; a < node.size(); ++a) added[node[a]] += amount[a];
        });
        share.assign(terms.ofPatches.size() + terms.squares.size(), 1.0f);
    }

    // Reduces contributions around nodes that are out of bounds. Each such node keeps the share of
    // its contributions that brings its value to the bound. Ends when no node is out of bounds, or
    // after kMaxPasses passes.
    void cutAround() {
        Vector kept(mean.size());
        for (int pass = 0; pass < kMaxPasses; ++pass) {
            kept.setOnes();
            bool isSettled = true;
            for (Eigen::Index v = 0; v < mean.size(); ++v)
                if (const double value = valueAt(v); terms.mass[v] > 0 && isOut(v, value)) {
                    const double bound = value < low[v] ? low[v] : high[v];
                    kept[v] = std::clamp((bound - mean[v]) / (value - mean[v]), 0.0, 1.0);
                    isSettled = false;
                }
            if (isSettled) return;
            keep([&](uint32_t v, double) { return kept[v]; },
                 [&](const auto& node) {
                     return std::any_of(node.begin(), node.end(),
                                        [&](uint32_t v) { return kept[v] < 1; });
                 });
        }
    }

    // Returns whether any node with area is out of bounds.
    bool isAnyOut() const {
        bool isAny = false;
        for (Eigen::Index v = 0; v < mean.size(); ++v)
            isAny = isAny || (terms.mass[v] > 0 && isOut(v, valueAt(v)));
        return isAny;
    }

    // Applies Zalesak's limiter, after which no value is out of bounds.
    void cutAll() {
        Vector more = Vector::Zero(mean.size()), less = more;
        terms.forEachFlux(solution, kAny, [&](size_t term, const auto& node, const auto& amount) {
            for (size_t a = 0; a < node.size(); ++a)
                (amount[a] > 0 ? more : less)[node[a]] += double(share[term]) * amount[a];
        });
        keep(
            [&](uint32_t v, double amount) {
                const double wanted = (amount > 0 ? more : less)[v];
                if (terms.mass[v] <= 0 || wanted == 0) return 1.0;
                const double room = terms.mass[v] * ((amount > 0 ? high : low)[v] - mean[v]);
                return std::clamp(room / wanted, 0.0, 1.0);
            },
            kAny);
    }

    Vector values() const {
        Vector values(mean.size());
        for (Eigen::Index v = 0; v < mean.size(); ++v) values[v] = valueAt(v);
        return values;
    }
    Vector bounded(const Vector& values) const { return values.cwiseMax(low).cwiseMin(high); }

  private:
    static constexpr auto kAny = [](const auto&) { return true; };

    bool isOut(Eigen::Index v, double value) const {
        return value < low[v] - settled || value > high[v] + settled;
    }
    double valueAt(Eigen::Index v) const {
        return terms.mass[v] > 0 ? mean[v] + added[v] / terms.mass[v] : solution[v];
    }
    // Reduces each term to the smallest share that one of its nodes keeps. keptOf(node, amount)
    // returns the share that a node keeps of an amount; only terms with isWanted(nodes) are
    // examined.
    template <class KeptOf, class IsWanted>
    void keep(const KeptOf& keptOf, const IsWanted& isWanted) {
        terms.forEachFlux(solution, isWanted,
                          [&](size_t term, const auto& node, const auto& amount) {
                              double least = 1;
                              for (size_t a = 0; a < node.size(); ++a)
                                  if (amount[a] != 0)
                                      least = std::min(least, keptOf(node[a], amount[a]));
                              const double before = double(share[term]);
                              share[term] = float(before * least);
                              for (size_t a = 0; a < node.size(); ++a)
                                  added[node[a]] -= (before - double(share[term])) * amount[a];
                          });
    }

    const FitTerms& terms;
    const Vector &low, &high, &mean, &solution;
    const double settled;  // values out of bounds by less than this count as within
    Vector added;  // per node: sum of the kept contributions, m^2 times the unit of the values
    std::vector<float> share;  // per term: the share of its contributions that is kept
};

Eigen::VectorXd FitTerms::within(const Eigen::VectorXd& low, const Eigen::VectorXd& high,
                                 const Eigen::VectorXd& mean,
                                 const Eigen::VectorXd& solution) const {
    Limiter limiter(*this, low, high, mean, solution);
    if (limiter.isWithin()) return limiter.bounded(solution);
    limiter.addAll();
    limiter.cutAround();
    // If that did not settle, reduce all contributions.
    if (limiter.isAnyOut()) limiter.cutAll();
    return limiter.bounded(limiter.values());
}

}  // namespace raybundle
