// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/conjugate_gradients.h"

#include <utility>

namespace raybundle {
namespace {

// Largest number of iterations of solve().
constexpr int kMaxIterations = 1000;
// Square of a share of the right-hand side. If the solution on the shown sides is smaller than this
// share, the tolerance is relative to this share instead, so that the light there may stay rough.
constexpr double kLeastShown = 1e-8;
// A guess counts as the solution if its squared residual is at most this many times the allowed
// one. It is then the result of a solve with about the same tolerance.
constexpr double kSameSolution = 1.2;

glm::dvec3 ratio(const glm::dvec3& a, const glm::dvec3& b) {
    return {b.x > 0 ? a.x / b.x : 0, b.y > 0 ? a.y / b.y : 0, b.z > 0 ? a.z / b.z : 0};
}

}  // namespace

ConjugateGradients::ConjugateGradients(LineSystem& lines, const Field& scale, Field guess,
                                       Field rightSide, const Field& brought,
                                       const std::vector<bool>* isShown, float tolerance)
    : lines(lines),
      scale(scale),
      isShown(isShown),
      tolerance(double(tolerance)),
      z(std::move(guess)),
      r(z.size()),
      p(z.size()),
      product(std::move(rightSide)),
      given(dot(product, product)) {
    forEachSide(z.size(), [&](size_t i) {
        p[i] = z[i] - scale[i] * brought[i];
        r[i] = product[i] - p[i];
    });
    rr = dot(r, r);
    if (!isNearlySolution()) {
        // This factor is optimal in the norm that conjugate gradients minimise.
        guessFactor = glm::vec3(ratio(dot(z, product), dot(z, p)));
        forEachSide(z.size(), [&](size_t i) {
            z[i] *= guessFactor;
            r[i] = product[i] - guessFactor * p[i];
        });
        rr = dot(r, r);
    }
    guessIsEnough = isNearlySolution();
}

// The light on the shown sides limits the residual too. Otherwise a sunny yard around a room, which
// makes the right-hand side large, would decide how accurate the light in the room is.
glm::dvec3 ConjugateGradients::allowed() const {
    const glm::dvec3 shown = isShown ? glm::min(given, dot(z, z, isShown)) : given;
    return glm::max(shown, kLeastShown * given) * tolerance * tolerance;
}

bool ConjugateGradients::isNearlySolution() const {
    return !glm::any(glm::greaterThan(rr, kSameSolution * allowed()));
}

bool ConjugateGradients::isSettled() const {
    return guessIsEnough || !glm::any(glm::greaterThan(rr, allowed()));
}

void ConjugateGradients::solve() {
    p = r;
    for (int iteration = 0; iteration < kMaxIterations && !isSettled(); ++iteration) {
        lines.send([&](size_t i) { return scale[i] * p[i]; });
        forEachSide(z.size(), [&](size_t i) { product[i] = p[i] - scale[i] * lines.brought(i); });
        const glm::vec3 alpha(ratio(rr, dot(p, product)));
        forEachSide(z.size(), [&](size_t i) {
            z[i] += alpha * p[i];
            r[i] -= alpha * product[i];
        });
        const glm::dvec3 next = dot(r, r);
        const glm::vec3 beta(ratio(next, rr));
        forEachSide(z.size(), [&](size_t i) { p[i] = r[i] + beta * p[i]; });
        rr = next;
    }
}

}  // namespace raybundle
