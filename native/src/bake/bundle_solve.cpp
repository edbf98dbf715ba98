// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/bundle_solve.h"

#include <algorithm>
#include <cmath>

#include "bake/bake_warnings.h"
#include "bake/interim.h"
#include "bake/stopwatch.h"
#include "bundles/line_windows.h"
#include "stated_error/energy_balance.h"
#include "stated_error/object_noise.h"
#include "transport/extra_rays.h"

namespace raybundle {
namespace {

// Relative residual of the last solve: a share of the noise, within these bounds. A relighting
// starts its solves from other values than a new bake. The upper bound keeps its result within 1e-5
// of that of a new bake.
constexpr double kFinalShare = 0.01, kLeastTolerance = 1e-6, kMostTolerance = 1e-5;
// Relative residual of the solves of the halves, in multiples of the target error.
constexpr float kHalfTolerance = 0.05f;
// Largest relative residual of the halves in a draft, of which they are the result.
constexpr float kDraftTolerance = 2e-3f;
// Largest number of rays of a side in the first pass, which doubles with each further pass, and the
// largest number of passes.
constexpr uint32_t kRaysOfFirstPass = 512, kMostPasses = 5;

// Returns the number of faces that bundles have looked at and drawn, if there are windows of finer
// pixels, else 0. Each bundle looks for all sheets and loose parents in its windows, and draws them
// in each window that they lie in.
double facesOfBundles(const Trace& trace) {
    const Sheets& sheets = trace.patches.sheets;
    if (trace.density.windows.empty()) return 0;
    return double(sheets.loose.size() + sheets.sheets.size()) * trace.tracer->bundleCount() +
           double(trace.tracer->drawnCount());
}

// Returns the mean of two estimates of the light.
Irradiance meanOf(const std::array<Irradiance, 2>& halves) {
    Irradiance mean = halves[0];
    mean.add(halves[1]);
    for (auto* light : {&mean.direct, &mean.ofSources, &mean.indirect})
        for (glm::vec3& value : *light) value *= 0.5f;
    return mean;
}

}  // namespace

BundleSolve::BundleSolve(const SolveInput& input, SetLights& lights, const Transports& transports)
    : in(input),
      patches(input.trace.patches),
      lights(lights),
      transports(transports),
      tracer(*transports.front()),
      area(input.shown.resultArea()),
      gathered(patches, input.shown),
      weight(patches.sideCount(), 0),
      tileWeight(input.tiles.sideCount(), 0),
      errorOfSets(gathered.errorsOf(lights, input.tiles)),
      cells(input.tiles.patches()),
      noise(input.trace.looks, errorOfSets, tileWeight, cells),
      allGathered(input.shown.instancesAllGathered()),
      growth(cornerGrowth(input.scene, input.tiles.patches(), allGathered)),
      rule(input.settings, mostBundles(patches, input.trace.density), tracer.bundleCount()),
      // No extra rays if the caller fixes or limits the number of bundles, because the result of
      // these bundles is then wanted.
      castsRays(input.settings.countsLines() && input.settings.skipBundles &&
                input.settings.minBundles < input.settings.maxBundles && !input.settings.draft),
      isDraft(input.settings.draft && input.settings.countsLines()),
      halves(lights.size()) {
    if (input.settings.countsLines())
        noisyParts.emplace(NoisyPartsInput{in.scene, in.tiles, in.trace.looks, in.tiles.sum(area),
                                           in.shown, growth, shown, in.settings.targetError});
}

SideNoise BundleSolve::run(Report& report) {
    Stop stop = Stop::NOT_YET;
    while (stop == Stop::NOT_YET) {
        trace(report);
        Stopwatch stage(report.seconds[RB_STAGE_SOLVE]);
        look();
        stop = stopAfterLook();
    }
    Stopwatch stage(report.seconds[RB_STAGE_SOLVE]);
    return conclude(stop, report);
}

void BundleSolve::trace(Report& report) {
    if (rule.wanted() <= tracer.bundleCount()) return;
    Stopwatch stage(report.seconds[RB_STAGE_BUNDLES]);
    const uint32_t before = tracer.bundleCount();
    const double all = double(rule.foreseen());
    tracer.advance(rule.wanted() - before, in.progress.between(before / all, rule.wanted() / all));
}

// Solves for the light of each half of the bundles, and measures the difference between the halves.
void BundleSolve::look() {
    in.trace.measureExposedShare(uint32_t(in.settings.seed));
    const uint32_t bundles = tracer.bundleCount();
    in.progress.report(RB_STAGE_SOLVE, 0);
    const std::vector<float> exposed = in.trace.exposedShare();
    for (size_t side = 0; side < weight.size(); ++side) weight[side] = area[side] * exposed[side];
    throwIfCancelled();
    tileWeight = in.tiles.sum(weight);
    float tolerance = kHalfTolerance * float(in.settings.targetError);
    if (isDraft) tolerance = std::min(tolerance, kDraftTolerance);
    for (size_t k = 0; k < lights.size(); ++k)
        for (size_t h = 0; h < 2; ++h) halves[k][h] = transports[k]->irradiance(Half(h), tolerance);
    const std::vector<LightOfHalves> now = seen();
    noise.look(now, bundles, tracer.bias());
    measureCorners(noise, now.front());
    errors = noise.relative();
    in.trace.looks = noise.looks();
    throwIfCancelled();
    if (!noisyParts) return;
    noisyParts->look(noise, bundles, in.tiles.sum(in.trace.linesMet()), in.trace.linesMetByAll(),
                     facesOfBundles(in.trace));
    in.trace.looks.shareOfParts = noisyParts->shares();
}

// Offers the mean of the halves as interim light.
void BundleSolve::offerHalves() {
    if (!in.interim) return;
    in.interim->setNoise(rule.excess() * double(in.settings.targetError));
    if (!in.interim->wantsLight()) return;
    for (size_t k = 0; k < lights.size(); ++k) lights[k].irradiance = meanOf(halves[k]);
    offerLight(in, in.shown, lights, in.trace.exposedShare());
}

Stop BundleSolve::stopAfterLook() {
    const uint32_t bundles = tracer.bundleCount();
    const Stop stop = rule.after(
        bundles, noisyParts ? noisyParts->excess() : noise.excess(in.settings.targetError));
    offerHalves();
    if (stop == Stop::NOT_YET) return stop;
    finish();
    return castsRays && stop == Stop::NOISE_AT_TARGET ? rule.afterRays(bundles, castRays()) : stop;
}

// Makes the last solve, with all bundles traced so far. A draft makes do with those of the halves.
void BundleSolve::finish() {
    ofFinish = Report();
    if (isDraft) {
        for (size_t k = 0; k < lights.size(); ++k) lights[k].irradiance = meanOf(halves[k]);
        return;
    }
    const float tolerance =
        float(std::clamp(kFinalShare * errors.front(), kLeastTolerance, kMostTolerance));
    for (size_t k = 0; k < lights.size(); ++k) {
        Report unsaid;  // dropped: its notes on the lines repeat those of the first light
        lights[k].irradiance =
            transports[k]->finish(tolerance, in.shown.sides(), k == 0 ? ofFinish : unsaid);
    }
}

// Casts local rays from noisy sides, and more of them as long as they reduce the noise. Returns the
// noise that remains, see NoisyParts::lookWithRays.
double BundleSolve::castRays() {
    const uint32_t bundles = tracer.bundleCount();
    std::vector<std::array<float, 2>> samples = in.trace.linesByHalf();
    double left = 0;
    for (uint32_t pass = 0; pass < kMostPasses; ++pass) {
        const std::vector<ExtraRays> rays = noisyParts->rays(samples, kRaysOfFirstPass << pass);
        if (pass == 0) ofFinish.skip(SkippedWork::RAYED_SIDES, rays.size());
        if (rays.empty()) break;
        addExtraRays({{patches, in.trace.exposedShare()},
                      in.trace.visibility,
                      rays,
                      hash(uint32_t(in.settings.seed), pass)},
                     samples, lights, halves);
        SetNoise withRays({}, errorOfSets, tileWeight, cells);
        const std::vector<LightOfHalves> withThese = seen();
        withRays.look(withThese, bundles, tracer.bias());
        measureCorners(withRays, withThese.front());
        left = noisyParts->lookWithRays(withRays, kMostPasses - 1 - pass);
        in.progress.report(RB_STAGE_SOLVE, double(pass + 1) / kMostPasses);
        offerLight(in, in.shown, lights, in.trace.exposedShare());
    }
    return left;
}

// Returns per light the light that both halves show, per side of the tiles.
std::vector<LightOfHalves> BundleSolve::seen() const {
    std::vector<LightOfHalves> result(lights.size());
    const std::vector<float> exposed = in.trace.exposedShare();
    for (size_t k = 0; k < lights.size(); ++k) {
        for (size_t h = 0; h < 2; ++h) result[k][h] = in.shown.of(halves[k][h].all(), exposed);
        gathered.apply(result[k], weight);
        for (std::vector<glm::vec3>& half : result[k]) half = in.tiles.mean(half, weight);
    }
    return result;
}

// Measures the noise that corners show. Each look does this anew instead of using the looks of
// earlier bakes, so that equal light gets equal rays whatever was baked before. It is repeated
// after extra rays, because their noise differs in kind from that of lines. A draft, which may take
// hundredths of a second, makes do with the noise that is foretold.
void BundleSolve::measureCorners(const SetNoise& look, const LightOfHalves& halvesSeen) {
    if (isDraft) {
        shown = {std::vector<double>(growth.size(), kUsuallyOverForetold),
                 std::vector<double>(look.ofLights().front().cells().size(), -1)};
        return;
    }
    shown = shownNoise(
        in.scene, {in.tiles.patches(), in.tiles.mean(in.trace.exposedShare(), patches.sideAreas())},
        look.ofLights().front(), halvesSeen, in.settings.regularization, growth, allGathered);
}

// States the noise that remains, and why no bundles were added.
SideNoise BundleSolve::conclude(Stop stop, Report& report) {
    const double target = in.settings.targetError;
    const uint32_t bundles = tracer.bundleCount();
    if (stop != Stop::NOISE_AT_TARGET) {
        const auto worst = std::max_element(errors.begin(), errors.end());
        warnOfMissedTarget(in.scene,
                           {stop, bundles, lights[size_t(worst - errors.begin())].set, *worst,
                            noisyParts ? rule.excess() * target : 0.0, target},
                           report);
    }
    report.addNotesOf(std::move(ofFinish));
    if (castsRays) {
        noise.lookAgain(seen());
        errors = noise.relative();
    }
    CornerNoise corners = noiseAtCorners(in.scene, in.tiles.patches(), noise.ofLights().front(),
                                         growth, shown.overForetold);
    const bool isBelow =
        *std::max_element(errors.begin(), errors.end()) <= target || corners.ofAll <= target;
    if (stop == Stop::NOISE_AT_TARGET && isBelow)
        report.skip(SkippedWork::REACHED_TARGET, rule.most() - std::min(rule.most(), bundles));
    else if (stop == Stop::NOISE_AT_TARGET)
        warnOfDirectNoise(in.scene, patches, lights, area, corners.ofAll, target, report);
    const double wrong = errorOfWrongLines(report);
    for (double& e : errors) e = std::hypot(e, wrong);
    report.estimatedError = errors.front();
    report.error.noise = std::hypot(corners.ofAll, wrong);
    for (size_t set = 0; set < report.lightSets.size(); ++set)
        report.lightSets[set].estimatedError = errors[set + 1];
    in.progress.report(RB_STAGE_SOLVE, 1);
    SideNoise result = noise.perSide();
    result.ofObjects = std::move(corners.ofObjects);
    result.isOutOfReach = stop == Stop::NOISE_AT_TARGET && rule.isOutOfReach();
    return result;
}

// Returns the relative error caused by lines that a projector puts in the wrong order or lets pass
// through surfaces. More bundles do not reduce this error.
double BundleSolve::errorOfWrongLines(Report& report) const {
    warnOfBrokenCycles(in.trace.tracer->cycleCount(), report);
    double share = in.trace.tracer->disorderedShare();
    if (in.settings.smallPatches == SmallPatches::ROULETTE)
        share +=
            leakedShare(in.scene, patches, weight, in.trace.surrounding.open, tracer.openShare());
    if (!(share > 0)) return 0;
    const double error = errorByWrongExchanges(patches, share);
    if (error > double(in.settings.targetError)) warnOfWrongExchanges(share, error, report);
    return error;
}

SideNoise keepFirstShot(const SolveInput& in, SetLights& lights, std::vector<float>& exposed,
                        Report& report) {
    Stopwatch stage(report.seconds[RB_STAGE_BUNDLES]);
    const Patches& patches = in.trace.patches;
    exposed = in.trace.surrounding.exposed;
    if (exposed.empty()) exposed = in.trace.surroundingsOf(in.settings).exposed;
    std::vector<float> weight = in.shown.resultArea();
    for (size_t side = 0; side < weight.size(); ++side) weight[side] *= exposed[side];
    const std::vector<float> tileWeight = in.tiles.sum(weight);
    const GatheredNoise gathered(patches, in.shown);
    std::vector<LightOfHalves> halves;
    for (SetLight& light : lights) {
        HandOver first = handOver({patches, exposed}, light.shot);
        light.irradiance.ofSources = first.ofSources;
        light.irradiance.direct = std::move(first.ofSources);
        light.irradiance.indirect = std::move(first.indirect);
        const std::vector<glm::vec3> mean = in.tiles.mean(light.irradiance.all(), weight);
        halves.push_back({mean, mean});
    }
    const SidesOfCells cells(in.tiles.patches());
    SetNoise noise({}, gathered.errorsOf(lights, in.tiles), tileWeight, cells);
    noise.look(halves, 1, 0);
    const std::vector<double> errors = noise.relative();
    report.estimatedError = errors.front();
    for (size_t set = 0; set < report.lightSets.size(); ++set)
        report.lightSets[set].estimatedError = errors[set + 1];
    const std::vector<double> growth =
        cornerGrowth(in.scene, in.tiles.patches(), in.shown.instancesAllGathered());
    CornerNoise corners =
        noiseAtCorners(in.scene, in.tiles.patches(), noise.ofLights().front(), growth,
                       std::vector<double>(growth.size(), kUsuallyOverForetold));
    report.error.noise = corners.ofAll;
    SideNoise result = noise.perSide();
    result.ofObjects = std::move(corners.ofObjects);
    return result;
}

}  // namespace raybundle
