// SPDX-License-Identifier: GPL-3.0-or-later
//
// The bake on one page: patches, first shot, bundles, solve, reconstruction.
// Sources: the two-step structure is that of thesis section 5.2 (first shot, then bundles); the
// stop criterion stands for section 4.3.3. Differs: see the heads of the stages' files.
#include "bake/bake.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>

#include "bake/bake_warnings.h"
#include "bake/geometry_hash.h"
#include "bake/light_hash.h"
#include "bake/trace.h"
#include "first_shot/bright_spots.h"
#include "job/cancellation.h"
#include "job/combination.h"
#include "job/threads.h"
#include "patches/reflectance.h"
#include "reconstruction/corner_gather.h"
#include "reconstruction/left_out_corners.h"
#include "reconstruction/reconstruction.h"
#include "reconstruction/shown_light.h"
#include "refinement/contacts.h"
#include "refinement/refinement.h"
#include "sampling/sobol.h"
#include "stated_error/energy_balance.h"
#include "stated_error/gathered_noise.h"
#include "stated_error/noisy_parts.h"
#include "stated_error/object_noise.h"
#include "stated_error/stated_error.h"
#include "transport/extra_rays.h"
#include "transport/set_light.h"
#include "visibility/embree_device.h"

namespace raybundle {
namespace {

// Relative residual of the last solve: a share of the noise, within these bounds. The upper one
// keeps a relit bake, whose solves start elsewhere, within 1e-5 of a new one.
constexpr double kFinalShare = 0.01, kLeastTolerance = 1e-6, kMostTolerance = 1e-5;
// So many times the bundles are too many to be foretold.
constexpr double kFarAway = 2.5;
constexpr float kHalfTolerance = 0.05f;  // of the halves' solves, times the target error
// So many times the target may be left where sides cast rays: else what these met is too noisy, and
// more bundles are worth their time as long as they take it down to this share of what it was. If
// so many times the target are left at first, as between the books of a shelf, that would take
// dozens of times the bundles, and all rays again with each doubling.
constexpr double kLeftWithRays = 2, kWorthMore = 0.75, kOutOfReach = 12;

// Rays of a side in the first pass, which each further pass may double.
constexpr uint32_t kRaysOfFirstPass = 512, kMostPasses = 5;

class Stopwatch {
  public:
    explicit Stopwatch(double& seconds) : seconds(seconds), start(Clock::now()) {}
    ~Stopwatch() { seconds += std::chrono::duration<double>(Clock::now() - start).count(); }

