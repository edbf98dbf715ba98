// SPDX-License-Identifier: GPL-3.0-or-later
//
// LINE_REUSE: solves the radiosity system on the line counts of all bundles to convergence. Per
// patch side i:
//
//   H_i = direct_i + (1 / m_i) sum_j c_ij R_j,   R_i = rho_i H_i   (reflected exitance)
//   direct_i = gathered_i + (sum_j c_ij E_j + sky_i pi L_world) / m_i
//
// If the first shot has already distributed some of the light that it reflected, R_i is unshot_i +
// rho_i (H_i - H_i of the first shot).
//
// With s_i = sqrt(rho_i / m_i) and R_i = s_i z_i the system becomes (I - S C S) z = S M direct.
// This matrix is symmetric and positive definite with a unit diagonal. Conjugate gradients solve
// the system for the three channels at once (transport/conjugate_gradients.h).
//
// Light that passes through translucent patches is another source: side i sends R_i + tau_i H_k,
// where k is the other side of the patch. The system is solved for R repeatedly, each time with the
// H_k of the solve before. This is a regular splitting of the whole system and therefore converges:
// no light is gained on the way.
//
// Sources: thesis section 2.3.2 (eq. 2.30: F = r_ij / r_i) and 2.1.4 (the radiosity system).
// Differs:
// - The thesis transports power while it traces and never solves on the counts. Here each line is
//   used for every bounce.
// - m_i includes the lines that leave the scene, so that rows sum to 1 and the system always
//   contracts. Division by the counted lines instead of the true area makes furnaces exact.
// - The last solve weights each line by x_i x_j (Sinkhorn scaling). m_i is then proportional to the
//   true area of the patch, while rows still sum to 1 and the matrix stays symmetric. As a
//   consequence, no power is lost or made between patches.
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

// Calls body(side) in parallel for all sides below n, with `kInTask` sides per task.
template <size_t kInTask = 2048, class Body>
void forEachSide(size_t n, const Body& body) {
    parallelFor(tbb::blocked_range<size_t>(0, n, kInTask), [&](const auto& range) {
        for (size_t i = range.begin(); i < range.end(); ++i) body(i);
    });
}

// The radiosity system of one light on the line counts, and its solution.
class LineReuse {
  public:
    // How accurately light by direction is computed.
    struct Accuracy {
        float targetError = 0.01f;  // the relative error allowed for all light
        bool isRough = false;       // whether directed() treats both halves as it treats one
    };
    // `exposed` is per side the share that no other surface covers, 0 to 1; if it is empty, the
    // share of `counts` is used. `isShown` is per side whether the light of the side is shown in
    // the result; null: the light of all sides is shown. All references must outlive the object.
    LineReuse(const Patches& patches, const LineCounts& counts, const FirstShot& shot,
              const glm::vec3& worldRadiance, const std::vector<float>& exposed,
              const std::vector<bool>* isShown, const Accuracy& accuracy);
    LineReuse(const Patches& patches, const LineCounts& counts, const FirstShot& shot,
              const glm::vec3& worldRadiance, const std::vector<float>& exposed)
        : LineReuse(patches, counts, shot, worldRadiance, exposed, nullptr, Accuracy{}) {}

    // Returns the irradiance from the lines of a half, or of both. In every channel, the residual
    // is at most `tolerance` times the right-hand side, and at most `tolerance` times the solution
    // on the shown sides. If a limit of iterations is reached before, isSettled of the result is
    // false. `guess` is the starting point and receives the solution; a factor on guess.reflected
    // (R) makes no difference. `weights` must be those of `half`. If any patch is translucent, the
    // system is solved repeatedly until the light that patches pass on has settled; R does not
    // contain this light.
    Irradiance solve(Half half, float tolerance, LineSolution& guess,
                     const LineWeights& weights) const;
    // Returns the irradiance as above, with the weights of lineWeights(half). `reflected` is R as
    // the starting point, and receives the solution.
    Irradiance solve(Half half, float tolerance, std::vector<glm::vec3>& reflected) const;

    // Returns the share of each side that no other surface covers, 0 to 1.
    std::vector<float> exposedShare() const {
        return exposed.empty() ? counts.exposedShare() : exposed;
    }

    // Returns the weights for a solve: 1 for one half; balanced, so that no power is lost, for
    // both.
    LineWeights lineWeights(Half half) const;

    // Casts local rays from the wanted sides (per side) that few lines met, and adds their light to
    // the irradiance (transport/starved_sides.h). `reflected` is R of the last solve. Returns the
    // number of sides that cast rays.
    size_t gatherStarvedSides(const StarvedRays& rays, const std::vector<bool>& wanted,
                              const std::vector<glm::vec3>& reflected,
                              Irradiance& irradiance) const;

