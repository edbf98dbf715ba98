// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/line_reuse.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <utility>

#include "surfaces/translucence.h"
#include "transport/conjugate_gradients.h"
#include "transport/line_system.h"

namespace raybundle {
namespace {

using Field = std::vector<glm::vec3>;  // per side

constexpr int kMaxPasses = 200;  // through translucent patches
// What is sent by direction is found in turns, each from the solution before it, until the share of
// the reflected light that is left out is so many times the target error, for it is amplified as
// all light is (0.7 % left out made a bright room 1.1 % too bright), and at most so many.
constexpr double kSettledTurns = 0.25;
constexpr int kMostTurns = 6;
// The balancing corrects weights by these powers of what is missing, one after the other: all of it
// settles at once what has no pattern, half of it what is common to all sides, which all of it
// would reverse. Four such steps leave the deviation of the measured areas from the true ones that
// eight by halves leave (0.05 % in cornell_box, from 1.6 after the first). Lines of several
// densities take them twice: with 130 bundles of laid_table the energy is then balanced to 0.05 %
// instead of 0.15.
constexpr float kBalancePowers[] = {0.5f, 1.0f, 0.5f, 1.0f, 0.5f, 1.0f, 0.5f, 1.0f};
constexpr size_t kBalanceSteps = 4;
constexpr float kMaxLineWeight =
    2.0f;  // and at least its inverse: a few lines cannot stand for many

// The system in z, with what its right-hand side and z are multiplied by: R_i = scale_i z_i.
struct ScaledSystem {
    explicit ScaledSystem(size_t sides) : scale(sides), lineScale(sides), z(sides) {}

    Field scale;
    Field lineScale;  // the same times x_i
    Field z;          // where the solve starts
};

// reflected: R where the solve starts; is set to 0 in channels that a side does not reflect, and
// isKept to false if that changes anything. rightSide: exitance that does not depend on R, W/m^2;
// is divided by the scale.
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
                     const std::vector<bool>* isShown, float targetError)
    : patches(patches),
      counts(counts),
      shot(shot),
      worldRadiance(worldRadiance),
      exposed(exposed),
      isShown(isShown),
      targetError(targetError),
      directedLight(patches, shot),
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
    double lines = 0, area = 0;
    for (size_t i = 0; i < n; ++i) {
        lines += linesOf(counts.total[i], half);
        area += double(patches.area[i / 2] * exposed[i]);
    }
    const size_t steps = counts.hasDensities() ? std::size(kBalancePowers) : kBalanceSteps;
    for (size_t step = 0; step < steps; ++step) {
        const float power = kBalancePowers[step];
        std::vector<float>& next = m;
        forEachSide(n, [&](size_t i) {
            const float row = step == 0 ? float(linesOf(counts.total[i], half))  // all x are 1
                                        : weightedLines(counts, half, i, x);
            const float wanted = float(patches.area[i / 2] * exposed[i] * lines / area);
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
    byAngle.brought = byAngle.ofSources = directed(half, weights);
    Irradiance light = solvePassed(half, tolerance, guess, weights, byAngle);
    // Halves tell of noise alone.
    if (half != Half::BOTH || !directedLight.hasAngles()) return light;
    // Each turn leaves out what was sent by direction once more often.
    double missing = 1;
    for (int turn = 0; turn < kMostTurns && missing > kSettledTurns * double(targetError); ++turn) {
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
            next[i] = passedOn({patches, exposed}, i, direct[i ^ 1] + indirect[i ^ 1]);
        });
    };
    if (passed.empty()) {
        const HandOver first = handOver({patches, exposed}, shot);
        passOn(first.gathered, first.indirect);
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

    Field rightSide(n);  // exitance, W/m^2, and then scaled
    forEachSide(n, [&](size_t i) {
        glm::vec3 carried = result.direct[i] - first.gathered[i];
        if (!known.empty()) carried += known[i];
        glm::vec3 unshot = patches.reflectance[i] * carried;
        if (!byAngle.reflected.empty()) unshot += byAngle.reflected[i];
        rightSide[i] = first.unshot[i] + unshot;
    });
    bool isBroughtKnown = !brought.empty();
    ScaledSystem system = scaledSystem(patches, lines, reflected, isBroughtKnown, rightSide);
    // What the lines bring to a half follows from its last residual, where a channel reflects.
    const Field rightSideOfHalf = half == Half::BOTH ? Field() : rightSide;
    if (!isBroughtKnown) {
        brought.assign(n, glm::vec3(0.0f));
        // To the last bit as at the end of the solve that found the guess.
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
    // A solution that is one already stays as it is, to the last bit.
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
        light.gathered[i] = light.direct[i] = first.gathered[i];
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
    for (size_t i = 0; i < light.size(); ++i)
        power += double(patches.area[i / 2] * exposed[i]) * glm::dvec3(light[i]);
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
