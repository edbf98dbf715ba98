// SPDX-License-Identifier: GPL-3.0-or-later
//
// Transports move light between patch sides after the first shot. Each transport (the setting
// `solver`) has its own source file and a row of the table in transport.cpp.
//
// A transport runs two independent estimates, one on each half of the bundles. The difference of
// the two estimates measures the noise, and their mean is the result.
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

// Irradiance of patch sides, W/m^2, in a direct and an indirect part. The first three vectors have
// one entry per side.
struct Irradiance {
    explicit Irradiance(size_t sides = 0) : direct(sides), ofSources(sides), indirect(sides) {}

    std::vector<glm::vec3> direct;     // light straight from sources, emission and the world
    std::vector<glm::vec3> ofSources;  // the part of `direct` from the sources of the first shot
    std::vector<glm::vec3> indirect;   // light that was reflected at least once
    // Per side, exitance in W/m^2 to add to reflectance times irradiance, because light along lines
    // arrives at angles at which the side reflects more (positive) or less (negative) than it
    // reflects of light from all directions. Empty if no side has this dependence.
    std::vector<glm::vec3> byAngle;
    // How the exitance by reflected light depends on the direction on surfaces that are not
    // Lambert's. Null if it does not depend on the direction.
    std::shared_ptr<const ScatteredLight> scattered;
    // Power that arrives on surfaces because light does not leave other surfaces by Lambert's law,
    // W. If all surfaces were Lambert's, this power would leave the scene.
    glm::dvec3 redirected{0.0};
    // Whether all solves that gave this light reached their tolerance.
    bool isSettled = true;

    // Returns the direct plus the indirect irradiance of a side, W/m^2.
    glm::vec3 all(size_t side) const { return direct[side] + indirect[side]; }
    // Returns the same of all sides.
    std::vector<glm::vec3> all() const;
    // Adds the light of another estimate of the same sides. Leaves `byAngle` and `scattered` as
    // they are.
    void add(const Irradiance& other) {
        for (size_t side = 0; side < direct.size(); ++side) {
            direct[side] += other.direct[side];
            ofSources[side] += other.ofSources[side];
            indirect[side] += other.indirect[side];
        }
        redirected += other.redirected;
        isSettled = isSettled && other.isSettled;
    }
};

struct KeptLines;

// The half of the bundles that an estimate uses, or both halves.
enum class Half { FIRST = 0, SECOND = 1, BOTH = 2 };

// Weights of lines, so that no power is lost between patches. A line between the sides i and j
// counts x_i x_j times, and a line from side i to the sky counts x_i times. m_i is the number of
// lines of side i that results. Both vectors are per side.
struct LineWeights {
    std::vector<float> x, m;
};

// A solution of LINE_REUSE on the lines of one half of the bundles, or of both. Later solves start
// from it. It may belong to fewer bundles than are traced now, and in the first solve of a bake
// also to other light.
struct LineSolution {
    // Per side: reflected exitance R, W/m^2, without light that passed through patches.
    std::vector<glm::vec3> reflected;
    // Per side: exitance of light that passed through translucent patches, W/m^2. Empty if not
    // known.
    std::vector<glm::vec3> passed;
    // Per side: the sum over its lines of x_j times `reflected` of the side j at the other end,
    // W/m^2. Empty if not known.
    std::vector<glm::vec3> brought;
    uint32_t bundles = 0;  // number of bundles of the lines; 0 if there is no solution
    // For light by direction in drafts. Null if none were chosen yet for these bundles.
    std::shared_ptr<const KeptLines> lines;
};

// The solutions of LINE_REUSE for the light of one light set, and the weights of the lines.
struct LineSolutions {
    explicit LineSolutions(size_t sides = 0) {
        for (LineSolution& solution : of) solution.reflected.resize(sides);
    }

    LineSolution of[3];   // indexed by Half
    LineWeights weights;  // for Half::BOTH
};

// The input of a transport. All references must outlive the transport.
struct TransportInput : LitSurfaces {
    const Visibility& visibility;
    const FirstShot& shot;
    const glm::vec3 worldRadiance;  // W/(m^2 sr)
    const Settings& settings;
    BundleTracer& tracer;
    // The counts of all bundles traced so far. Only LINE_REUSE adds to them.
    LineCounts& counts;
    // The solutions for the light of this light set, per side of `patches`. LINE_REUSE starts
    // from them and overwrites them. Null if they are not kept beyond the transport.
    LineSolutions* solutions = nullptr;
    // Per side: whether its light is shown in the result. Light that is not shown only lights other
    // surfaces. Null: the light of all sides is shown.
    const std::vector<bool>* isShown = nullptr;
    // The clusters between which LINE_REUSE exchanges light. Null: each patch exchanges light by
    // itself. `visibility` is always of clusters->members(). `patches` are clusters->members() for
    // lineReuseOfClusters() and makeTransports(), and clusters->patches() for lineReuseOfMany().
    const Clusters* clusters = nullptr;
};

