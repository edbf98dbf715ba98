// SPDX-License-Identifier: GPL-3.0-or-later
//
// Conjugate gradients on the radiosity system in the scaled form of transport/line_reuse.h,
//
//   z_i - s_i sum_j c_ij s_j z_j = b_i,
//
// symmetric and positive definite with a diagonal near 1. The three channels are solved at once,
// each with coefficients of its own.
//
// Source: Hestenes and Stiefel, "Methods of Conjugate Gradients for Solving Linear Systems" (1952).
// Differs: the guess is first multiplied by the factor that makes it best. After a change of one
// lamp's colour that is the solution.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "transport/line_system.h"

namespace raybundle {

class ConjugateGradients {
  public:
    using Field = std::vector<glm::vec3>;  // per side

    // scale: s_i, with the weights of the lines in it. guess: where z starts. brought: per side,
    // sum_j c_ij s_j z_j of the guess. tolerance: of the residual, relative to the right-hand side,
    // and to the solution on the sides that isShown holds for (null: to the right-hand side alone),
    // in every channel. References must outlive the object.
    ConjugateGradients(LineSystem& lines, const Field& scale, Field guess, Field rightSide,
                       const Field& brought, const std::vector<bool>* isShown, float tolerance);

    // Whether the guess, times factor(), is a solution already.
    bool isGuessEnough() const { return guessIsEnough; }
    // What the guess was multiplied by, per channel.
    const glm::vec3& factor() const { return guessFactor; }

    // Iterates until the residual is within the tolerance, 1000 times at most.
    void solve();

    // Whether the residual is within the tolerance.
    bool isSettled() const;
    const Field& solution() const { return z; }
    // The right-hand side minus the left one.
    const Field& residual() const { return r; }

  private:
    // The squared residual that is allowed, per channel.
    glm::dvec3 allowed() const;
    bool isNearlySolution() const;

    LineSystem& lines;
    const Field& scale;
    const std::vector<bool>* const isShown;
    const double tolerance;
    Field z, r, p;
    Field product;           // first the right-hand side, then the matrix times p
    const glm::dvec3 given;  // the squared length of the right-hand side
    glm::dvec3 rr{0.0};      // that of the residual
    glm::vec3 guessFactor{1.0f};
    bool guessIsEnough = false;
};

}  // namespace raybundle
