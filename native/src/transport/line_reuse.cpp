// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/line_reuse.h"

#include <tbb/parallel_reduce.h>

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <glm/gtc/constants.hpp>

#include "job/cancellation.h"
#include "sampling/sobol.h"
#include "sampling/sphere_sampling.h"
#include "surfaces/translucence.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

using Field = std::vector<glm::vec3>;  // per side

constexpr int kMaxIterations = 1000;
// Where no light of more than this share, squared, reaches what is shown, it may stay rough.
constexpr double kLeastShown = 1e-8;
constexpr int kMaxPasses = 200;  // through translucent patches
// A guess whose squared residual is this many times what is allowed is the solution of a solve to
// about the same tolerance.
constexpr double kSameSolution = 1.2;
// What is sent by direction is found in turns, each from the solution before it, until the share of
// the reflected light that is left out is so many times the target error, for it is amplified as
// all light is (0.7 % left out made a bright room 1.1 % too bright), and at most so many.
constexpr double kSettledTurns = 0.25;
constexpr int kMostTurns = 6;
constexpr size_t kGrain = 2048;  // sides per task of a sum
constexpr int kMaxSweeps = 64;   // over the starved sides
constexpr float kSettled = 1e-5f;
// Local rays per starved side: kLocalRays, less where there are many, to stay below kMostLocalRays
// in all.
constexpr size_t kLocalRays = 64, kFewLocalRays = 16, kMostLocalRays = 8 << 20;
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

// In double and in an order that does not depend on the number of threads. Over the sides that
// `which` holds for; null: all.
glm::dvec3 dot(const Field& a, const Field& b, const std::vector<bool>* which = nullptr) {
    return tbb::parallel_deterministic_reduce(
        tbb::blocked_range<size_t>(0, a.size(), kGrain), glm::dvec3(0.0),
        [&](const auto& range, glm::dvec3 sum) {
            for (size_t i = range.begin(); i < range.end(); ++i)
                if (!which || (*which)[i]) sum += glm::dvec3(a[i]) * glm::dvec3(b[i]);
            return sum;
        },
        std::plus<>());
}

uint32_t linesOf(const std::array<uint32_t, 2>& lines, Half half) {
    return half == Half::BOTH ? lines[0] + lines[1] : lines[size_t(half)];
}

// What a row is multiplied with: padded, so that one SIMD register holds a side.
using Padded = Eigen::Array4f;
using PaddedField = std::vector<Padded>;  // per side

Padded padded(const glm::vec3& v) { return {v.x, v.y, v.z, 0}; }

