// SPDX-License-Identifier: GPL-3.0-or-later
//
// The iteration of bundles and solves. It ends when the difference between the estimates of the two
// halves of the bundles shows that the noise is at its target, in the light of all sources and in
// the light of each light set.
//
// Source: thesis section 4.3.3 (stop by a stated error).
// Differs: see bake/stop_rule.h, stated_error/noise.h and stated_error/noisy_parts.h.
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

// The input of a solve: the input of every stage, and the tiles and the shown light of its patches.
// All references must outlive it.
struct SolveInput : StageInput {
    const Tiles& tiles;
    const ShownLight& shown;
};

// Traces bundles and solves for the light until the stop rule ends the iteration.
class BundleSolve {
  public:
    // `lights` and `transports` have one entry for each light set, in the same order. Both must
    // outlive the object. run() writes the solved irradiance to the lights.
    BundleSolve(const SolveInput& input, SetLights& lights, const Transports& transports);

    // Traces and solves until the stop rule ends the iteration. Returns the noise per side of the
    // tiles. Adds the time of both stages, the noise and the warnings about them to the report.
    SideNoise run(Report& report);

  private:
    void trace(Report& report);
    void look();
    void offerHalves();
    Stop stopAfterLook();
    double castRays();
    void finish();
    SideNoise conclude(Stop stop, Report& report);
    double errorOfWrongLines(Report& report) const;
    std::vector<LightOfHalves> seen() const;
    void measureCorners(const SetNoise& look, const LightOfHalves& halvesSeen);

    const SolveInput in;
    const Patches& patches;
    SetLights& lights;
    const Transports& transports;
    Transport& tracer;  // the first transport, which traces for all

    const std::vector<float> area;  // per side: area if the side has a result, else 0, m^2
    const GatheredNoise gathered;
    std::vector<float> weight;      // per side: exposed part of `area`, m^2
    std::vector<float> tileWeight;  // per side of the tiles: sum of `weight`, m^2
    // Per light and side of the tiles: standard error of the first shot, W/m^2.
    std::vector<std::vector<float>> errorOfSets;
    const SidesOfCells cells;  // of the tiles
    SetNoise noise;
    const std::vector<bool> allGathered;   // per instance, see ShownLight::instancesAllGathered
    const std::vector<double> growth;      // per instance, see cornerGrowth
    ShownNoise shown;                      // at corners, of the last look
    std::optional<NoisyParts> noisyParts;  // empty unless the solver counts lines
    StopRule rule;
    const bool castsRays;
    const bool isDraft;  // whether the mean of the halves will do as the result

    // Per light: the estimates of the two halves of the bundles. It is the light that arrives at
    // sides, not the shown light.
    std::vector<std::array<Irradiance, 2>> halves;
    std::vector<double> errors;  // relative noise: of the sum of all lights, then of each light set
    Report ofFinish;             // notes of the last solve
};

// Computes the result if bundles have no light to carry: the light of the first shot. Nevertheless
// traces some bundles, to find out which sides are covered. Returns the noise per side of the
// tiles. Adds the time and the noise to the report. `exposed` receives per side the share of its
// area that no other surface covers.
SideNoise keepFirstShot(const SolveInput& input, SetLights& lights, std::vector<float>& exposed,
                        Report& report);

}  // namespace raybundle
