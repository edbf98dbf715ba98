// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/line_reuse.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <utility>

#include "patches/side.h"
#include "surfaces/translucence.h"
#include "transport/conjugate_gradients.h"
#include "transport/kept_lines.h"
#include "transport/line_system.h"

namespace raybundle {
namespace {

using Field = std::vector<glm::vec3>;  // per side

// Largest number of solves for the light that passes through translucent patches.
constexpr int kMaxPasses = 200;
// Light by direction is found in turns, each from the solution of the turn before. The turns end
// when the share of the reflected light that is left out is below kSettledTurns times the target
// error, or after kMostTurns turns. kSettledTurns is below 1 because the light left out is
// amplified by further reflections like all light (0.7 % left out made a bright room 1.1 % too
// bright).
constexpr double kSettledTurns = 0.25;
constexpr int kMostTurns = 6;
// Each step of the balancing multiplies the weight of each side by the ratio of the wanted to the
// actual number of lines, raised to one of these powers. The power 1 corrects deviations without a
// pattern at once, but it would reverse a deviation that is common to all sides, because both ends
// of a line correct it. The power 0.5 corrects such a common deviation. The first four steps leave
// the same deviation of the measured areas from the true ones as eight steps of the power 0.5 (0.05
// % in cornell_box, where the first step leaves 1.6 %). If lines have several densities, all eight
// steps are taken: with 130 bundles of laid_table the energy is then balanced to 0.05 % instead of
// 0.15 %.
constexpr float kBalancePowers[] = {0.5f, 1.0f, 0.5f, 1.0f, 0.5f, 1.0f, 0.5f, 1.0f};
constexpr size_t kBalanceSteps = 4;
// Largest weight of a side's lines; the least is its inverse. A few lines cannot stand for many.
constexpr float kMaxLineWeight = 2.0f;

// The factors of the scaled system and its starting point: R_i = scale_i z_i. All per side.
struct ScaledSystem {
    explicit ScaledSystem(size_t sides) : scale(sides), lineScale(sides), z(sides) {}

