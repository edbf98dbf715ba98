// SPDX-License-Identifier: GPL-3.0-or-later
//
// How LINE_REUSE goes on when no more exchanges fit into the memory limit. Each further bundle is
// used once and forgotten: it is one step of a Robbins-Monro iteration on the radiosity system. Per
// patch side i, with c_ij and m_i of the lines of bundle n alone:
//
//   N_i += g_n sum_j c_ij X_j,   D_i += g_n m_i,   X_i = source_i + rho_i N_i / D_i
//
// The weights g_n grow such that the newest bundle has the share a / (n + a), where a = 1 / (1 -
// rho_max). With equal weights (a = 1), the influence of the starting point would fade only as
// slowly as n^-(1 - rho).
//
// Sources: thesis section 2.6 (one bundle, one iteration); Robbins and Monro, "A Stochastic
// Approximation Method" (1951).
// Differs from the stochastic iteration of the thesis:
// - The arriving light is divided by the counted lines, not by the true area, so that furnaces stay
//   exact.
// - The iterate is averaged as it goes. It may therefore use low-discrepancy directions.
// - It starts from the solution on the exchanges that were kept until then.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "bundles/bundle_tracer.h"
#include "patches/lit_surfaces.h"

namespace raybundle {

// The solution of one half on the exchanges that were kept.
struct StreamingStart {
    uint32_t bundles;          // number of bundles of the exchanges
    std::vector<float> lines;  // per side: m_i of these bundles
    // Per side: irradiance by the lines of these bundles, W/m^2.
    std::vector<glm::vec3> direct, indirect;
};

// The iteration of one half of the bundles, for one light.
class StreamingReuse {
  public:
    // `source` is the exitance that does not depend on lines, per side. `emission` (per side) and
    // `worldExitance` are sent along lines as direct light. All are in W/m^2. The objects of
    // `surfaces`, and `emission`, must outlive the object.
    StreamingReuse(const LitSurfaces& surfaces, const StreamingStart& start,
                   const std::vector<glm::vec3>& source, const std::vector<glm::vec3>& emission,
                   const glm::vec3& worldExitance);

    // Makes one step of the iteration with the lines of a bundle.
    void add(const BundleLines& bundle);

    // Return the direct and the indirect irradiance of a side by lines, W/m^2, and its exitance by
    // this light and by `source`, W/m^2.
    glm::vec3 direct(size_t side) const { return ratio(directSum[side], lines[side]); }
    glm::vec3 indirect(size_t side) const { return ratio(indirectSum[side], weight[side]); }
    glm::vec3 reflected(size_t side) const { return exitance[side]; }

  private:
    static glm::vec3 ratio(const glm::dvec3& a, double b) {
        return b > 0 ? glm::vec3(a / b) : glm::vec3(0.0f);
    }
    void meet(uint32_t side, double lineCount);
    void updateExitance(size_t side);

    const LitSurfaces surfaces;
    const std::vector<glm::vec3>& emission;
    const glm::dvec3 worldExitance;
    std::vector<glm::vec3> source;
    double steps;        // a
    double bundles;      // n
    double totalWeight;  // sum of the weights g_n of all bundles so far

    // Per side.
    // Sums over lines of the light that they brought, W/m^2. Those of indirect light are weighted.
    std::vector<glm::dvec3> directSum, indirectSum;
    std::vector<double> lines, weight;  // divisors of the two sums
    std::vector<glm::vec3> exitance;    // X, W/m^2
    // Sides that the current bundle met, and per side: whether it is one of them, and the sum over
    // lines of the exitance that arrives, W/m^2.
    std::vector<uint32_t> met;
    std::vector<bool> isMet;
    std::vector<glm::dvec3> arriving;
};

}  // namespace raybundle