// sum_j c_ij x_j; Value: float or Padded.
template <class Value>
Value rowTimes(const LineCounts& counts, Half half, size_t row, const std::vector<Value>& x,
               const Value& zero) {
    const LineRows::LinesOf<float>& lines = LineRows::linesOf<float>();
    // Sums that do not wait for each other.
    constexpr int kSums = 4;
    Value sums[kSums] = {zero, zero, zero, zero};
    for (size_t h = 0; h < 2; ++h) {
        if (half != Half::BOTH && half != Half(h)) continue;
        const uint32_t* e = counts.rows(h).first(uint32_t(row));
        const uint32_t* const last = counts.rows(h).last(uint32_t(row));
        for (; e + kSums <= last; e += kSums)
            for (int k = 0; k < kSums; ++k)
                sums[k] += lines[e[k] & 255] * x[LineRows::sideOf(e[k])];
        for (; e < last; ++e) sums[0] += lines[*e & 255] * x[LineRows::sideOf(*e)];
    }
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

glm::vec3 rowTimes(const LineCounts& counts, Half half, size_t i, const PaddedField& x) {
    const Padded sum = rowTimes<Padded>(counts, half, i, x, Padded::Zero());
    return {sum[0], sum[1], sum[2]};
}

// The same and the lines to the sky.
float weightedLines(const LineCounts& counts, Half half, size_t i, const std::vector<float>& x) {
    return float(linesOf(counts.sky[i], half)) + rowTimes<float>(counts, half, i, x, 0.0f);
}

glm::dvec3 ratio(const glm::dvec3& a, const glm::dvec3& b) {
    return {b.x > 0 ? a.x / b.x : 0, b.y > 0 ? a.y / b.y : 0, b.z > 0 ? a.z / b.z : 0};
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
            next[i] = passedOn(patches, exposed, i, direct[i ^ 1] + indirect[i ^ 1]);
        });
    };
    if (passed.empty()) {
        const HandOver first = handOver(patches, shot, exposed);
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
    const Field& passed = guess.passed;
    Irradiance result(n);
    const std::vector<float> exposed = exposedShare();
    const HandOver first = handOver(patches, shot, exposed);
    const std::vector<float>&x = weights.x, &m = weights.m;
    PaddedField scaled(n);  // what the matrix multiplies next

    // Direct light.
    const glm::vec3 worldExitance = glm::pi<float>() * worldRadiance;
    forEachSide(n, [&](size_t i) { scaled[i] = padded(x[i] * shot.emission[i]); });
    forEachSide(n, [&](size_t i) {
        result.gathered[i] = result.direct[i] = first.gathered[i];
        if (m[i] == 0) return;
        glm::vec3 sum = float(linesOf(counts.sky[i], half)) * worldExitance;
        if (hasEmission) sum += rowTimes(counts, half, i, scaled);
        result.direct[i] += x[i] * sum / m[i];
    });
    // By the lines, of what is not solved for, W/m^2.
    Field known = byAngle.brought;
    result.byAngle = byAngle.reflected;
    addPower(known, exposed, result.redirected);
    if (!passed.empty()) {
        known.resize(n, glm::vec3(0.0f));
        forEachSide(n, [&](size_t i) { scaled[i] = padded(x[i] * passed[i]); });
        forEachSide(n, [&](size_t i) {
            if (m[i] > 0) known[i] += x[i] * rowTimes(counts, half, i, scaled) / m[i];
        });
    }

    // The scaling, the right-hand side and the first residual.
    Field scale(n), lineScale(n), z(n), r(n), p(n), product(n);
    std::atomic<bool> isBroughtKnown{!brought.empty()};
    forEachSide(n, [&](size_t i) {
        scale[i] = m[i] > 0 ? glm::sqrt(patches.reflectance[i] / m[i]) : glm::vec3(0.0f);
        lineScale[i] = x[i] * scale[i];
        for (int c = 0; c < 3; ++c) {
            if (!(scale[i][c] > 0) && reflected[i][c] != 0) {
                reflected[i][c] = 0;
                isBroughtKnown = false;
            }
            z[i][c] = scale[i][c] > 0 ? reflected[i][c] / scale[i][c] : 0;
        }
        // The right-hand side, until the loop: unshot and what the lines brought, over the scale.
        glm::vec3 carried = result.direct[i] - first.gathered[i];
        if (!known.empty()) carried += known[i];
        glm::vec3 unshot = patches.reflectance[i] * carried;
        if (!byAngle.reflected.empty()) unshot += byAngle.reflected[i];
        for (int c = 0; c < 3; ++c)
            product[i][c] = scale[i][c] > 0 ? (first.unshot[i][c] + unshot[c]) / scale[i][c] : 0;
        // Lines' product with the guess, to the last bit as at the end of the solve that found it.
        scaled[i] = padded(x[i] * reflected[i]);
    });
    // What the lines bring to a half follows from its last residual, where a channel reflects.
    const Field rightSide = half == Half::BOTH ? Field() : product;
    const glm::dvec3 given = dot(product, product);
    // A sunny yard around a room says nothing of what matters in the room.
    auto enough = [&] {
        const glm::dvec3 shown = isShown ? glm::min(given, dot(z, z, isShown)) : given;
        return glm::max(shown, kLeastShown * given) * double(tolerance) * double(tolerance);
    };
    if (!isBroughtKnown) brought.assign(n, glm::vec3(0.0f));
    if (!isBroughtKnown && dot(z, z) != glm::dvec3(0.0))
        forEachSide(n, [&](size_t i) { brought[i] = rowTimes(counts, half, i, scaled); });
    forEachSide(n, [&](size_t i) {
        p[i] = z[i] - lineScale[i] * brought[i];
        r[i] = product[i] - p[i];
    });
    glm::dvec3 rr = dot(r, r);
    auto isNearly = [&] { return !glm::any(glm::greaterThan(rr, kSameSolution * enough())); };
    glm::vec3 share(1.0f);
    if (!isNearly()) {
        // Of all multiples of the guess the best, in the measure of conjugate gradients: after a
        // change of one lamp's colour that is the solution.
        share = glm::vec3(ratio(dot(z, product), dot(z, p)));
        forEachSide(n, [&](size_t i) {
            z[i] *= share;
            r[i] = product[i] - share * p[i];
        });
        rr = dot(r, r);
    }
    const bool isSolved = isNearly();
    p = r;

    // Conjugate gradients, each channel with its own coefficients.
    for (int iteration = 0; !isSolved && iteration < kMaxIterations; ++iteration) {
        if (!glm::any(glm::greaterThan(rr, enough()))) break;
        forEachSide(n, [&](size_t i) { scaled[i] = padded(lineScale[i] * p[i]); });
        forEachSide(n, [&](size_t i) {
            product[i] = p[i] - lineScale[i] * rowTimes(counts, half, i, scaled);
        });
        const glm::vec3 alpha(ratio(rr, dot(p, product)));
        forEachSide(n, [&](size_t i) {
            z[i] += alpha * p[i];
            r[i] -= alpha * product[i];
        });
        const glm::dvec3 next = dot(r, r);
        const glm::vec3 beta(ratio(next, rr));
        forEachSide(n, [&](size_t i) { p[i] = r[i] + beta * p[i]; });
        rr = next;
    }

    result.isSettled = isSolved || !glm::any(glm::greaterThan(rr, enough()));
    // A solution that is one already stays as it is, to the last bit.
    forEachSide(n, [&](size_t i) {
        reflected[i] = isSolved && share == glm::vec3(1.0f) ? reflected[i] : scale[i] * z[i];
        scaled[i] = padded(x[i] * reflected[i]);
    });
    forEachSide(n, [&](size_t i) {
        if (isSolved)
            brought[i] *= share;
        else if (half != Half::BOTH && glm::all(glm::greaterThan(lineScale[i], glm::vec3(0.0f))))
            brought[i] = (z[i] - rightSide[i] + r[i]) / lineScale[i];
        else
            brought[i] = rowTimes(counts, half, i, scaled);
        result.indirect[i] = first.indirect[i];
        if (m[i] > 0) result.indirect[i] += x[i] * brought[i] / m[i];
        if (!known.empty()) result.indirect[i] += known[i];
    });
    return result;
}