// Interface of all transports: an estimate of the irradiance that improves with each bundle.
class Transport {
  public:
    virtual ~Transport() = default;

    // Does the work of the next `count` bundles, and reports the fraction that is done. `count`
    // must be even.
    virtual void advance(uint32_t count, const Progress& progress) = 0;

    // Returns the number of bundles whose work is done.
    virtual uint32_t bundleCount() const = 0;

    // Returns the estimate from a half of the bundles traced so far, or from both. `tolerance` is
    // the relative residual at which a transport that solves a system stops; other transports
    // ignore it.
    virtual Irradiance irradiance(Half half, float tolerance) = 0;

    // Returns the final estimate from all bundles, and adds skipped work and warnings to the
    // report. `wanted` (per side) marks the sides whose light is needed; the estimate may stay
    // rough on others.
    virtual Irradiance finish(float tolerance, const std::vector<bool>& /*wanted*/,
                              Report& /*report*/) {
        return irradiance(Half::BOTH, tolerance);
    }

    // Returns the relative error that is common to both halves, and so does not show in their
    // difference.
    virtual double bias() const { return 0; }

    // Returns for each side the share of its lines that leave the scene. If no line met a side, the
    // value depends on the transport. It is 0 if the power that the side should receive went to the
    // sides that lines met. It is below 0 if each side that lines met received only the power for
    // its own area, so that nothing is known of this side.
    virtual std::vector<float> openShare() const = 0;
};

// Computes the result of Transport::openShare: skyLines(side) / lines(side) for each side, and 0
// where lines(side) is 0.
template <class Lines, class SkyLines>
std::vector<float> openShareOf(size_t sides, const Lines& lines, const SkyLines& skyLines) {
    std::vector<float> share(sides, 0.0f);
    for (size_t side = 0; side < sides; ++side)
        if (const double met = double(lines(side)); met > 0)
            share[side] = float(double(skyLines(side)) / met);
    return share;
}

// The light of a first shot that a transport starts with, per side and relative to the exposed part
// of the side, W/m^2.
struct HandOver {
    std::vector<glm::vec3> ofSources;  // direct irradiance
    std::vector<glm::vec3> indirect;   // irradiance by reflected light, already distributed
    std::vector<glm::vec3> unshot;     // reflected exitance that is still to be distributed
};
// Returns the light of a first shot, converted from whole sides to their exposed parts.
HandOver handOver(const LitSurfaces& surfaces, const FirstShot& shot);

// Returns the transport of solver LINE_REUSE.
std::unique_ptr<Transport> lineReuse(const TransportInput& input);
// One transport for each input, in the order of the inputs.
using Transports = std::vector<std::unique_ptr<Transport>>;
// Returns transports of solver LINE_REUSE for inputs that differ only in their light. The first
// transport traces and counts the lines for all of them, and its advance() advances them all. The
// others must not advance by themselves.
Transports lineReuseOfMany(const std::vector<TransportInput>& inputs);
// Returns transports like lineReuseOfMany(), which exchange light between clusters. All input and
// output is per side of the patches of which the clusters consist, except `solutions` and `counts`,
// which are per side of the clusters.
Transports lineReuseOfClusters(const std::vector<TransportInput>& inputs);
// Return the transports of the other solvers. stochasticIteration throws Error(INVALID_ARGUMENT) if
// it would not converge on this scene.
std::unique_ptr<Transport> multipath(const TransportInput& input);
std::unique_ptr<Transport> stochasticIteration(const TransportInput& input);
std::unique_ptr<Transport> randomWalk(const TransportInput& input);

// Returns the transport of a solver. Throws Error(INVALID_ARGUMENT) if it would not converge on
// this scene.
std::unique_ptr<Transport> makeTransport(Solver solver, const TransportInput& input);

// Returns one transport per input, for inputs that differ only in their light and share their
// lines. advance() of the first transport advances all. More than one input, or clusters, require
// solver LINE_REUSE: no other transport sends several lights along the lines of one trace. Throws
// like makeTransport().
Transports makeTransports(Solver solver, const std::vector<TransportInput>& inputs);

}  // namespace raybundle
