// SPDX-License-Identifier: GPL-3.0-or-later
//
// The stages of a bake: patches, first shot, bundles and solve, reconstruction.
//
// Source: thesis section 5.2, for the two steps of a first shot followed by bundles.
// Differs: see the heads of the stages' files.
#include "bake/bake.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

#include "bake/adaptation.h"
#include "bake/bake_warnings.h"
#include "bake/bundle_solve.h"
#include "bake/draft_light.h"
#include "bake/first_light.h"
#include "bake/first_shots.h"
#include "bake/geometry_hash.h"
#include "bake/interim.h"
#include "bake/source_strengths.h"
#include "bake/stopwatch.h"
#include "bake/trace.h"
#include "job/cancellation.h"
#include "job/combination.h"
#include "job/memory.h"
#include "job/threads.h"
#include "lights/world_source.h"
#include "patches/reflectance.h"
#include "reconstruction/corner_gather.h"
#include "reconstruction/left_out_corners.h"
#include "reconstruction/reconstruction.h"
#include "reconstruction/shown_light.h"
#include "refinement/adapted_meshes.h"
#include "refinement/contacts.h"
#include "refinement/refinement.h"
#include "stated_error/energy_balance.h"
#include "stated_error/stated_error.h"
#include "transport/set_light.h"
#include "visibility/embree_device.h"