    // Returns for each side the irradiance that the lines of a half bring because the light of the
    // sources is not reflected by Lambert's law: the difference from the irradiance by Lambert's
    // law, W/m^2. For one half, the light is taken from cells of directions, which is quicker but
    // less sharp. Empty if there is none. `weights` must be those of `half`.
    std::vector<glm::vec3> directed(Half half, const LineWeights& weights) const;

  private:
    // Returns what directed() does. Keeps the lines in `guess` and takes those that are there.
    std::vector<glm::vec3> directedAlongKept(Half half, const LineWeights& weights,
                                             LineSolution& guess) const;
    KeptLines keptLines(Half half, const LineWeights& weights, size_t ofSide) const;
    // Returns whether directed() takes light from cells of directions, for lines of this half.
    bool usesCells(Half half) const { return accuracy.isRough || half != Half::BOTH; }
    // Returns whether a side sends no light of the sources by direction, as directed() takes it.
    bool isUndirected(Half half, uint32_t side) const;
    // How many entries of a row suffice to represent it: the larger of the two numbers.
    struct Enough {
        // As a share of all entries of the row, 0 to 1.
        double share = 0;
        size_t entries = 0;
    };
    // Returns the given share and the number of entries that the target error requires.
    Enough enoughLines(double share = 0) const;
    // Calls add(share, from, entry) for the lines that end on `side`, or for enough of them. The
    // lines from side `from` bring `share` of its exitance as irradiance. `entry` numbers the calls
    // for this side from 0.
    template <class Add>
    void alongLines(Half half, const LineWeights& weights, const Enough& enough, uint32_t side,
                    const Add& add) const;
    // Adds to `power` (W) the power that `light` (W/m^2 per side) brings to the exposed parts of
    // the sides.
    void addPower(const std::vector<glm::vec3>& light, const std::vector<float>& exposed,
                  glm::dvec3& power) const;
    // The differences from Lambert's surfaces, per side, W/m^2. Empty or null if there are none.
    struct ByAngle {
        // Irradiance by the light of the sources, see directed().
        std::vector<glm::vec3> ofSources;
        // Irradiance by all light, that of the sources included.
        std::vector<glm::vec3> brought;
        std::vector<glm::vec3> reflected;  // see Irradiance::byAngle
        std::shared_ptr<ScatteredLight> scattered;
    };
    // Returns the weighted share of a side's lines that end in the sky; 0 if the sky is dark.
    float skyShare(const LineWeights& weights, uint32_t side) const;
    // Estimates which directions are open to an even sky, from the surfaces that the lines of each
    // side meet.
    void findOpen(const LineWeights& weights, ScatteredLight& scattered) const;
    // Replaces `byAngle`, found from the solution before, by the differences that follow from a new
    // solution: `light` and the exitance `reflected`. Returns the share of the reflected light that
    // leaves otherwise than by Lambert's law.
    double findAngles(const LineWeights& weights, const std::vector<glm::vec3>& reflected,
                      const Irradiance& light, ByAngle& byAngle) const;
    // Solves repeatedly until the light that passes through translucent patches has settled.
    Irradiance solvePassed(Half half, float tolerance, LineSolution& guess,
                           const LineWeights& weights, const ByAngle& byAngle) const;
    // Sets the direct part of `light`: the light that the first shot gathered, and along lines the
    // light of emission and of the world.
    void addDirect(LineSystem& lines, const HandOver& first, Irradiance& light) const;
    // Returns the irradiance by lines that is known before the solve, W/m^2 per side: the
    // differences from Lambert's surfaces, and light that patches pass on (`passed`, per side,
    // W/m^2; may be empty).
    std::vector<glm::vec3> knownLight(LineSystem& lines, const std::vector<glm::vec3>& passed,
                                      const ByAngle& byAngle) const;
    // Solves once, with the passed light in `guess` as a known source (empty: none).
    Irradiance solveReflected(Half half, float tolerance, LineSolution& guess,
                              const LineWeights& weights, const ByAngle& byAngle) const;

    const Patches& patches;
    const LineCounts& counts;
    const FirstShot& shot;
    const glm::vec3 worldRadiance;
    const std::vector<float>& exposed;
    const std::vector<bool>* const isShown;
    const Accuracy accuracy;
    const DirectedLight directedLight;
    const ScatteredLight scatteredOfSources;
    bool hasEmission = false;
};

}  // namespace raybundle
