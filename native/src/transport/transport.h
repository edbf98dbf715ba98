// SPDX-License-Identifier: GPL-3.0-or-later
//
// What moves light between patch sides after the first shot. Each transport is a file of its own
// and a row of the table in transport.cpp.
//
// A transport runs two independent estimates, one on each half of the bundles; their difference is
// the stated error, and their mean the result.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "bundles/bundle_tracer.h"
#include "bundles/line_counts.h"
#include "first_shot/first_shot.h"
#include "job/progress.h"
#include "job/report.h"
#include "job/settings.h"
#include "patches/lit_surfaces.h"
#include "visibility/visibility.h"

namespace raybundle {

class Clusters;
class ScatteredLight;

// Irradiance per side, W/m^2, in two parts.
struct Irradiance {
    explicit Irradiance(size_t sides = 0) : direct(sides), gathered(sides), indirect(sides) {}

    std::vector<glm::vec3> direct;    // straight from sources, emission and world
    std::vector<glm::vec3> gathered;  // part of it: from the sources of the first shot
    std::vector<glm::vec3> indirect;  // after one reflection or more
    // Exitance by indirect light that comes in at angles at which a side reflects more than of
    // light from everywhere, or less; empty: none.
    std::vector<glm::vec3> byAngle;
    // What of reflected light goes where Lambert's surfaces would not send it; null: nothing.
    std::shared_ptr<const ScatteredLight> scattered;
    // Power that arrives and would leave the scene if all surfaces were Lambert's, W.
    glm::dvec3 redirected{0.0};
    bool isSettled = true;  // no more light is to be passed on than the tolerance of the solve

    glm::vec3 all(size_t side) const { return direct[side] + indirect[side]; }
    void add(const Irradiance& other) {
        for (size_t side = 0; side < direct.size(); ++side) {
            direct[side] += other.direct[side];
            gathered[side] += other.gathered[side];
            indirect[side] += other.indirect[side];
        }
        redirected += other.redirected;
        isSettled = isSettled && other.isSettled;
    }
};

// Which bundles an estimate looks at.
enum class Half { FIRST = 0, SECOND = 1, BOTH = 2 };

// The factors x_i of the lines of each side, and how many lines each has with them: m_i.
struct LineWeights {
    std::vector<float> x, m;
};

// What LINE_REUSE found by the lines of a half or of both, for solves to start from: of other light
// too, for the first solve of a bake.
struct LineSolution {
    std::vector<glm::vec3> reflected;  // per side: exitance, W/m^2
    // Likewise, besides: what passed through translucent patches; empty: not known.
    std::vector<glm::vec3> passed;
    // Per side: the sum of `reflected` at the other ends of its lines, each times its factor x_j;
    // empty: not known.
    std::vector<glm::vec3> brought;
    uint32_t bundles = 0;  // that it is of; 0: of none
};

struct LineSolutions {
    explicit LineSolutions(size_t sides = 0) {
        for (LineSolution& solution : of) solution.reflected.resize(sides);
    }

    LineSolution of[3];   // by Half
    LineWeights weights;  // for both
};

// What transports are made of. References must outlive them.
struct TransportInput : LitSurfaces {
    const Visibility& visibility;
    const FirstShot& shot;
    const glm::vec3 worldRadiance;  // W/(m^2 sr)
    const Settings& settings;
    BundleTracer& tracer;
    LineCounts& counts;  // of the bundles traced so far; LINE_REUSE alone adds to it
    // Of the light of the same set, per side of these patches; null: none are kept.
    LineSolutions* solutions = nullptr;
    // Per side: whether its light is shown, and not only that of what it lights; null: all is.
    const std::vector<bool>* isShown = nullptr;
    // Between which LINE_REUSE exchanges light: `patches` are theirs, and `visibility` is of those
    // that they are made of. Null: each patch exchanges light by itself.
    const Clusters* clusters = nullptr;
};

class Transport {
  public:
    virtual ~Transport() = default;

    // Does the work of the next `count` bundles (even). Reports the share that is done.
    virtual void advance(uint32_t count, const Progress& progress) = 0;

    // Bundles whose work is done.
    virtual uint32_t bundleCount() const = 0;

    // The estimate so far, solved to a relative `tolerance` where there is something to solve.
    virtual Irradiance irradiance(Half half, float tolerance) = 0;

    // The last estimate of all; sides that are not `wanted` may stay rough.
    virtual Irradiance finish(float tolerance, const std::vector<bool>& /*wanted*/,
                              Report& /*report*/) {
        return irradiance(Half::BOTH, tolerance);
    }

    // Relative error that both halves have alike, so that their difference does not show it.
    virtual double bias() const { return 0; }

    // Per side: the share of the lines from it that leave the scene. Where none met it 0, if the
    // power that it would get went to those that lines met; below 0 if each of these has that of
    // its own area alone, and nothing is known of this one's.
    virtual std::vector<float> openShare() const = 0;
};

// For Transport::openShare: per side, skyLines(side) / lines(side); 0 where no line met it.
template <class Lines, class SkyLines>
std::vector<float> openShareOf(size_t sides, const Lines& lines, const SkyLines& skyLines) {
    std::vector<float> share(sides, 0.0f);
    for (size_t side = 0; side < sides; ++side)
        if (const double met = double(lines(side)); met > 0)
            share[side] = float(double(skyLines(side)) / met);
    return share;
}

// The first shot's light at the exposed part of each side, W/m^2.
struct HandOver {
    std::vector<glm::vec3> gathered;  // direct irradiance
    std::vector<glm::vec3> indirect;  // irradiance from reflected light, already distributed
    std::vector<glm::vec3> unshot;    // reflected exitance that is still to be distributed
};
HandOver handOver(const LitSurfaces& surfaces, const FirstShot& shot);

// The transports, one a row of the table.
std::unique_ptr<Transport> lineReuse(const TransportInput& input);
// One for each input, which differ in their light alone: the first traces and counts the lines for
// all of them, and advances them with it.
using Transports = std::vector<std::unique_ptr<Transport>>;
Transports lineReuseOfMany(const std::vector<TransportInput>& inputs);
// The same between clusters: all that goes in and comes out is per side of the patches that they
// are made of, but for the solutions.
Transports lineReuseOfClusters(const std::vector<TransportInput>& inputs);
std::unique_ptr<Transport> multipath(const TransportInput& input);
std::unique_ptr<Transport> stochasticIteration(const TransportInput& input);
std::unique_ptr<Transport> randomWalk(const TransportInput& input);

// The transport of a solver. Throws Error(INVALID_ARGUMENT) if it would not converge on this scene.
std::unique_ptr<Transport> makeTransport(Solver solver, const TransportInput& input);

// The same for several lights on the same lines; the first advances all. More than one is for
// LINE_REUSE alone: no other transport sends two lights along the lines of one trace.
Transports makeTransports(Solver solver, const std::vector<TransportInput>& inputs);

}  // namespace raybundle