namespace raybundle {
namespace {

// Returns whether the first shot has distributed all light: surfaces neither reflect nor transmit
// any, and there is no light of a constant world or of dim emission for lines to carry.
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

// Returns whether there are no surfaces or no light reaches any of them. Adds warnings about this,
// and about each light set of the report whose light reaches no surface.
bool isDark(const Scene& scene, const SetLights& lights, Report& report) {
    const bool isEmpty = lights.front().shot.irradiance.empty();
    const bool isDark = std::all_of(lights.begin(), lights.end(),
                                    [](const SetLight& light) { return light.isDark(); });
    for (const SetLight& light : lights)
        if (light.set != kNoLightSet && size_t(light.set) < report.lightSets.size() &&
            light.isDark())
            report.warn(WarningId::DARK_LIGHT_SET,
                        "light set \"" + scene.lightSets[size_t(light.set)] +
                            "\": no light of the set reaches any surface, so that its result is "
                            "black; check which lights belong to the set");
    if (isEmpty)
        report.warn(WarningId::NO_FACES,
                    "the scene has no faces with an area, so that there is nothing to bake");
    else if (isDark)
        report.warn(
            WarningId::NO_LIGHT,
            "no light reaches any surface, so that the result is black; add a lamp, an emissive "
            "material or a world that is not black");
    return isEmpty || isDark;
}

// Throws if a baked value is not finite. Single inputs are bounded when they are added to the
// scene. Only their sum, or the light of a source at almost no distance, can still overflow.
void checkFinite(const std::vector<InstanceLight>& instances) {
    for (const InstanceLight& instance : instances)
        for (size_t c = 0; c < instance.direct.size(); ++c) {
            const glm::vec3 all = instance.direct[c] + instance.indirect[c] + instance.exitance[c];
            if (!std::isfinite(all.x + all.y + all.z))
                throw invalidArgument(
                    "object \"" + instance.name +
                    "\": its light is too bright to be stored; reduce the strength of the lights, "
                    "or move them away from the object");
        }
}

}  // namespace

// The results of the exchange of light that later stages use.
struct Bake::Exchanged {
    SideNoise noise;
    std::vector<float> exposed;  // per side: share of its area that nothing covers
    Report::Energy ofLastSet{};  // the part of the report's energy that belongs to the last light
};

// What all stages compute, before it replaces the results of the last run.
struct Bake::Results {
    Report report;
    Irradiance irradiance, ofLastSet;  // per side, W/m^2: by all light, and by the last light
    Report::Energy energyOfLastSet;
    std::vector<float> exposed;
    std::vector<InstanceLight> light;
    std::vector<FinerMesh> adapted;  // per instance; empty if no meshes are adapted
};

Bake::Bake() = default;
Bake::~Bake() = default;

// If memory runs out, or if a cancellation stops the work at any point, patches, lines and
// solutions may be half-made. The next bake then uses none of them. After a cancellation between
// two steps, Trace::isWhole() decides whether the next bake can use them. A bake that reaches its
// memory limit is cancelled, too.
void Bake::run(const Scene& scene) {
    checkCombination(settings, scene.lightSets.size());
    makeRoomForTreeBuilders();
    const Progress callers = progress;
    const MemoryLimit limit(settings.memoryLimit);
    memory.begin();
    Cancelled cancelled = Cancelled::NO;
    bool isDone = false, isTooLarge = false;
    const auto mayGoOn = [&] { return !(isTooLarge = memory.bytes() > limit.whole); };
    const auto work = [&](const Progress& watched, tbb::task_group_context& context) {
        progress = watched;
        const Threads threads(settings.threads);
        tbb::task_arena(threads.count).execute([&] {
            tbb::task_group(context).run_and_wait([&] {
                runAll(scene, threads);
                isDone = true;
            });
        });
    };
    try {
        cancelled = runCancellable(callers, mayGoOn, work);
    } catch (...) {
        progress = callers;
        dropTraces();
        throw;
    }
    progress = callers;
    if (isDone || cancelled != Cancelled::ANYWHERE)
        memory.end();
    else
        dropTraces();
    if (isDone) return;
    if (isTooLarge) throw limit.reached();
    throw Error(RB_ERROR_CANCELLED, "the bake was cancelled");
}

void Bake::dropTraces() {
    trace.reset();
    traceOfSources.reset();
    // What the allocator keeps of their memory is not the bake's.
    memory = MemoryUse();
}

void Bake::runAll(const Scene& scene, const Threads& threads) {
    if (settings.adaptMeshes) return runAdapted(scene, threads);
    traceOfSources.reset();
    if (DraftLight::isPossible(settings)) return runDraft(scene, threads);
    draft.reset();
    keep(runStages(scene, scene.lightSets.size(), threads));
}

// Scales the light of the last draft if possible. Otherwise runs all stages, with the sources apart
// whose strengths change.
void Bake::runDraft(const Scene& scene, const Threads& threads) {
    const SourceStrengths now(scene, settings);
    if (draft && scaleDraft(now)) return;
    std::vector<size_t> apart;
    if (draft) apart = draft->sourcesToPart(now);
    std::optional<Scene> parted;
    if (!apart.empty()) parted = partedScene(scene, apart);
    draft.reset();
    Results made = runStages(parted ? *parted : scene, scene.lightSets.size(), threads);
    auto next = std::make_unique<DraftLight>(now, made.report);
    if (parted) next->part(std::move(apart), made.ofLastSet, made.energyOfLastSet, made.light);
    keep(std::move(made));
    draft = std::move(next);
}

// Bakes the meshes as they are, adapts them to that light, and bakes the adapted meshes.
void Bake::runAdapted(const Scene& scene, const Threads& threads) {
    draft.reset();
    const Progress callers = progress;
    FirstPassProgress firstPass(callers);
    progress = firstPass.progress();
    std::swap(trace, traceOfSources);
    Results first = runStages(scene, scene.lightSets.size(), threads, true);
    std::swap(trace, traceOfSources);
    progress = callers;
    if (!areAnyFiner(scene, first.adapted)) {
        first.report.skip(SkippedWork::SECOND_PASS, 1);
        return keep(std::move(first));
    }
    if (interim)
        interim->convertBy([meshes = first.adapted](std::vector<InstanceLight> light) {
            return atSources(light, meshes);
        });
    Results made = runStages(adaptedScene(scene, first.adapted), scene.lightSets.size(), threads);
    addFirstPass(first.report, made.report);
    made.adapted = std::move(first.adapted);
    keep(std::move(made));
}

// Returns whether the light of the last draft could be scaled.
bool Bake::scaleDraft(const SourceStrengths& now) {
    double seconds = 0;
    std::optional<Report> report;
    {
        Stopwatch total(seconds);
        report = draft->scale(now, light, irradiance);
    }
    if (!report) return false;
    report->totalSeconds = seconds;
    json = report->json();
    return true;
}

void Bake::keep(Results results) {
    json = results.report.json();
    irradiance = std::move(results.irradiance);
    exposed = std::move(results.exposed);
    light = std::move(results.light);
    adapted = std::move(results.adapted);
    ran = true;
}

Bake::Results Bake::runStages(const Scene& scene, size_t reportedSets, const Threads& threads,
                              bool adapts) {
    Results made;
    Report& report = made.report;
    {
        Stopwatch total(report.totalSeconds);
        noteWhatIsGiven(scene, reportedSets, threads, report);
        prepareWorld(scene, report);
        showFirstLight(scene, report);
        makePatches(scene, report);
        const std::vector<CoarseShot> coarse = startLines(scene, report);
        const ShownLight shown(scene, trace->patches, settings);
        report.skip(SkippedWork::UNWANTED_CORNERS, scene.cornersWithoutResult());
        const StageInput shots{scene, settings, progress, *trace, interim};
        SetLights lights = shootSources(shots, shown, coarse, report);
        offerFirstShots(shots, shown, lights);
        warnOfVisibility(scene, lights, settings, report);
        warnOfTranslucence(scene, settings, report);
        warnOfAngles(trace->patches, settings, report);
        warnOfGaps(trace->uncutGaps, report);
        const Tiles tiles(trace->patches);
        const SolveInput input{shots, tiles, shown};
        Exchanged exchanged = exchange(input, lights, report);
        made.light = show(input, lights, exchanged, report, adapts ? &made.adapted : nullptr);
        made.irradiance = sumOf(lights);
        made.ofLastSet = std::move(lights.back().irradiance);
        made.energyOfLastSet = exchanged.ofLastSet;
        made.exposed = std::move(exchanged.exposed);
    }
    throwIfCancelled();
    noteWhatWasTraced(report);
    return made;
}

void Bake::noteWhatIsGiven(const Scene& scene, size_t reportedSets, const Threads& threads,
                           Report& report) const {
    report.warnings = scene.warnings;
    if (threads.count < threads.wanted)
        report.warn(WarningId::FEWER_THREADS,
                    "the system allows only " + std::to_string(threads.count) + " of " +
                        std::to_string(threads.wanted) +
                        " threads, so that the bake takes longer; free memory, or raise the "
                        "system's limit of threads");
    for (size_t set = 0; set < reportedSets; ++set)
        report.lightSets.push_back({scene.lightSets[set], 0});
}

void Bake::noteWhatWasTraced(Report& report) const {
    report.patches = trace->clusters.patches().count();
    warnOfPatches(report.patches, settings, report);
    report.skip(SkippedWork::CLUSTERED_PATCHES, trace->clusters.memberCount());
    report.cuts = trace->cuts;
    report.lines = trace->tracer->lineCount();
    report.exchanges = trace->counts.exchangeCount();
}

// Makes the source of the world's image, or keeps it for an equal image.
void Bake::prepareWorld(const Scene& scene, Report& report) {
    Stopwatch stage(report.seconds[RB_STAGE_FIRST_SHOT]);
    world = scene.worldImage.meanRadiance() == glm::vec3(0.0f) ? nullptr
                                                               : worldSource(scene.worldImage);
}

void Bake::showFirstLight(const Scene& scene, Report& report) const {
    if (!interim) return;
    Stopwatch stage(report.seconds[RB_STAGE_PATCHES]);
    progress.report(RB_STAGE_PATCHES, 0);
    offerFirstLight(scene, settings, *interim);
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
        report.skip(SkippedWork::UNCHANGED_GEOMETRY, trace->tracer->bundleCount());
    } else {
        trace.reset();
        trace = std::make_unique<Trace>(
            hash, likeness, subdivide(scene, settings.patchSize, size_t(settings.maxPatches)),
            scene, settings);
    }
    const Patches& patches = trace->patches;
    report.warnings.insert(report.warnings.end(), patches.warnings.begin(), patches.warnings.end());
    if (patches.degenerateFaces)
        report.skip(SkippedWork::DEGENERATE_FACES, patches.degenerateFaces);
    progress.report(RB_STAGE_PATCHES, 1);
}