  private:
    using Clock = std::chrono::steady_clock;
    double& seconds;
    const Clock::time_point start;
};

// Per side, m^2. exposed: the share of each that nothing covers; empty: all.
std::vector<float> exposedArea(const Patches& patches, const std::vector<float>& exposed) {
    std::vector<float> result(patches.sideCount());
    for (size_t side = 0; side < result.size(); ++side)
        result[side] = patches.area[side / 2] * (exposed.empty() ? 1.0f : exposed[side]);
    return result;
}

// From patch sides to those of tiles. weight: per patch side.
Irradiance meanOver(const Tiles& tiles, const Irradiance& light, const std::vector<float>& weight) {
    Irradiance result;
    result.direct = tiles.mean(light.direct, weight);
    result.gathered = tiles.mean(light.gathered, weight);
    result.indirect = tiles.mean(light.indirect, weight);
    return result;
}

// Per side, m^2: the whole area of those that have a result, else 0.
std::vector<float> wantedArea(const Patches& patches, const ShownLight& shown) {
    std::vector<float> area(patches.sideCount());
    for (size_t side = 0; side < area.size(); ++side)
        area[side] = shown.isResult(side) ? patches.area[side / 2] : 0.0f;
    return area;
}

// Whether no light is left after the first shot: nothing reflects it, and lines bring none of the
// world's or of dim emission.
bool isFirstShotAll(const Patches& patches, const SetLights& lights) {
    auto isBlack = [](const glm::vec3& v) { return v == glm::vec3(0.0f); };
    auto areBlack = [&](const std::vector<glm::vec3>& values) {
        return std::all_of(values.begin(), values.end(), isBlack);
    };
    return areBlack(patches.reflectance) && areBlack(patches.translucence) &&
           std::all_of(lights.begin(), lights.end(), [&](const SetLight& light) {
               return areBlack(light.shot.emission) && isBlack(light.worldRadiance);
           });
}

// Whether no light reaches any surface; says so, also of single light sets.
bool isDark(const Scene& scene, const SetLights& lights, Report& report) {
    const bool isEmpty = lights.front().shot.irradiance.empty();
    const bool isDark = std::all_of(lights.begin(), lights.end(),
                                    [](const SetLight& light) { return light.isDark(); });
    for (const SetLight& light : lights)
        if (light.set != kNoLightSet && light.isDark())
            report.warnings.push_back("light set \"" + scene.lightSets[size_t(light.set)] +
                                      "\": no light of it reaches any surface; its result is "
                                      "black");
    if (isEmpty)
        report.warnings.push_back("the scene has no faces");
    else if (isDark)
        report.warnings.push_back(
            "no light reaches any surface: there is no lamp, no emission and no world that does; "
            "the result is black");
    return isEmpty || isDark;
}

// What is bright by itself is refused by Scene; what adds up to too much, or shines from nearly no
// distance, is seen only in the end.
void checkFinite(const std::vector<InstanceLight>& instances) {
    for (const InstanceLight& instance : instances)
        for (size_t c = 0; c < instance.direct.size(); ++c) {
            const glm::vec3 all = instance.direct[c] + instance.indirect[c] + instance.exitance[c];
            if (!std::isfinite(all.x + all.y + all.z))
                throw invalidArgument("object \"" + instance.name +
                                      "\": its light is too bright to compute with");
        }
}

}  // namespace

Bake::Bake() = default;
Bake::~Bake() = default;

// Where memory runs out or a cancel comes anywhere, patches, lines and solutions may be left
// half-made, and none of them goes to the next bake. After a cancel between two steps
// Trace::isWhole tells.
void Bake::run(const Scene& scene) {
    checkCombination(settings, scene.lightSets.size());
    makeRoomForTreeBuilders();
    const Progress callers = progress;
    Cancelled cancelled = Cancelled::NO;
    bool isDone = false;
    try {
        cancelled =
            runCancellable(callers, [&](const Progress& watched, tbb::task_group_context& context) {
                progress = watched;
                const Threads threads(settings.threads);
                tbb::task_arena(threads.count).execute([&] {
                    tbb::task_group(context).run_and_wait([&] {
                        runStages(scene, threads);
                        isDone = true;
                    });
                });
            });
    } catch (...) {
        progress = callers;
        trace.reset();
        throw;
    }
    progress = callers;
    if (isDone) return;
    if (cancelled == Cancelled::ANYWHERE) trace.reset();
    throw Error(RB_ERROR_CANCELLED, "the bake was cancelled");
}

void Bake::runStages(const Scene& scene, const Threads& threads) {
    Report report;
    std::vector<InstanceLight> made;  // kept once nothing can fail any more
    {
        Stopwatch total(report.totalSeconds);
        report.warnings = scene.warnings;
        if (threads.count < threads.wanted)
            report.warnings.push_back("the system lets " + std::to_string(threads.count) + " of " +
                                      std::to_string(threads.wanted) +
                                      " threads run; the bake takes longer for it");
        for (const std::string& name : scene.lightSets) report.lightSets.push_back({name, 0});
        makePatches(scene, report);

        const Patches& patches = trace->patches;
        std::vector<CoarseShot> coarse;
        if (!trace->tracer) {
            coarse = cutPatches(scene, report);
            trace->startLines(settings);
            report.skipped.push_back({"projection of faces",
                                      "they lie in a plane with others like them: projected as one",
                                      patches.sheets.joined - patches.sheets.sheets.size()});
        }
        const ShownLight shown(scene, patches, gathersSparseResults(settings));
        if (const size_t count = scene.cornersWithoutResult())
            report.skipped.push_back({"corners", "their light is not asked for", count});
        SetLights lights = shootSources(scene, shown, coarse, report);
        const Tiles tiles(patches);
        warnOfVisibility(scene, lights, settings, report);
        warnOfTranslucence(scene, settings, report);
        warnOfAngles(patches, settings, report);
        warnOfGaps(trace->uncutGaps, report);
        SideNoise noise(tiles.sideCount());
        exposed.assign(patches.sideCount(), 1.0f);
        const bool dark = isDark(scene, lights, report);
        if (patches.count() == 0 || (dark && settings.skipDarkness)) {
            report.skipped.push_back({"bundles and solve", "there is no light to exchange", 1});
        } else if (settings.skipReflection && isFirstShotAll(patches, lights)) {
            report.skipped.push_back({"bundles and solve", "no surface reflects light", 1});
            noise = keepFirstShot(scene, tiles, shown, lights, report);
        } else {
            std::vector<TransportInput> inputs;
            for (const SetLight& light : lights)
                inputs.push_back(
                    {patches, trace->visibility, light.shot, light.worldRadiance,
                     trace->surrounding.exposed, trace->touchDistance, settings, *trace->tracer,
                     trace->counts,
                     settings.solver == "LINE_REUSE" ? &trace->solutionsOf(light.set) : nullptr,
                     &shown.sides(), &trace->clusters});
            const Transports transports = makeTransports(settings.solver, inputs);
            noise = solveToTarget(scene, tiles, shown, lights, transports, report);
            exposed = trace->exposedShare();
            for (const SetLight& light : lights)
                balanceEnergy(patches, light, exposed, transports.front()->openShare(), report);
            warnOfImbalance(report);
            report.bundles = transports.front()->bundleCount();
            warnOfFewLines(scene, patches, trace->density.pixelSize, uint32_t(report.bundles),
                           settings, report);
        }
        irradiance = sumOf(lights);

        Stopwatch stage(report.seconds[RB_STAGE_RECONSTRUCTION]);
        made = reconstruct(scene, patches, trace->visibility, trace->touchDistance, lights, shown,
                           exposed, settings, progress, report);
        const std::vector<float> weight = exposedArea(patches, exposed);
        const std::vector<InstanceRange> ranges = instanceRanges(scene, patches);
        stateErrors(scene, tiles, ranges, meanOver(tiles, shown.of(lights, exposed), weight),
                    {tiles.mean(exposed, exposedArea(patches, {})), noise.ofBundles, noise.direct,
                     noise.ofObjects, noise.isOutOfReach},
                    settings.targetError, settings.hasIndependentDirections(), made, report);
        fillLeftOutCorners(patches, ranges, made, report);
        checkFinite(made);
    }
    throwIfCancelled();
    report.patches = trace->clusters.patches().count();
    report.skipped.push_back(
        {"patches", "not shown and finer than light is exchanged by: they exchange it as clusters",
         trace->clusters.memberCount()});
    report.cuts = trace->cuts;
    report.lines = trace->tracer->lineCount();
    report.exchanges = trace->counts.exchangeCount();
    json = report.json();
    light = std::move(made);
    ran = true;
}

void Bake::makePatches(const Scene& scene, Report& report) {
    Stopwatch stage(report.seconds[RB_STAGE_PATCHES]);
    progress.report(RB_STAGE_PATCHES, 0);
    const uint64_t hash = geometryHash(scene, settings), likeness = likenessHash(scene);
    const bool isSameGeometry =
        settings.skipGeometry && trace && trace->isOf(hash, likeness) && trace->isWhole();
    if (isSameGeometry) assignMaterials(scene, trace->patches);
    std::optional<Clusters> clusters;
    if (isSameGeometry) clusters = clustersOf(scene, trace->patches, settings);
    if (clusters && clusters->areThoseOf(trace->clusters)) {
        trace->clusters = std::move(*clusters);
        report.skipped.push_back({"patches and lines", "geometry unchanged since the last bake",
                                  trace->tracer->bundleCount()});
    } else {
        trace.reset();
        trace = std::make_unique<Trace>(
            hash, likeness, subdivide(scene, settings.patchSize, size_t(settings.maxPatches)),
            scene, settings);
    }
    const Patches& patches = trace->patches;
    report.warnings.insert(report.warnings.end(), patches.warnings.begin(), patches.warnings.end());
    if (patches.degenerateFaces)
        report.skipped.push_back({"faces", "no area but for rounding", patches.degenerateFaces});
    progress.report(RB_STAGE_PATCHES, 1);
}

// Cuts the patches where that pays. Returns the coarse shot of each light set, for the first shot
// to go on with; empty if it is to make its own.
std::vector<CoarseShot> Bake::cutPatches(const Scene& scene, Report& report) {
    Patches& patches = trace->patches;
    Cuts cuts;
    if (settings.contacts) {
        Stopwatch stage(report.seconds[RB_STAGE_PATCHES]);
        cuts = contactCuts(patches, trace->visibility, trace->touchDistance,
                           size_t(settings.maxPatches));
    }
    // Other solvers follow the lines of single patches and other first shots meet them with rays:
    // smaller ones are noisier.
    if (settings.solver != "LINE_REUSE" || settings.firstShot != "GATHER") {
        trace->uncutGaps = cuts.contacts;
        return {};
    }
    std::vector<CoarseShot> shots;
    if (settings.refine) {
        shots = shootCoarsely(scene, report);
        Stopwatch stage(report.seconds[RB_STAGE_PATCHES]);
        const size_t most =
            size_t(settings.maxPatches) - std::min(size_t(settings.maxPatches), cuts.morePatches());
        cuts.add(worthwhileCuts(scene, patches, shots, most, settings.targetError));
    }
    Stopwatch stage(report.seconds[RB_STAGE_PATCHES]);
    if (cuts.count() > 0) {
        cutTiles(scene, patches, cuts.levels);
        trace->clusters = clustersOf(scene, patches, settings);
    }
    trace->cuts = {{"narrow gap", cuts.contacts},
                   {"edge of a shadow", cuts.shadowEdges},
                   {"light that bends within the patch", cuts.bentLight}};
    return shots;
}

// A few shadow rays from each tile, for each light set.
std::vector<CoarseShot> Bake::shootCoarsely(const Scene& scene, Report& report) {
    Stopwatch stage(report.seconds[RB_STAGE_FIRST_SHOT]);
    const Patches& patches = trace->patches;
    std::vector<uint32_t> all(patches.sideCount());
    std::iota(all.begin(), all.end(), 0u);
    std::vector<CoarseShot> shots;
    for (int32_t set = kNoLightSet; set < int32_t(scene.lightSets.size()); ++set) {
        const DirectLight direct(scene, patches, trace->visibilityOfLights(),
                                 uint32_t(settings.seed), set, settings);
        CoarseShot shot{std::vector<Gathered>(all.size()), {}};
        direct.shootCoarsely(
            shot, all,
            [&](size_t side) {
                return Receiver{uint32_t(side), patches.normal(uint32_t(side)), std::nullopt,
                                uint32_t(side)};
            },
            [&](double done) { progress.report(RB_STAGE_FIRST_SHOT, done); });
        shots.push_back(std::move(shot));
    }
    return shots;
}

// The first shot of each light set, and of what belongs to none.
SetLights Bake::shootSources(const Scene& scene, const ShownLight& shown,
                             const std::vector<CoarseShot>& coarse, Report& report) {
    Stopwatch stage(report.seconds[RB_STAGE_FIRST_SHOT]);
    const Patches& patches = trace->patches;
    const Visibility& visibility = trace->visibilityOfLights();
    const uint64_t aims = shotHash(scene, settings, shown.sides(), !patches.scattering.empty());
    const StandIns standIns(patches, settings.skipClusters ? &shown.sides() : nullptr);
    SetLights lights;
    const int32_t count = int32_t(scene.lightSets.size());
    for (int32_t set = kNoLightSet; set < count; ++set) {
        const Progress share = progress.part(lights.size(), size_t(count) + 1);
        DirectLight direct(scene, patches, visibility, uint32_t(settings.seed), set, settings);
        Trace::Shot& last = trace->shots[set];
        const uint64_t hash = lightHash(direct, aims);
        FirstShot shot;
        const bool isGather = settings.firstShot == "GATHER";
        const bool mayKeep = settings.skipLights && isGather;
        const FirstShotInput input{direct,
                                   patches,
                                   visibility,
                                   settings,
                                   share,
                                   trace->touchDistance,
                                   trace->linesPerBundle(),
                                   &trace->visibility,
                                   coarse.empty() ? nullptr : &coarse[lights.size()],
                                   mayKeep && last.aims == aims ? last.shot.bySource : nullptr,
                                   &shown.sides(),
                                   &standIns};
        if (mayKeep && last.hash == hash) {
            report.skipped.push_back({"first shot", "lights unchanged since the last bake", 1});
            shot = last.shot;
        } else {
            shot = firstShot(settings.firstShot, input);
            report.shadowRays += shot.rays;
            if (shot.bySource && shot.bySource == last.shot.bySource)
                report.skipped.push_back({"first shot",
                                          "only strengths of lights changed since the last bake: "
                                          "what each brought is scaled",
                                          1});
            if (isGather) last = {hash, aims, shot};
        }
        if (isGather && settings.solver == "LINE_REUSE")
            if (const size_t spots =
                    gatherBrightSpots(scene, input, trace->visibility, trace->density, shot))
                report.skipped.push_back(
                    {"bundles", "few bright sides: their reflected light is gathered", spots});
        report.skipped.push_back(
            {"emission", "inside of closed surfaces that hold nothing else", direct.unseenSides()});
        report.skipped.push_back(
            {"noise of direct light", "source wholly visible: closed form", shot.unblockedSides});
        report.skipped.push_back(
            {"shadow rays", "side and source face away from each other", shot.hiddenSides});
        report.skipped.push_back(
            {"most shadow rays", "the source gives little of the light", shot.weakSides});
        report.skipped.push_back(
            {"most shadow rays", "the side is the inside of a solid", shot.insideSides});
        report.skipped.push_back(
            {"shadow rays", "sides finer than tiles that are not shown: others stand for them",
             shot.sidesByOthers});
        lights.push_back({set, std::move(direct), std::move(shot), scene.worldRadianceOf(set),
                          Irradiance(patches.sideCount())});
    }
    return lights;
}

// The result where bundles have nothing to bring; some of them tell what is covered.
SideNoise Bake::keepFirstShot(const Scene& scene, const Tiles& tiles, const ShownLight& shown,
                              SetLights& lights, Report& report) {
    Stopwatch stage(report.seconds[RB_STAGE_BUNDLES]);
    const Patches& patches = trace->patches;
    exposed = trace->surrounding.exposed;
    if (exposed.empty()) exposed = trace->surroundingsOf(settings).exposed;
    std::vector<float> weight = wantedArea(patches, shown);
    for (size_t side = 0; side < weight.size(); ++side) weight[side] *= exposed[side];
    const std::vector<float> tileWeight = tiles.sum(weight);
    const GatheredNoise gathered(patches, shown);
    std::vector<std::vector<float>> errorOfSets;
    std::vector<std::array<Irradiance, 2>> halves;
    for (SetLight& light : lights) {
        HandOver first = handOver(patches, light.shot, exposed);
        light.irradiance.gathered = first.gathered;
        light.irradiance.direct = std::move(first.gathered);
        light.irradiance.indirect = std::move(first.indirect);
        const Irradiance mean = meanOver(tiles, light.irradiance, weight);
        halves.push_back({mean, mean});
        errorOfSets.push_back(tiles.errorOfMean(gathered.withoutGathered(light.shot.error)));
    }
    SetNoise noise({}, std::move(errorOfSets), tileWeight, tiles.patches());
    noise.look(halves, 1, 0);
    const std::vector<double> errors = noise.relative();
    report.estimatedError = errors.front();
    for (size_t set = 0; set < report.lightSets.size(); ++set)
        report.lightSets[set].estimatedError = errors[set + 1];
    SideNoise result = noise.perSide();
    const std::vector<double> growth = cornerGrowth(scene, tiles.patches());
    CornerNoise corners = noiseAtCorners(scene, tiles.patches(), noise.ofLights().front(), growth,
                                         std::vector<double>(growth.size(), kUsuallyOverForetold));
    report.error.noise = corners.ofAll;
    result.ofObjects = std::move(corners.ofObjects);
    return result;
}

// Solves for all bundles there are. error: of the light, relative. Returns what is to be said of
// it.
Report Bake::finishSolve(const Transports& transports, SetLights& lights, const ShownLight& shown,
                         double error) const {
    Report report;
    const float tolerance = float(std::clamp(kFinalShare * error, kLeastTolerance, kMostTolerance));
    for (size_t k = 0; k < lights.size(); ++k) {
        Report unsaid;  // of the lines, which the first has said for all
        lights[k].irradiance =
            transports[k]->finish(tolerance, shown.sides(), k == 0 ? report : unsaid);
    }
    return report;
}

// Noisy sides cast rays of their own, and more of them as long as that helps. halves: of each
// light, as they arrive. look: at them with these rays. Returns what is left, see
// NoisyParts::lookWithRays.
double Bake::castRays(NoisyParts& noisyParts, SetLights& lights,
                      std::vector<std::array<Irradiance, 2>>& halves,
                      const std::function<double(uint32_t)>& look, Report& report) const {
    std::vector<std::array<float, 2>> samples = trace->linesByHalf();
    double left = 0;
    for (uint32_t pass = 0; pass < kMostPasses; ++pass) {
        const std::vector<ExtraRays> rays = noisyParts.rays(samples, kRaysOfFirstPass << pass);
        if (pass == 0)
            report.skipped.push_back({"bundles",
                                      "few lines would meet what is noisy: its sides cast rays",
                                      rays.size()});
        if (rays.empty()) break;
        addExtraRays(trace->patches, trace->visibility, trace->touchDistance, trace->exposedShare(),
                     rays, hash(uint32_t(settings.seed), pass), samples, lights, halves);
        left = look(kMostPasses - 1 - pass);
    }
    return left;
}

// Adds bundles until the difference of the two halves' estimates meets the target, in
// the light of all and in that of each light set.
SideNoise Bake::solveToTarget(const Scene& scene, const Tiles& tiles, const ShownLight& shown,
                              SetLights& lights, const Transports& transports, Report& report) {
    Transport& transport = *transports.front();  // traces for all
    const Patches& patches = trace->patches;
    const size_t n = patches.sideCount();
    // Sides whose noise counts: those with a result, by the area that is exposed as far as known.
    const std::vector<float> area = wantedArea(patches, shown);
    const GatheredNoise gathered(patches, shown);
    std::vector<float> weight(n, 0);
    std::vector<std::vector<float>> errorOfSets;
    for (const SetLight& light : lights)
        errorOfSets.push_back(tiles.errorOfMean(gathered.withoutGathered(light.shot.error)));
    std::vector<float> tileWeight(tiles.sideCount(), 0);
    SetNoise noise(trace->looks, errorOfSets, tileWeight, tiles.patches());

    const std::vector<double> growth = cornerGrowth(scene, tiles.patches());
    std::vector<double> overForetold;  // see shownOverForetold
    // Which parts of objects are noisy is known by the lines that met them.
    std::optional<NoisyParts> noisyParts;
    const bool countsLines = settings.solver == "LINE_REUSE";
    if (countsLines)
        noisyParts.emplace(tiles, trace->looks, tiles.sum(area), shown, growth, overForetold,
                           trace->density.windows.empty()
                               ? 0.0
                               : double(patches.sheets.loose.size() + patches.sheets.sheets.size()),
                           settings.targetError);

    std::vector<double> errors;  // relative: of the light of all, then of each light set
    std::vector<std::array<Irradiance, 2>> halves(lights.size());  // as they arrive
    // What is seen of the halves, on tiles.
    auto seen = [&] {
        std::vector<std::array<Irradiance, 2>> result(lights.size());
        const std::vector<float> exposed = trace->exposedShare();
        for (size_t k = 0; k < lights.size(); ++k) {
            for (size_t h = 0; h < 2; ++h) result[k][h] = shown.of(halves[k][h], exposed);
            gathered.apply(result[k], weight);
            for (Irradiance& half : result[k]) half = meanOver(tiles, half, weight);
        }
        return result;
    };
    // At each look: the same light is to have the same rays, whatever was baked before; and rays
    // leave noise of another kind than lines.
    auto measureCorners = [&](const SetNoise& look,
                              const std::vector<std::array<Irradiance, 2>>& halvesSeen) {
        overForetold =
            shownOverForetold(scene, tiles.patches(), look.ofLights().front(), halvesSeen.front(),
                              tiles.mean(trace->exposedShare(), exposedArea(patches, {})),
                              settings.regularization, growth);
    };
    const uint32_t counted = mostBundles(patches, trace->density);
    const uint32_t most = std::min(uint32_t(settings.maxBundles), counted) & ~1u;
    uint32_t wanted = std::max(transport.bundleCount(),
                               std::min(most, (uint32_t(settings.minBundles) + 1) & ~1u));
    const double target = settings.targetError;
    // Who fixes or limits the number of bundles wants what these tell.
    const bool castsRays =
        noisyParts && settings.skipBundles && settings.minBundles < settings.maxBundles;
    Report finish;           // what the last solve says
    double left = INFINITY;  // see NoisyParts::lookWithRays
    bool isReached = false;
    for (;;) {
        if (wanted > transport.bundleCount()) {
            Stopwatch stage(report.seconds[RB_STAGE_BUNDLES]);
            transport.advance(wanted - transport.bundleCount(), progress);
        }

        Stopwatch stage(report.seconds[RB_STAGE_SOLVE]);
        trace->measureExposedShare(uint32_t(settings.seed));
        const uint32_t bundles = transport.bundleCount();
        progress.report(RB_STAGE_SOLVE, std::min(1.0, double(bundles) / settings.maxBundles));
        const std::vector<float> exposed = trace->exposedShare();
        for (size_t side = 0; side < n; ++side) weight[side] = area[side] * exposed[side];
        tileWeight = tiles.sum(weight);
        for (size_t k = 0; k < lights.size(); ++k)
            for (size_t h = 0; h < 2; ++h)
                halves[k][h] = transports[k]->irradiance(Half(h), kHalfTolerance * float(target));
        const std::vector<std::array<Irradiance, 2>> now = seen();
        noise.look(now, bundles, transport.bias());
        measureCorners(noise, now);
        errors = noise.relative();
        trace->looks = noise.looks();
        if (noisyParts) {
            noisyParts->look(noise, bundles, tiles.sum(trace->linesMet()), trace->linesMetByAll());
            trace->looks.shareOfParts = noisyParts->shares();
        }

        const auto worst = std::max_element(errors.begin(), errors.end());
        double excess = noisyParts ? noisyParts->excess() : noise.excess(target);
        isReached = excess <= 1 && settings.skipBundles;
        if (isReached || bundles >= most) {
            finish = finishSolve(transports, lights, shown, errors.front());
            if (castsRays && isReached) {
                const double before = left;
                left = castRays(
                    *noisyParts, lights, halves,
                    [&](uint32_t furtherPasses) {
                        SetNoise withRays({}, errorOfSets, tileWeight, tiles.patches());
                        const std::vector<std::array<Irradiance, 2>> withThese = seen();
                        withRays.look(withThese, bundles, transport.bias());
                        measureCorners(withRays, withThese);
                        return noisyParts->lookWithRays(withRays, furtherPasses);
                    },
                    finish);
                if (left > kLeftWithRays && left < std::min(kWorthMore * before, kOutOfReach)) {
                    excess = left / kLeftWithRays;
                    isReached = false;
                }
            }
        }
        if (isReached) break;
        if (bundles >= most) {
            const int32_t set = lights[size_t(worst - errors.begin())].set;
            report.warnings.push_back(
                (counted < uint32_t(settings.maxBundles)
                     ? "the lines of more than " + std::to_string(bundles) +
                           " bundles cannot be counted, which fewer lines_per_bundle allow: "
                     : "max_bundles was reached at " + std::to_string(bundles) + " bundles: ") +
                "the noise " +
                (set == kNoLightSet ? "" : "of light set \"" + scene.lightSets[set] + "\" ") +
                "is " + percent(*worst) +
                (noisyParts ? ", " + percent(excess * target) + " where it is most," : "") +
                " and not below " + percent(target));
            break;
        }
        // As many as the error's slope says; if that is far away, double only, and look again.
        const double factor =
            settings.skipBundles ? 1.05 * std::pow(excess, 1 / kNoiseSlope) : INFINITY;
        wanted = std::min(most, (uint32_t(bundles * (factor < kFarAway ? factor : 2.0)) + 2) & ~1u);
    }

    Stopwatch stage(report.seconds[RB_STAGE_SOLVE]);
    report.skipped.insert(report.skipped.end(), finish.skipped.begin(), finish.skipped.end());
    report.warnings.insert(report.warnings.end(), finish.warnings.begin(), finish.warnings.end());
    if (castsRays) {
        noise.lookAgain(seen());
        errors = noise.relative();
    }
    CornerNoise corners =
        noiseAtCorners(scene, tiles.patches(), noise.ofLights().front(), growth, overForetold);
    if (isReached && *std::max_element(errors.begin(), errors.end()) > target &&
        corners.ofAll > target)
        warnOfDirectNoise(scene, patches, lights, area, corners.ofAll, target, report);
    else if (isReached)
        report.skipped.push_back({"bundles", "the noise is at its target",
                                  most - std::min(most, transport.bundleCount())});

    if (const uint64_t cycles = trace->tracer->cycleCount())
        report.warnings.push_back(std::to_string(cycles) +
                                  " cycles of patches that cover each other were broken anywhere: "
                                  "the projector AUTO has none");

    // What more bundles do not help.
    double shownNoise = corners.ofAll, wrong = trace->tracer->disorderedShare();
    if (settings.smallPatches == "ROULETTE")
        wrong +=
            leakedShare(scene, patches, weight, trace->surrounding.open, transport.openShare());
    if (wrong > 0) {
        const double error = errorByWrongExchanges(patches, wrong);
        for (double& e : errors) e = std::hypot(e, error);
        shownNoise = std::hypot(shownNoise, error);
        if (error > settings.targetError)
            report.warnings.push_back("the projector put " + std::to_string(100 * wrong) +
                                      " % of the lines in a wrong order or through surfaces, which "
                                      "more bundles do not mend: the error is about " +
                                      std::to_string(100 * error) + " %");
    }
    report.estimatedError = errors.front();
    report.error.noise = shownNoise;
    for (size_t set = 0; set < report.lightSets.size(); ++set)
        report.lightSets[set].estimatedError = errors[set + 1];
    progress.report(RB_STAGE_SOLVE, 1);
    SideNoise result = noise.perSide();
    result.ofObjects = std::move(corners.ofObjects);
    result.isOutOfReach = isReached && castsRays && left > kLeftWithRays;
    return result;
}

const Patches& Bake::patches() const { return trace->patches; }

const CornerLight& Bake::setLight(int32_t set, int32_t instance) const {
    const InstanceLight& all = instanceLight(instance);
    if (set < 0 || size_t(set) >= all.sets.size())
        throw invalidArgument("the last bake had no light set " + std::to_string(set));
    return all.sets[size_t(set)];
}

const InstanceLight& Bake::instanceLight(int32_t instance) const {
    if (!ran) throw Error(RB_ERROR_INVALID_OPERATION, "there is no result before a bake");
    if (instance < 0 || size_t(instance) >= light.size())
        throw invalidArgument("there is no instance " + std::to_string(instance));
    if (!light[size_t(instance)].isBaked)
        throw invalidArgument("object \"" + light[size_t(instance)].name +
                              "\" only occludes: it has no result");
    return light[size_t(instance)];
}

}  // namespace raybundle