    Field scale;
    Field lineScale;  // scale_i times x_i
    Field z;          // starting point of the solve
};

// Returns the scaled system. `reflected` is R at the starting point. Sets R to 0 in channels that a
// side does not reflect, and then sets `isKept` to false if R was not 0. `rightSide` is the
// exitance that does not depend on R, W/m^2 per side; it is divided by the scale.
ScaledSystem scaledSystem(const Patches& patches, const LineSystem& lines, Field& reflected,
                          bool& isKept, Field& rightSide) {
    ScaledSystem system(lines.sideCount());
    std::atomic<bool> areKept{isKept};
    forEachSide(lines.sideCount(), [&](size_t i) {
        const float m = lines.m(i);
        glm::vec3& scale = system.scale[i];
        scale = m > 0 ? glm::sqrt(patches.reflectance[i] / m) : glm::vec3(0.0f);
        system.lineScale[i] = lines.x(i) * scale;
        for (int c = 0; c < 3; ++c) {
            if (!(scale[c] > 0) && reflected[i][c] != 0) {
                reflected[i][c] = 0;
                areKept = false;
            }
            system.z[i][c] = scale[c] > 0 ? reflected[i][c] / scale[c] : 0;
            rightSide[i][c] = scale[c] > 0 ? rightSide[i][c] / scale[c] : 0;
        }
    });
    isKept = areKept;
    return system;
}

}  // namespace

LineReuse::LineReuse(const Patches& patches, const LineCounts& counts, const FirstShot& shot,
                     const glm::vec3& worldRadiance, const std::vector<float>& exposed,
                     const std::vector<bool>* isShown, const Accuracy& accuracy)
    : patches(patches),
      counts(counts),
      shot(shot),
      worldRadiance(worldRadiance),
      exposed(exposed),
      isShown(isShown),
      accuracy(accuracy),
      directedLight(
          patches, shot,
          accuracy.isRough ? DirectedLight::Of::NOTHING : DirectedLight::Of::BEYOND_FIRST_SHOT),
      scatteredOfSources(patches, shot, worldRadiance != glm::vec3(0.0f)),
      hasEmission(std::any_of(shot.emission.begin(), shot.emission.end(),
                              [](const glm::vec3& e) { return e != glm::vec3(0.0f); })) {}

LineWeights LineReuse::lineWeights(Half half) const {
    const size_t n = counts.sideCount();
    LineWeights weights{std::vector<float>(n, 1.0f), std::vector<float>(n)};
    std::vector<float>& x = weights.x;
    std::vector<float>& m = weights.m;
    if (half != Half::BOTH) {
        for (size_t i = 0; i < n; ++i) m[i] = float(linesOf(counts.total[i], half));
        return weights;
    }
    const std::vector<float> exposed = exposedShare();
    const LitSurfaces surfaces{patches, exposed};
    double lines = 0, area = 0;
    for (size_t i = 0; i < n; ++i) {
        lines += linesOf(counts.total[i], half);
        area += surfaces.exposedArea(i);
    }
    const size_t steps = counts.hasDensities() ? std::size(kBalancePowers) : kBalanceSteps;
    for (size_t step = 0; step < steps; ++step) {
        const float power = kBalancePowers[step];
        std::vector<float>& next = m;
        forEachSide(n, [&](size_t i) {
            const float row = step == 0 ? float(linesOf(counts.total[i], half))  // all x are 1
                                        : weightedLines(counts, half, i, x);
            const float wanted = float(surfaces.exposedArea(i) * lines / area);
            next[i] = row > 0 ? std::clamp(x[i] * std::pow(wanted / (x[i] * row), power),
                                           1 / kMaxLineWeight, kMaxLineWeight)
                              : 1;
        });
        x.swap(next);
    }
    forEachSide(n, [&](size_t i) { m[i] = x[i] * weightedLines(counts, half, i, x); });
    return weights;
}

Irradiance LineReuse::solve(Half half, float tolerance, Field& reflected) const {
    LineSolution guess;
    guess.reflected.swap(reflected);
    Irradiance light = solve(half, tolerance, guess, lineWeights(half));
    reflected.swap(guess.reflected);
    return light;
}

Irradiance LineReuse::solve(Half half, float tolerance, LineSolution& guess,
                            const LineWeights& weights) const {
    ByAngle byAngle;
    byAngle.ofSources =
        accuracy.isRough ? directedAlongKept(half, weights, guess) : directed(half, weights);
    byAngle.brought = byAngle.ofSources;
    Irradiance light = solvePassed(half, tolerance, guess, weights, byAngle);
    // A half only measures the noise, so it is solved once, without the dependence on angles.
    if (half != Half::BOTH || !directedLight.hasAngles()) return light;
    // The first turn leaves out light that was sent by direction twice or more, and each further
    // turn leaves out light that was sent by direction once more often.
    double missing = 1;
    for (int turn = 0; turn < kMostTurns && missing > kSettledTurns * double(accuracy.targetError);
         ++turn) {
        const double bent = findAngles(weights, guess.reflected, light, byAngle);
        light = solvePassed(half, tolerance, guess, weights, byAngle);
        missing = bent * (turn == 0 ? bent : missing);
    }
    light.scattered = byAngle.scattered;
    return light;
}

Irradiance LineReuse::solvePassed(Half half, float tolerance, LineSolution& guess,
                                  const LineWeights& weights, const ByAngle& byAngle) const {
    Field& passed = guess.passed;
    if (patches.translucence.empty()) {
        passed.clear();
        return solveReflected(half, tolerance, guess, weights, byAngle);
    }
    const std::vector<float> exposed = exposedShare();
    const size_t n = counts.sideCount();
    Field next(n), change(n);
    auto passOn = [&](const Field& direct, const Field& indirect) {
        forEachSide(n, [&](size_t i) {
            next[i] = passedOn({patches, exposed}, i, direct[opposite(i)] + indirect[opposite(i)]);
        });
    };
    if (passed.empty()) {
        const HandOver first = handOver({patches, exposed}, shot);
        passOn(first.ofSources, first.indirect);
        passed = next;
    }
    for (int pass = 1;; ++pass) {
        Irradiance light = solveReflected(half, tolerance, guess, weights, byAngle);
        passOn(light.direct, light.indirect);
        forEachSide(n, [&](size_t i) { change[i] = next[i] - passed[i]; });
        passed.swap(next);
        const glm::dvec3 sent =
            dot(guess.reflected, guess.reflected, isShown) + dot(passed, passed, isShown);
        const glm::dvec3 enough = sent * double(tolerance) * double(tolerance);
        const bool isSettled = !glm::any(glm::greaterThan(dot(change, change), enough));
        light.isSettled = light.isSettled && isSettled;
        if (isSettled || pass == kMaxPasses) return light;
    }
}

Irradiance LineReuse::solveReflected(Half half, float tolerance, LineSolution& guess,
                                     const LineWeights& weights, const ByAngle& byAngle) const {
    const size_t n = counts.sideCount();
    Field &reflected = guess.reflected, &brought = guess.brought;
    const std::vector<float> exposed = exposedShare();
    const HandOver first = handOver({patches, exposed}, shot);
    LineSystem lines(counts, half, weights);
    Irradiance result(n);
    addDirect(lines, first, result);
    result.byAngle = byAngle.reflected;
    addPower(byAngle.brought, exposed, result.redirected);
    const Field known = knownLight(lines, guess.passed, byAngle);

    // Exitance, W/m^2. scaledSystem() divides it by the scale.
    Field rightSide(n);
    forEachSide(n, [&](size_t i) {
        glm::vec3 carried = result.direct[i] - first.ofSources[i];
        if (!known.empty()) carried += known[i];
        glm::vec3 unshot = patches.reflectance[i] * carried;
        if (!byAngle.reflected.empty()) unshot += byAngle.reflected[i];
        rightSide[i] = first.unshot[i] + unshot;
    });
    bool isBroughtKnown = !brought.empty();
    ScaledSystem system = scaledSystem(patches, lines, reflected, isBroughtKnown, rightSide);
    // For a half, `brought` follows from the last residual on sides that reflect in all channels,
    // which saves a product with the matrix.
    const Field rightSideOfHalf = half == Half::BOTH ? Field() : rightSide;
    if (!isBroughtKnown) {
        brought.assign(n, glm::vec3(0.0f));
        // Computed as at the end of the solve that found the guess, so that the values are equal to
        // the last bit.
        lines.send([&](size_t i) { return lines.x(i) * reflected[i]; });
        if (dot(system.z, system.z) != glm::dvec3(0.0))
            forEachSide(n, [&](size_t i) { brought[i] = lines.brought(i); });
    }
    ConjugateGradients solver(lines, system.lineScale, std::move(system.z), std::move(rightSide),
                              brought, isShown, tolerance);
    solver.solve();

    result.isSettled = solver.isSettled();
    const bool isSolved = solver.isGuessEnough();
    const glm::vec3 factor = solver.factor();
    const Field &z = solver.solution(), &r = solver.residual();
    // A guess that already is the solution remains unchanged to the last bit.
    if (!isSolved || factor != glm::vec3(1.0f))
        forEachSide(n, [&](size_t i) { reflected[i] = system.scale[i] * z[i]; });
    lines.send([&](size_t i) { return lines.x(i) * reflected[i]; });
    forEachSide(n, [&](size_t i) {
        const glm::vec3& lineScale = system.lineScale[i];
        if (isSolved)
            brought[i] *= factor;
        else if (half != Half::BOTH && glm::all(glm::greaterThan(lineScale, glm::vec3(0.0f))))
            brought[i] = (z[i] - rightSideOfHalf[i] + r[i]) / lineScale;
        else
            brought[i] = lines.brought(i);
        result.indirect[i] = first.indirect[i];
        if (lines.m(i) > 0) result.indirect[i] += lines.x(i) * brought[i] / lines.m(i);
        if (!known.empty()) result.indirect[i] += known[i];
    });
    return result;
}

void LineReuse::addDirect(LineSystem& lines, const HandOver& first, Irradiance& light) const {
    const glm::vec3 worldExitance = glm::pi<float>() * worldRadiance;
    if (hasEmission) lines.send([&](size_t i) { return lines.x(i) * shot.emission[i]; });
    forEachSide(lines.sideCount(), [&](size_t i) {
        light.ofSources[i] = light.direct[i] = first.ofSources[i];
        if (lines.m(i) == 0) return;
        glm::vec3 sum = lines.skyLines(i) * worldExitance;
        if (hasEmission) sum += lines.brought(i);
        light.direct[i] += lines.x(i) * sum / lines.m(i);
    });
}

std::vector<glm::vec3> LineReuse::knownLight(LineSystem& lines, const Field& passed,
                                             const ByAngle& byAngle) const {
    Field known = byAngle.brought;
    if (passed.empty()) return known;
    known.resize(lines.sideCount(), glm::vec3(0.0f));
    lines.send([&](size_t i) { return lines.x(i) * passed[i]; });
    forEachSide(lines.sideCount(), [&](size_t i) {
        if (lines.m(i) > 0) known[i] += lines.x(i) * lines.brought(i) / lines.m(i);
    });
    return known;
}

void LineReuse::addPower(const Field& light, const std::vector<float>& exposed,
                         glm::dvec3& power) const {
    const LitSurfaces surfaces{patches, exposed};
    for (size_t i = 0; i < light.size(); ++i)
        power += surfaces.exposedArea(i) * glm::dvec3(light[i]);
}

size_t LineReuse::gatherStarvedSides(const StarvedRays& rays, const std::vector<bool>& wanted,
                                     const Field& reflected, Irradiance& irradiance) const {
    const std::vector<float> exposed = exposedShare();
    const StarvedInput input{{patches, exposed}, counts, shot, worldRadiance, directedLight};
    StarvedSides sides(input, rays, irradiance);
    sides.castRays(wanted);
    sides.addReflected(reflected);
    return sides.count();
}

}  // namespace raybundle