// Cuts the patches and prepares the tracing of lines, unless an earlier bake has done so. Returns
// the coarse shots of cutPatches().
std::vector<CoarseShot> Bake::startLines(const Scene& scene, Report& report) {
    if (trace->tracer) return {};
    std::vector<CoarseShot> coarse = cutPatches(scene, report);
    trace->startLines(settings);
    const Sheets& sheets = trace->patches.sheets;
    report.skip(SkippedWork::SHEETS, sheets.joined - sheets.sheets.size());
    return coarse;
}

// Cuts the patches where a cut pays. Returns the coarse shot of each light set, from which the
// first shot starts. If the result is empty, the first shot makes its own coarse shot.
std::vector<CoarseShot> Bake::cutPatches(const Scene& scene, Report& report) {
    Patches& patches = trace->patches;
    Cuts cuts;
    // The nodes of dense surfaces gather their light, which no cut would sharpen.
    const bool cutsDense = !gathersDenseSurfaces(settings);
    const size_t most = size_t(settings.maxPatches), now = trace->clusters.patches().count();
    const size_t room = most - std::min(most, now);
    if (settings.contacts) {
        Stopwatch stage(report.seconds[RB_STAGE_PATCHES]);
        cuts = contactCuts(patches, trace->visibility, room, cutsDense);
    }
    // With other methods, cut patches are noisier: other solvers follow the lines of single
    // patches, and other first shots send rays from the sources to patches. Smaller patches get
    // fewer of both.
    if (!settings.countsLines() || !settings.gathersFirstShot()) {
        trace->uncutGaps = cuts.contacts;
        return {};
    }
    std::vector<CoarseShot> shots;
    if (settings.refine && room > cuts.morePatches()) {
        shots = shootCoarsely({scene, settings, progress, *trace, interim}, report);
        Stopwatch stage(report.seconds[RB_STAGE_PATCHES]);
        cuts.add(worthwhileCuts(scene, patches, shots, room - cuts.morePatches(),
                                settings.targetError, cutsDense));
    }
    Stopwatch stage(report.seconds[RB_STAGE_PATCHES]);
    if (cuts.count() > 0) {
        cutTiles(scene, patches, cuts.levels);
        trace->clusters = clustersOf(scene, patches, settings);
    }
    trace->cuts = {{"narrow gap", cuts.contacts},
                   {"edge of a shadow", cuts.shadowEdges},
                   {"nonlinear light within the patch", cuts.bentLight}};
    return shots;
}

