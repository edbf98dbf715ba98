// SPDX-License-Identifier: GPL-3.0-or-later
//
// Where along a bundle its planes are placed: a density over the depth range, which is [0, 1] here.
//
// Systematic and stratified placement draw from a uniform density. CLOSE_DISTANCE draws from a
// mixture, half uniform and half the density of the scene's fragments, so that more planes cross
// where there are many surfaces. A pair of surfaces at depths a < b is then crossed by planeCount *
// (below(b) - below(a)) planes on average. As all planes come from the one mixture, each crossing
// divided by this number is the balance heuristic of multiple importance sampling for its two
// halves.
//
// Sources: thesis section 7.3.5, which asks for a heuristic for surfaces close together and
// proposes systematic sampling; Veach and Guibas, "Optimally Combining Sampling Techniques for
// Monte Carlo Rendering" (1995).
// Differs: the thesis names no density.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace raybundle {

class PlaneDensity {
  public:
    void setUniform() { share = {0, 1}; }

    // fragments: per bin of equal depth.
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

    // The probability of a plane below a depth.
    double below(double depth) const {
        if (share.size() == 2) return depth;
        const double bins = double(share.size() - 1), x = depth * bins;
        const size_t bin = size_t(std::min(x, bins - 1));
        return share[bin] + (x - double(bin)) * (share[bin + 1] - share[bin]);
    }

    // The depth with a given probability of a plane below it.
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
    std::vector<double> share;  // below each border of the bins
};

}  // namespace raybundle
