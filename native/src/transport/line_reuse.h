// SPDX-License-Identifier: GPL-3.0-or-later
//
// LINE_REUSE: the radiosity system on the line counts of all bundles, solved to convergence.
//
//   H_i = direct_i + (1 / m_i) sum_j c_ij R_j,   R_i = rho_i H_i   (reflected exitance)
//   direct_i = gathered_i + (sum_j c_ij E_j + sky_i pi L_world) / m_i
//
// and where the first shot has already distributed some of the light that it reflected, R_i =
// unshot_i + rho_i (H_i - first shot's H_i).
//
// With s_i = sqrt(rho_i / m_i) and R_i = s_i z_i it becomes (I - S C S) z = S M direct, symmetric
// and positive definite, unit diagonal, solved by conjugate gradients for the three channels at
// once (transport/conjugate_gradients.h).
//
// Light that passes through translucent patches is one more source: R_i + tau_i H_k, k the other
// side of the patch, is what leaves side i. Solving for R with the H_k of the last solve, again and
// again, splits the whole system regularly, and so converges: no light is gained on the way.
//
// Sources: thesis section 2.3.2 (eq. 2.30: F = r_ij / r_i) and 2.1.4 (the radiosity system).
// Differs:
// - The thesis never solves on the counts; it transports power while it traces. Each line is used
//   for every bounce here.
// - m_i counts the lines that leave the scene too, so that rows sum to 1 and the system always
//   contracts; dividing by counted lines, not by the true area, makes furnaces exact.
// - The last solve weights each line by x_i x_j, so that m_i becomes proportional to the true area
//   of the patch while rows still sum to 1 and the matrix stays symmetric (Sinkhorn scaling): then
//   no power is lost or made between patches.
// - Surfaces need not be Lambert's (line_reuse_angles.cpp).
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "bundles/line_counts.h"
#include "first_shot/directed_light.h"
#include "first_shot/first_shot.h"
#include "job/cancellation.h"
#include "patches/patches.h"
#include "transport/scattered_light.h"
#include "transport/starved_sides.h"
#include "transport/transport.h"

namespace raybundle {

class LineSystem;

// Calls body(side) for the sides below n, kInTask of them in a task.
template <size_t kInTask = 2048, class Body>
void forEachSide(size_t n, const Body& body) {
    parallelFor(tbb::blocked_range<size_t>(0, n, kInTask), [&](const auto& range) {
        for (size_t i = range.begin(); i < range.end(); ++i) body(i);
    });
}

class LineReuse {
  public:
    // exposed: per side, the share of it that nothing covers; empty: as the counts have it.
    // isShown: per side, whether its light is shown, and not only that of what it lights; null: all
    // is. targetError: of all light, of which what is sent by direction leaves out a part. All
    // references must outlive the object.
    LineReuse(const Patches& patches, const LineCounts& counts, const FirstShot& shot,
              const glm::vec3& worldRadiance, const std::vector<float>& exposed,
              const std::vector<bool>* isShown = nullptr, float targetError = 0.01f);

    // Solves until the residual is below `tolerance` of the right-hand side in every channel, and
    // of the solution on the sides that are shown. `guess` is where it starts: any multiple of its
    // `reflected` (R) is as good as itself; it takes the solution. weights: of the same half.
    // Where patches are translucent, it is solved again with what they passed on until that has
    // settled: R is without it.
    Irradiance solve(Half half, float tolerance, LineSolution& guess,
                     const LineWeights& weights) const;
    // With the weights of the half; nothing but R is kept.
    Irradiance solve(Half half, float tolerance, std::vector<glm::vec3>& reflected) const;

    // The share of each side that nothing covers.
    std::vector<float> exposedShare() const {
        return exposed.empty() ? counts.exposedShare() : exposed;
    }

    // For a solve: 1 for a half, balanced for both.
    LineWeights lineWeights(Half half) const;

    // Adds what local rays of wanted sides (per side) that few lines met bring to the irradiance
    // (transport/starved_sides.h). reflected: R of the last solve. Returns the number of sides.
    size_t gatherStarvedSides(const StarvedRays& rays, const std::vector<bool>& wanted,
                              const std::vector<glm::vec3>& reflected,
                              Irradiance& irradiance) const;

    // Per side: what the lines of a half bring of light by direction, beyond what they bring of it
    // as by Lambert's law, W/m^2; of a half alone by cells, which is quicker. Empty where there is
    // none. weights: of the same half.
    std::vector<glm::vec3> directed(Half half, const LineWeights& weights) const;

  private:
    // Of the entries of a row, so many that stand for all: the larger number.
    struct Enough {
        double share = 0;  // of them
        size_t entries = 0;
    };
    // As many at least as the target error asks for.
    Enough enoughLines(double share = 0) const;
    // The lines of a half to a side, or enough of them: add(share, from, entry), where of what
    // leaves side `from` that share arrives, and entry numbers those that were taken.
    template <class Add>
    void alongLines(Half half, const LineWeights& weights, const Enough& enough, uint32_t side,
                    const Add& add) const;
    // light: per side, W/m^2, of the share that is exposed; power: W.
    void addPower(const std::vector<glm::vec3>& light, const std::vector<float>& exposed,
                  glm::dvec3& power) const;
    // What differs from Lambert's surfaces, per side, W/m^2; empty or null: nothing.
    struct ByAngle {
        std::vector<glm::vec3> ofSources;  // irradiance along lines, see directed
        std::vector<glm::vec3> brought;    // likewise, of all light
        std::vector<glm::vec3> reflected;  // exitance by light along lines
        std::shared_ptr<ScatteredLight> scattered;
    };
    // Of the lines of a side, those to an even sky, weighted; 0 if it is dark.
    float skyShare(const LineWeights& weights, uint32_t side) const;
    // Which directions are open to an even sky, by what the lines of each side meet.
    void findOpen(const LineWeights& weights, ScatteredLight& scattered) const;
    // Of a solution: light, and what is reflected of it. byAngle: of the solution before.
    // Returns what share of reflected light is sent to where Lambert's law would not.
    double findAngles(const LineWeights& weights, const std::vector<glm::vec3>& reflected,
                      const Irradiance& light, ByAngle& byAngle) const;
    // With what passes through translucent patches.
    Irradiance solvePassed(Half half, float tolerance, LineSolution& guess,
                           const LineWeights& weights, const ByAngle& byAngle) const;
    // Adds light straight from emission and the world, by the lines, to that of the sources.
    void addDirect(LineSystem& lines, const HandOver& first, Irradiance& light) const;
    // Irradiance that lines bring of what is not solved for, W/m^2: light by direction, and what is
    // passed on (empty: nothing).
    std::vector<glm::vec3> knownLight(LineSystem& lines, const std::vector<glm::vec3>& passed,
                                      const ByAngle& byAngle) const;
    // What is passed on (empty: nothing) is known.
    Irradiance solveReflected(Half half, float tolerance, LineSolution& guess,
                              const LineWeights& weights, const ByAngle& byAngle) const;

    const Patches& patches;
    const LineCounts& counts;
    const FirstShot& shot;
    const glm::vec3 worldRadiance;
    const std::vector<float>& exposed;
    const std::vector<bool>* const isShown;
    const float targetError;
    const DirectedLight directedLight;
    const ScatteredLight scatteredOfSources;
    bool hasEmission = false;
};

}  // namespace raybundle