// Exchanges light between the patches, unless there is none to exchange.
Bake::Exchanged Bake::exchange(const SolveInput& in, SetLights& lights, Report& report) {
    const Patches& patches = trace->patches;
    Exchanged result{SideNoise(in.tiles.sideCount()),
                     std::vector<float>(patches.sideCount(), 1.0f)};
    const bool dark = isDark(in.scene, lights, report);
    if (patches.count() == 0 || (dark && settings.skipDarkness)) {
        report.skip(SkippedWork::EXCHANGE_WITHOUT_LIGHT, 1);
    } else if (settings.skipReflection && isFirstShotAll(patches, lights)) {
        report.skip(SkippedWork::EXCHANGE_WITHOUT_REFLECTION, 1);
        result.noise = keepFirstShot(in, lights, result.exposed, report);
    } else {
        const Transports transports = transportsOf(lights, in.shown);
        result.noise = BundleSolve(in, lights, transports).run(report);
        result.exposed = trace->exposedShare();
        for (const SetLight& light : lights) {
            result.ofLastSet = {};
            balanceEnergy({patches, result.exposed}, light, transports.front()->openShare(),
                          result.ofLastSet);
            report.energy.add(result.ofLastSet);
        }
        warnOfImbalance(report);
        report.bundles = transports.front()->bundleCount();
        warnOfFewLines(in.scene, patches, trace->density.pixelSize, uint32_t(report.bundles),
                       settings, report);
    }
    return result;
}

