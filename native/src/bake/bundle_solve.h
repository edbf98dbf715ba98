// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bundles and solves in turns, until the difference of the two halves' estimates says that the
// noise is at its target, in the light of all sources and in that of each light set.
//
// Source: thesis section 4.3.3 (stop by a stated error). Differs: bake/stop_rule.h,
// stated_error/noise.h, stated_error/noisy_parts.h.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "bake/stop_rule.h"
#include "bake/trace.h"
#include "job/report.h"
#include "patches/tiles.h"
#include "reconstruction/shown_light.h"
#include "stated_error/gathered_noise.h"
#include "stated_error/noise.h"
#include "stated_error/noisy_parts.h"
#include "transport/set_light.h"
#include "transport/transport.h"

namespace raybundle {

// What a solve works on: what every stage does, and the tiles and the shown light of its patches.
// All references must outlive it.
struct SolveInput : StageInput {
    const Tiles& tiles;
    const ShownLight& shown;
};

class BundleSolve {
  public:
    // lights, transports: of each light set, in the same order; run() leaves the solved irradiance
    // in the lights. Both must outlive the object.
    BundleSolve(const SolveInput& input, SetLights& lights, const Transports& transports);

    // Traces, solves and looks until the stop rule says enough. Adds the time of both stages, the
    // noise, and what is to be said of them to the report.
    SideNoise run(Report& report);

  private:
    using Halves = std::vector<std::array<Irradiance, 2>>;  // of each light

    void trace(Report& report);
    void look();
    Stop stopAfterLook();
    double castRays();
    void finish();
    SideNoise conclude(Stop stop, Report& report);
    double errorOfWrongLines(Report& report) const;
    Halves seen() const;
    void measureCorners(const SetNoise& look, const Halves& halvesSeen);

    const SolveInput in;
    const Patches& patches;
    SetLights& lights;
    const Transports& transports;
    Transport& tracer;  // the transport that traces for all

    const std::vector<float> area;  // per side: of those that have a result, m^2
    const GatheredNoise gathered;
    std::vector<float> weight;                    // per side: the exposed part of that area, m^2
    std::vector<float> tileWeight;                // the same, per side of the tiles
    std::vector<std::vector<float>> errorOfSets;  // of the first shot, per light and side of tiles
    SetNoise noise;
    const std::vector<double> growth;      // per instance, see cornerGrowth
    std::vector<double> overForetold;      // per instance, see shownOverForetold
    std::optional<NoisyParts> noisyParts;  // of solvers that count the lines that meet each side
    StopRule rule;
    const bool castsRays;

    Halves halves;               // as they arrive
    std::vector<double> errors;  // relative: of the light of all, then of each light set
    Report ofFinish;             // what the last solve says
};

// The result where bundles have nothing to bring: the light of the first shot. Some bundles are
// traced all the same, to tell what is covered. Adds their time and the noise to the report;
// exposed: is given the share of each side that nothing covers.
SideNoise keepFirstShot(const SolveInput& input, SetLights& lights, std::vector<float>& exposed,
                        Report& report);

}  // namespace raybundle