void LineReuse::addPower(const Field& light, const std::vector<float>& exposed,
                         glm::dvec3& power) const {
    for (size_t i = 0; i < light.size(); ++i)
        power += double(patches.area[i / 2] * exposed[i]) * glm::dvec3(light[i]);
}

size_t LineReuse::gatherStarvedSides(const Visibility& visibility, const Clusters* clusters,
                                     float touchDistance, uint32_t minLines, uint32_t seed,
                                     const std::vector<bool>& wanted, const Field& reflected,
                                     Irradiance& irradiance) const {
    auto linesAt = [&](uint32_t side) { return float(counts.linesMet(side)); };
    // In hand: the starved sides that are wanted, later those that their rays meet too.
    std::vector<uint32_t> starved;
    std::vector<bool> isOther(counts.sideCount());  // starved, not in hand yet
    for (uint32_t i = 0; i < counts.sideCount(); ++i) {
        throwIfCancelledAt(i);
        // The patches of a cut tile do with the lines of the tile.
        const uint32_t enough = std::max(1u, minLines >> (2 * patches.level(i / 2)));
        const bool isStarved = counts.linesMetInAll(i) < enough;
        if (isStarved && wanted[i])
            starved.push_back(i);
        else
            isOther[i] = isStarved;
    }
    const size_t rays =
        starved.empty() ? 0
                        : std::clamp(kMostLocalRays / starved.size(), kFewLocalRays, kLocalRays);

    const Patches& surface = clusters ? clusters->members() : patches;
    // Trace local rays and add up their direct light. The lines that the side has are
    // cosine-distributed too: weigh all alike.
    constexpr uint32_t kNone = UINT32_MAX;
    const glm::vec3 worldExitance = glm::pi<float>() * worldRadiance;
    const std::vector<float> exposed = exposedShare();
    const HandOver shotLight = handOver(patches, shot, exposed);
    std::vector<uint32_t> hits;
    std::vector<float> weights;  // of what lines and rays bring: the number of both
    Field known;  // indirect irradiance times the lines, and what rays brought by direction
    for (size_t first = 0; first < starved.size();) {
        const size_t last = starved.size();
        hits.resize(last * rays, kNone);
        weights.resize(last);
        known.resize(last);
        parallelFor(first, last, [&](size_t k) {
            const uint32_t side = starved[k];
            const SobolPoints points(hash(seed, side));
            const float m = linesAt(side);
            glm::vec3 direct(0.0f), byDirection(0.0f);
            weights[k] = m;
            for (size_t i = 0; i < rays; ++i) {
                const glm::vec4 u = points[uint32_t(i)];
                const uint32_t from = clusters ? clusters->memberOf(side, uint32_t(i)) : side;
                const glm::vec3 direction = cosineDirection(surface.normal(from), {u.z, u.w});
                float distance = 0;
                auto hit = visibility.firstHit(from, surface.point(from / 2, {u.x, u.y}), direction,
                                               &distance);
                if (hit && isCovered(surface, from, *hit, direction, distance, touchDistance))
                    continue;
                if (hit && clusters) hit = clusters->sideOf(*hit);
                if (hit) hits[k * rays + i] = *hit;
                if (hit && !directedLight.isNone(*hit) && exposed[*hit] > 0)
                    byDirection += directedLight.towards(*hit, -direction) / exposed[*hit];
                if (hit && irradiance.scattered && !irradiance.scattered->isNone(*hit))
                    byDirection += irradiance.scattered->towards(*hit, -direction);
                direct += hit ? shot.emission[*hit] : worldExitance;
                ++weights[k];
            }
            if (weights[k] == 0) return;
            const glm::vec3 fromSources = shotLight.gathered[side];
            const glm::vec3 lineDirect = irradiance.direct[side] - fromSources;
            irradiance.direct[side] = fromSources + (m * lineDirect + direct) / weights[k];
            known[k] = m * (irradiance.indirect[side] - shotLight.indirect[side]) + byDirection;
        });
        for (size_t k = first * rays; k < last * rays; ++k)
            if (hits[k] != kNone && isOther[hits[k]]) {
                isOther[hits[k]] = false;
                starved.push_back(hits[k]);
            }
        first = last;
    }

    // Starved sides may see each other: sweep until their reflected light has settled.
    Field sent = reflected, next(starved.size());
    if (!patches.translucence.empty())
        for (size_t i = 0; i < sent.size(); ++i)
            sent[i] += passedOn(patches, exposed, i, irradiance.all(i ^ 1));
    for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
        parallelFor(size_t(0), starved.size(), [&](size_t k) {
            const uint32_t side = starved[k];
            glm::vec3 sum = known[k];
            for (size_t i = 0; i < rays; ++i)
                if (const uint32_t hit = hits[k * rays + i]; hit != kNone) sum += sent[hit];
            const glm::vec3 arriving = weights[k] > 0 ? sum / weights[k] : glm::vec3(0.0f);
            irradiance.indirect[side] = shotLight.indirect[side] + arriving;
            next[k] = shotLight.unshot[side] +
                      patches.reflectance[side] *
                          (irradiance.direct[side] - shotLight.gathered[side] + arriving);
        });
        glm::vec3 change(0.0f), most(0.0f);
        for (size_t k = 0; k < starved.size(); ++k) {
            next[k] += passedOn(patches, exposed, starved[k], irradiance.all(starved[k] ^ 1));
            change = glm::max(change, glm::abs(next[k] - sent[starved[k]]));
            most = glm::max(most, next[k]);
            sent[starved[k]] = next[k];
        }
        if (glm::all(glm::lessThanEqual(change, kSettled * most))) break;
    }
    return starved.size();
}

}  // namespace raybundle
