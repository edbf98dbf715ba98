// SPDX-License-Identifier: GPL-3.0-or-later
//
// Conjugate gradients on the radiosity system in the scaled form of transport/line_reuse.h:
//
//   z_i - s_i sum_j c_ij s_j z_j = b_i
//
// The matrix is symmetric and positive definite with a diagonal near 1. The three channels are
// solved at once, each with its own coefficients.
//
// Source: Hestenes and Stiefel, "Methods of Conjugate Gradients for Solving Linear Systems" (1952).
// Differs: the guess is first multiplied by the factor that makes it best. If only the colour of
// one lamp has changed, the result is already the solution.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "transport/line_system.h"

namespace raybundle {

// The solver of one system, and its solution.
class ConjugateGradients {
  public:
    using Field = std::vector<glm::vec3>;  // per side

    // `scale` is s_i, including the weights of the lines. `guess` is z at the starting point, and
    // `brought` is sum_j c_ij s_j z_j of it. In every channel, the residual must become at most
    // `tolerance` times the right-hand side, and at most `tolerance` times the solution on the
    // sides that `isShown` marks (null: only the right-hand side counts). References must outlive
    // the object.
    ConjugateGradients(LineSystem& lines, const Field& scale, Field guess, Field rightSide,
                       const Field& brought, const std::vector<bool>* isShown, float tolerance);

    // Returns whether the guess times factor() is already the solution.
    bool isGuessEnough() const { return guessIsEnough; }
    // Returns the factor that the guess was multiplied by, per channel.
    const glm::vec3& factor() const { return guessFactor; }

    // Iterates until the residual is within the tolerance, at most 1000 times.
    void solve();

    // Returns whether the residual is within the tolerance.
    bool isSettled() const;
    const Field& solution() const { return z; }
    // Returns the right-hand side minus the left-hand side.
    const Field& residual() const { return r; }

  private:
    // Returns the largest squared residual within the tolerance, per channel.
    glm::dvec3 allowed() const;
    // Returns whether the residual is about within the tolerance (kSameSolution).
    bool isNearlySolution() const;

    LineSystem& lines;
    const Field& scale;
    const std::vector<bool>* const isShown;
    const double tolerance;
    Field z, r, p;
    Field product;           // first the right-hand side, then the matrix times p
    const glm::dvec3 given;  // squared length of the right-hand side
    glm::dvec3 rr{0.0};      // squared length of the residual
    glm::vec3 guessFactor{1.0f};
    bool guessIsEnough = false;
};

}  // namespace raybundle