Transports Bake::transportsOf(const SetLights& lights, const ShownLight& shown) const {
    std::vector<TransportInput> inputs;
    for (const SetLight& light : lights)
        inputs.push_back({{trace->patches, trace->surrounding.exposed},
                          trace->visibility,
                          light.shot,
                          light.worldRadiance,
                          settings,
                          *trace->tracer,
                          trace->counts,
                          settings.countsLines() ? &trace->solutionsOf(light.set) : nullptr,
                          &shown.sides(),
                          &trace->clusters});
    return makeTransports(settings.solver, inputs);
}

// Returns the light at the corners of each instance, with its stated error. Stores meshes that
// follow this light in `meshes`, if it is not null.
std::vector<InstanceLight> Bake::show(const SolveInput& in, const SetLights& lights,
                                      const Exchanged& exchanged, Report& report,
                                      std::vector<FinerMesh>* meshes) {
    Stopwatch stage(report.seconds[RB_STAGE_RECONSTRUCTION]);
    const Patches& patches = trace->patches;
    const ReconstructionInput input{{patches, exchanged.exposed},
                                    in.scene,
                                    trace->visibility,
                                    trace->clusters,
                                    lights,
                                    in.shown,
                                    settings};
    std::vector<InstanceLight> made = reconstruct(input, progress, report);
    std::vector<float> weight = patches.sideAreas();
    const std::vector<float> exposedOfTiles = in.tiles.mean(exchanged.exposed, weight);
    for (size_t side = 0; side < weight.size(); ++side) weight[side] *= exchanged.exposed[side];
    const std::vector<InstanceRange> ranges = instanceRanges(in.scene, patches);
    const SideNoise& noise = exchanged.noise;
    const Irradiance ofTiles = meanOver(in.tiles, in.shown.of(lights, exchanged.exposed), weight);
    std::vector<bool> isGathered(in.tiles.sideCount());
    for (uint32_t side = 0; side < isGathered.size(); ++side)
        isGathered[side] = in.shown.isGathered(in.tiles.firstSide(side));
    const SideErrors sides{ofTiles,         exposedOfTiles, noise.ofBundles,   noise.direct,
                           noise.ofObjects, isGathered,     noise.isOutOfReach};
    stateErrors(in.scene, in.tiles, ranges, sides, settings, made, report);
    if (meshes || (settings.countAdaptive && !settings.adaptMeshes)) {
        std::vector<FinerMesh> adapted =
            adaptMeshes({input, in.tiles, sides, made}, ranges, progress, report);
        for (size_t i = 0; i < adapted.size(); ++i)
            report.objects[i].adaptiveVertices = adapted[i].vertices.size();
        if (meshes) *meshes = std::move(adapted);
    }
    fillLeftOutCorners(patches, ranges, made, report);
    checkFinite(made);
    return made;
}

const Patches& Bake::patches() const { return trace->patches; }

const FinerMesh& Bake::adaptedMesh(int32_t instance) const {
    instanceLight(instance);  // throws if there is none
    if (adapted.empty())
        throw Error(RB_ERROR_INVALID_OPERATION,
                    "the last bake has not adapted the meshes; set adapt_meshes to 1");
    return adapted[size_t(instance)];
}

const CornerLight& Bake::setLight(int32_t set, int32_t instance) const {
    const InstanceLight& all = instanceLight(instance);
    if (set < 0 || size_t(set) >= all.sets.size())
        throw invalidArgument("the last bake had no light set " + std::to_string(set));
    return all.sets[size_t(set)];
}

const InstanceLight& Bake::instanceLight(int32_t instance) const {
    if (!ran)
        throw Error(RB_ERROR_INVALID_OPERATION, "there is no result before a successful bake");
    return bakedInstance(light, instance);
}

}  // namespace raybundle
