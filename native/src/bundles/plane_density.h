// SPDX-License-Identifier: GPL-3.0-or-later
//
// The density by which the planes of a bundle are placed along its depth range, which is [0, 1]
// here.
//
// Systematic and stratified placement use a uniform density. CLOSE_DISTANCE uses a mixture, half
// uniform and half the density of the scene's fragments, so that more planes cross where there are
// many surfaces. On average, planeCount * (below(b) - below(a)) planes cross a pair of surfaces at
// depths a < b. Since all planes are drawn from the one mixture, dividing each crossing by this
// number is the balance heuristic of multiple importance sampling for the two halves of the
// mixture.
//
// Sources: thesis section 7.3.5, which asks for a heuristic for surfaces close together and
// proposes systematic sampling; Veach and Guibas, "Optimally Combining Sampling Techniques for
// Monte Carlo Rendering" (1995).
// Differs: the thesis does not give a density.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace raybundle {

// A piecewise constant probability density over [0, 1], with bins of equal width.
class PlaneDensity {
  public:
    // Sets the uniform density.
    void setUniform() { share = {0, 1}; }

    // Sets the mixture. `fragments` is the number of fragments in each bin of equal depth.
    void setMixture(const std::vector<uint32_t>& fragments) {
        const double bins = double(fragments.size());
        double all = 0;
        for (uint32_t n : fragments) all += n;
        share.assign(1, 0);
        double before = 0;
        for (uint32_t n : fragments) {
            before += n;
            const double uniform = double(share.size()) / bins;
            share.push_back(all > 0 ? 0.5 * uniform + 0.5 * before / all : uniform);
        }
    }

    // Returns the probability that a plane lies below a depth.
    double below(double depth) const {
        if (share.size() == 2) return depth;
        const double bins = double(share.size() - 1), x = depth * bins;
        const size_t bin = size_t(std::min(x, bins - 1));
        return share[bin] + (x - double(bin)) * (share[bin + 1] - share[bin]);
    }

    // Returns the depth below which a plane lies with the given probability.
    double depthAt(double probability) const {
        const size_t bins = share.size() - 1;
        const size_t bin = std::min(
            bins - 1,
            size_t(std::upper_bound(share.begin() + 1, share.end(), probability) - share.begin()) -
                1);
        return (double(bin) + (probability - share[bin]) / (share[bin + 1] - share[bin])) /
               double(bins);
    }

  private:
    std::vector<double> share;  // per border of the bins: probability of a plane below it
};

}  // namespace raybundle
