// SPDX-License-Identifier: GPL-3.0-or-later
//
// Decides whether stochastic iteration by bundles converges in the mean square.
//
// A bundle gives a side w times the light that it gives on average, with w = 2 s^2 m / A for m
// lines on the area A. The moments of w are E[w] = 1 and E[w^2] = g. On a side that is large beside
// a pixel, w = 2 cos(theta) and g = 4/3. A side that is smaller than a pixel gets one line with the
// probability A cos(theta) / s^2, so that g = 2 s^2 / A. The root of the sum of the squares of both
// values is used for all sizes. It is between 2 % below and 13 % above what counting gives for
// squares of all sizes, and at most 7 % below for rectangles four times as long as wide.
//
// The mean squares u of the deviations of the iterates then obey
//   u_i <= rho_i^2 g_i sum_j F_ij u_j + const
// and stay finite if the spectral radius of diag(rho^2 g) F is below 1. Where all sides see each
// other equally, this radius is the mean of rho^2 g by area. A few small patches then do no harm,
// apart from their own variance. Where patches of one kind see only each other, the radius is the
// largest value of rho^2 g. Sides are therefore sorted into classes of about equal rho^2 g, and the
// form factors between the classes are counted along the given bundles. A class with less than
// kLeastShare of the lines joins the next lower class, because rarer events hardly happen twice in
// a row within the bundles of a bake.
//
// Source: Szirmay-Kalos, "Stochastic Iteration for Non-diffuse Global Illumination" (1999), which
// requires the random operator to be a contraction. Thesis section 2.6 does not mention this.
#include <algorithm>
#include <array>
#include <cmath>

#include "transport/local_rays.h"
#include "transport/stochastic_iteration.h"

namespace raybundle {
namespace {

constexpr int kClasses = 64;
constexpr double kClassesPerOctave = 2, kLowestOctave = -12;
constexpr double kLeastShare = 0.01;
constexpr int kMaxSweeps = 64;
constexpr int kPowerSteps = 256;

// Returns rho^2 g of a side.
double gain(const TransportInput& input, uint32_t side) {
    const double rho = double(LocalRays::reflectance(input.patches, side));
    const double area = input.exposedArea(side) / input.tracer.pixelArea;
    return area > 0 ? rho * rho * std::hypot(4.0 / 3, 2 / area) : 0;
}

// Returns the class of a value of rho^2 g.
int classOf(double gain) {
    const double octave = std::log2(std::max(gain, 1e-9)) - kLowestOctave;
    return std::clamp(int(kClassesPerOctave * octave), 0, kClasses - 1);
}

// Returns per side whether light can reach it along the given lines. Dark sides do not affect the
// convergence.
std::vector<bool> litSides(const TransportInput& input, const std::vector<TracedBundle>& traced) {
    const Patches& patches = input.patches;
    const HandOver first = handOver(input, input.shot);
    const glm::vec3 black(0.0f);
    std::vector<bool> shines(patches.sideCount()), lit(patches.sideCount());
    for (size_t i = 0; i < lit.size(); ++i)
        lit[i] = shines[i] = input.shot.emission[i] != black || first.unshot[i] != black;
    auto light = [&](uint32_t side) {
        lit[side] = true;
        shines[side] = shines[side] || patches.reflectance[side] != black;
    };
    if (input.worldRadiance != black)
        for (const TracedBundle& t : traced)
            for (uint32_t side : t.lines.sky) light(side);
    bool changed = true;
    for (int sweep = 0; changed && sweep < kMaxSweeps; ++sweep) {
        changed = false;
        for (const TracedBundle& t : traced)
            for (const Exchange& e : t.lines.exchanges) {
                if (shines[e.i] && !lit[e.j]) light(e.j), changed = true;
                if (shines[e.j] && !lit[e.i]) light(e.i), changed = true;
            }
    }
    return lit;
}

}  // namespace

double largestReflectance(const Patches& patches) {
    float most = 0;
    for (uint32_t side = 0; side < patches.sideCount(); ++side)
        most = std::max(most, LocalRays::reflectance(patches, side));
    return double(most);
}

uint32_t warmUpIterates(double reflectance, double missing, uint32_t most) {
    if (reflectance <= 0) return 0;
    return uint32_t(std::min(double(most), std::ceil(std::log(missing) / std::log(reflectance))));
}

double meanSquareGrowth(const TransportInput& input, const std::vector<TracedBundle>& traced) {
    const std::vector<bool> lit = litSides(input, traced);
    // Per class: number of lines of its sides, and the sum of rho^2 g over these lines.
    std::array<double, kClasses> lines{}, gains{};
    std::array<std::array<double, kClasses>, kClasses> between{};
    auto add = [&](uint32_t side, double count) {
        const double g = gain(input, side);
        lines[size_t(classOf(g))] += count;
        gains[size_t(classOf(g))] += count * g;
    };
    for (const TracedBundle& t : traced) {
        for (uint32_t side : t.lines.sky)
            if (lit[side]) add(side, 1);
        for (const Exchange& e : t.lines.exchanges) {
            if (!lit[e.i] && !lit[e.j]) continue;
            const size_t a = size_t(classOf(gain(input, e.i)));
            const size_t b = size_t(classOf(gain(input, e.j)));
            add(e.i, e.lines);
            add(e.j, e.lines);
            between[a][b] += e.lines;
            between[b][a] += e.lines;
        }
    }

    // Join rare classes with the next lower one, from the top.
    double all = 0;
    for (double count : lines) all += count;
    std::array<size_t, kClasses> group;
    size_t groups = 0;
    double share = 0;
    for (size_t k = kClasses; k-- > 0;) {
        group[k] = groups;
        share += lines[k];
        if (share > 0 && share >= kLeastShare * all) {
            ++groups;
            share = 0;
        }
    }
    std::array<double, kClasses + 1> groupLines{}, groupGains{};
    std::array<std::array<double, kClasses + 1>, kClasses + 1> growth{};
    for (size_t a = 0; a < kClasses; ++a) {
        groupLines[group[a]] += lines[a];
        groupGains[group[a]] += gains[a];
        for (size_t b = 0; b < kClasses; ++b) growth[group[a]][group[b]] += between[a][b];
    }
    for (size_t a = 0; a <= groups; ++a)
        for (size_t b = 0; b <= groups; ++b)
            if (groupLines[a] > 0) growth[a][b] *= groupGains[a] / (groupLines[a] * groupLines[a]);

    // Compute the spectral radius by the power method. The shift keeps it from oscillating.
    std::array<double, kClasses + 1> u;
    u.fill(1);
    double radius = 0;
    for (int step = 0; step < kPowerSteps; ++step) {
        std::array<double, kClasses + 1> next{};
        for (size_t a = 0; a <= groups; ++a) {
            for (size_t b = 0; b <= groups; ++b) next[a] += growth[a][b] * u[b];
            next[a] += radius * u[a];
        }
        const double largest = *std::max_element(next.begin(), next.end());
        if (!(largest > 0)) return 0;
        for (double& x : next) x /= largest;
        u = next;
        radius = largest - radius;
    }
    return radius;
}

}  // namespace raybundle
