// SPDX-License-Identifier: GPL-3.0-or-later
//
// What LINE_REUSE does when no more exchanges fit into the memory limit: each further bundle is
// used once, for a step of a Robbins-Monro iteration on the radiosity system, and forgotten.
//
//   N_i += g_n sum_j c_ij X_j,   D_i += g_n m_i,   X_i = source_i + rho_i N_i / D_i
//
// with growing weights g_n, such that the share of the newest bundle is a / (n + a),
// a = 1 / (1 - rho_max): with equal weights (a = 1) the memory of the start fades as slowly as
// n^-(1 - rho).
//
// Sources: thesis section 2.6 (one bundle, one iteration); Robbins and Monro, "A Stochastic
// Approximation Method" (1951).
// Differs from the thesis' stochastic iteration: what arrives is divided by the lines counted, not
// by the true area, so that furnaces stay exact; the iterate is averaged as it goes, and so may use
// low-discrepancy directions, from the solution on the exchanges kept until then.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "bundles/bundle_tracer.h"
#include "patches/lit_surfaces.h"

namespace raybundle {

// The solution of a half on the exchanges that were kept.
struct StreamingStart {
    uint32_t bundles;          // that the exchanges are of
    std::vector<float> lines;  // per side: m_i of those bundles
    // Per side: irradiance by their lines, W/m^2.
    std::vector<glm::vec3> direct, indirect;
};

class StreamingReuse {
  public:
    // One half. source: per side, exitance that is there without lines; emission (per side) and
    // worldExitance: what lines bring straight, W/m^2. surfaces and emission must outlive the
    // object.
    StreamingReuse(const LitSurfaces& surfaces, const StreamingStart& start,
                   const std::vector<glm::vec3>& source, const std::vector<glm::vec3>& emission,
                   const glm::vec3& worldExitance);

    void add(const BundleLines& bundle);

    // Irradiance by lines, W/m^2, and the reflected exitance that goes with it.
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
    double totalWeight;  // of all bundles so far

    // Per side.
    std::vector<glm::dvec3> directSum, indirectSum;  // over lines; the latter weighted
    std::vector<double> lines, weight;               // what they are divided by
    std::vector<glm::vec3> exitance;                 // X
    // Of the bundle in hand.
    std::vector<uint32_t> met;
    std::vector<bool> isMet;
    std::vector<glm::dvec3> arriving;
};

}  // namespace raybundle
