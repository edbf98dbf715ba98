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
#include <glm/gtc/constants.hpp>

#include "bake/combination.h"
#include "bake/geometry_hash.h"
#include "patches/reflectance.h"
#include "reconstruction/reconstruction.h"
#include "transport/direct_light.h"

namespace raybundle {
namespace {

// Pixels per mean patch area. The time to 2 % noise is flat from 1 to 4, with its least here
// (cornell_box and big_room, 5 seeds).
constexpr float kPixelsPerPatch = 2.0f;
constexpr int kMaxPlanePixels = 4096;  // along the scene's diameter
// Surfaces not further apart than these shares of the scene's radius and of a patch touch.
constexpr float kTouchOfRadius = 1e-4f;
constexpr float kTouchOfPatch = 0.02f;
// The noise falls with the number of bundles to about this power.
constexpr double kErrorSlope = 0.65;
// Relative residual of the last solve: a share of the noise, within these bounds.
constexpr double kFinalShare = 0.01, kLeastTolerance = 1e-6, kMostTolerance = 2e-4;
constexpr float kHalfTolerance = 0.05f;  // of the halves' solves, times the target error

class Stopwatch {
  public:
    explicit Stopwatch(double& seconds) : seconds(seconds), start(Clock::now()) {}
    ~Stopwatch() { seconds += std::chrono::duration<double>(Clock::now() - start).count(); }

  private:
    using Clock = std::chrono::steady_clock;
    double& seconds;
    const Clock::time_point start;
};

double sum(const glm::dvec3& v) { return v.x + v.y + v.z; }

glm::dvec3 power(const Patches& patches, size_t side, const glm::vec3& perArea) {
    return double(patches.area[side / 2]) * glm::dvec3(perArea);
}

// Edge of a pixel, metres. The same for all bundles: power per line is the same for all only then.
float pixelSize(const Patches& patches, int linesPerBundle) {
    if (linesPerBundle > 0)
        return patches.radius * std::sqrt(glm::pi<float>() / float(linesPerBundle));
    const double mean = std::min(double(patches.size) * patches.size,
                                 patches.totalArea / double(std::max<size_t>(1, patches.count())));
    return std::max(float(std::sqrt(mean / kPixelsPerPatch)), 2 * patches.radius / kMaxPlanePixels);
}

// Compares the power that the lights emit with what surfaces absorb and what leaves the scene.
void balanceEnergy(const Patches& patches, const FirstShot& shot, const Irradiance& irradiance,
                   const glm::vec3& worldRadiance, const std::vector<float>& exposedShare,
                   const std::vector<float>& openShare, Report& report) {
    const glm::vec3 worldExitance = glm::pi<float>() * worldRadiance;
    glm::dvec3 emitted = shot.emitted, absorbed(0.0), escaped = shot.escaped;
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        const double exposed = double(exposedShare[side]);
        const float open = openShare[side];
        const glm::vec3 total = irradiance.direct[side] + irradiance.indirect[side];
        emitted += exposed * power(patches, side, shot.emission[side] + open * worldExitance);
        absorbed += exposed * power(patches, side, (1.0f - patches.reflectance[side]) * total);
        escaped +=
            exposed *
            power(patches, side, open * (shot.emission[side] + patches.reflectance[side] * total));
    }
    report.emitted = sum(emitted);
    report.absorbed = sum(absorbed);
    report.escaped = sum(escaped);
}

// The share of the lines of the weighted sides that leave the scene, or stay in it, only because
// the projector lets lines through surfaces (ROULETTE): the difference to exact projection, object
// by object, so that the noise of single sides cancels.
double leakedShare(const Scene& scene, const Patches& patches, const std::vector<float>& weight,
                   const std::vector<float>& exactOpen, const std::vector<float>& open) {
    std::vector<double> difference(2 * scene.instances.size(), 0);
    double total = 0;
    for (size_t side = 0; side < weight.size(); ++side) {
        const uint32_t instance = patches.parents[patches.parentOf[side / 2]].instance;
        difference[2 * instance + side % 2] +=
            double(weight[side] * (open[side] - exactOpen[side]));
        total += double(weight[side]);
    }
    double sum = 0;
    for (double d : difference) sum += std::abs(d);
    return total > 0 ? sum / total : 0;
}

// Relative error of the light where so large a share of the exchanges is wrong: each reflection
// adds to it.
double errorByWrongExchanges(const Patches& patches, double share) {
    double reflectance = 0, area = 0;
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        const glm::vec3& rho = patches.reflectance[side];
        reflectance += double(patches.area[side / 2] * std::max({rho.x, rho.y, rho.z}));
        area += double(patches.area[side / 2]);
    }
    return area > 0 ? share / (1 - reflectance / area * (1 - share)) : 0;
}

// Whether there is nothing for bundles to carry; says so.
bool isDark(const Scene& scene, const FirstShot& shot, Report& report) {
    auto isBlack = [](const glm::vec3& v) { return v == glm::vec3(0.0f); };
    const bool isEmpty = shot.irradiance.empty();
    const bool isDark = isBlack(scene.worldRadiance) &&
                        std::all_of(shot.emission.begin(), shot.emission.end(), isBlack) &&
                        std::all_of(shot.irradiance.begin(), shot.irradiance.end(), isBlack);
    if (isEmpty)
        report.warnings.push_back("the scene has no faces");
    else if (isDark)
        report.warnings.push_back(
            "no light reaches any surface: there is no lamp, no emission and no world that does; "
            "the result is black");
    return isEmpty || isDark;
}

}  // namespace

// Patches and traced lines, which stay valid as long as the geometry does.
struct Bake::Trace {
    Trace(uint64_t hash, Patches made, const Settings& settings)
        : hash(hash), patches(std::move(made)), visibility(patches), counts(patches.sideCount()) {
        touchDistance = std::min(kTouchOfRadius * patches.radius, kTouchOfPatch * patches.size);
        const ProjectorInput input{patches,
                                   visibility,
                                   pixelSize(patches, settings.linesPerBundle),
                                   touchDistance,
                                   settings.smallPatchesKind(),
                                   settings.planeCount,
                                   settings.planePlacementKind(),
                                   settings.planeCoherence != 0,
                                   settings.linesPerBundle == 1};
        tracer = std::make_unique<BundleTracer>(settings.projector, input, settings.directions,
                                                uint32_t(settings.seed));
        // Only line reuse on exact projection sees what lies against what while it traces.
        if (settings.solver != "LINE_REUSE" || !settings.isProjectionExact()) {
            // By lists of pixels also where a bundle is one line.
            ProjectorInput exact = input;
            exact.singleLine = false;
            if (input.singleLine) exact.pixelSize = pixelSize(patches, 0);
            surrounding = surroundings(exact, uint32_t(settings.seed));
        }
    }

    // Whether all traced lines are in the counts: not after a cancel on the way, and not where a
    // transport uses lines without counting them.
    bool isWhole() const { return tracer->bundleCount() == counts.bundles; }

    // Through the bounding sphere.
    double linesPerBundle() const {
        return glm::pi<double>() * double(patches.radius) * double(patches.radius) /
               tracer->pixelArea;
    }

    const uint64_t hash;
    Patches patches;
    float touchDistance = 0;  // surfaces not further apart touch, metres
    const Visibility visibility;
    Surroundings surrounding;  // empty: as the counts have it
    LineCounts counts;
    std::unique_ptr<BundleTracer> tracer;
};

Bake::Bake() = default;
Bake::~Bake() = default;

void Bake::run(const Scene& scene) {
    checkCombination(settings);
    tbb::task_arena arena(settings.threads > 0 ? settings.threads : tbb::task_arena::automatic);
    arena.execute([&] { runStages(scene); });
}

void Bake::runStages(const Scene& scene) {
    Report report;
    {
        Stopwatch total(report.totalSeconds);
        report.warnings = scene.warnings;
        makePatches(scene, report);

        const Patches& patches = trace->patches;
        const DirectLight directLight(scene, patches, trace->visibility, uint32_t(settings.seed));
        FirstShot shot;
        {
            Stopwatch stage(report.seconds[RB_STAGE_FIRST_SHOT]);
            shot = firstShot(settings.firstShot,
                             {directLight, patches, trace->visibility, settings, progress,
                              trace->touchDistance, trace->linesPerBundle()});
        }
        report.shadowRays = shot.rays;
        report.skipped.push_back(
            {"noise of direct light", "source wholly visible: closed form", shot.unblockedSides});
        report.skipped.push_back(
            {"shadow rays", "side and source face away from each other", shot.hiddenSides});

        irradiance = Irradiance(patches.sideCount());
        std::vector<float> exposed(patches.sideCount(), 1.0f);
        if (isDark(scene, shot, report)) {
            report.skipped.push_back({"bundles and solve", "there is no light to exchange", 1});
        } else {
            const auto transport = makeTransport(
                settings.solver,
                {patches, trace->visibility, shot, scene.worldRadiance, trace->surrounding.exposed,
                 trace->touchDistance, settings, *trace->tracer, trace->counts});
            irradiance = solveToTarget(scene, shot, *transport, report);
            exposed = trace->surrounding.exposed.empty() ? trace->counts.exposedShare()
                                                         : trace->surrounding.exposed;
            balanceEnergy(patches, shot, irradiance, scene.worldRadiance, exposed,
                          transport->openShare(), report);
            report.bundles = transport->bundleCount();
        }

        Stopwatch stage(report.seconds[RB_STAGE_RECONSTRUCTION]);
        light = reconstruct(scene, patches, directLight, irradiance, exposed, settings, progress,
                            report);
    }
    report.patches = trace->patches.count();
    report.lines = trace->tracer->lineCount();
    report.exchanges = trace->counts.exchangeCount();
    json = report.json();
    ran = true;
}

void Bake::makePatches(const Scene& scene, Report& report) {
    Stopwatch stage(report.seconds[RB_STAGE_PATCHES]);
    progress.report(RB_STAGE_PATCHES, 0);
    const uint64_t hash = geometryHash(scene, settings);
    if (trace && trace->hash == hash && trace->isWhole()) {
        assignMaterials(scene, trace->patches);
        report.skipped.push_back({"patches and lines", "geometry unchanged since the last bake",
                                  trace->tracer->bundleCount()});
    } else {
        trace.reset();
        trace = std::make_unique<Trace>(
            hash, subdivide(scene, settings.patchSize, size_t(settings.maxPatches)), settings);
    }
    const Patches& patches = trace->patches;
    report.warnings.insert(report.warnings.end(), patches.warnings.begin(), patches.warnings.end());
    if (patches.degenerateFaces)
        report.skipped.push_back({"faces", "zero area", patches.degenerateFaces});
    progress.report(RB_STAGE_PATCHES, 1);
}

// Adds bundles by doubling until the difference of the two halves' estimates meets the target.
Irradiance Bake::solveToTarget(const Scene& scene, const FirstShot& shot, Transport& transport,
                               Report& report) {
    const Patches& patches = trace->patches;
    const size_t n = patches.sideCount();
    // Sides whose noise counts: those with a result.
    std::vector<float> weight(n, 0);
    std::vector<bool> wantedSides(n, false);
    bool anyBaked = false;
    for (const Instance& instance : scene.instances) anyBaked |= instance.role == RB_ROLE_BAKE;
    for (size_t side = 0; side < n; ++side) {
        const Instance& instance =
            scene.instances[patches.parents[patches.parentOf[side / 2]].instance];
        wantedSides[side] =
            !anyBaked || (instance.role == RB_ROLE_BAKE && side % 2 == size_t(instance.side));
        if (wantedSides[side]) weight[side] = patches.area[side / 2];
    }

    const uint32_t most = std::max(2u, uint32_t(settings.maxBundles) & ~1u);
    uint32_t wanted = std::max(transport.bundleCount(),
                               std::min(most, (uint32_t(settings.minBundles) + 1) & ~1u));
    for (;;) {
        if (wanted > transport.bundleCount()) {
            Stopwatch stage(report.seconds[RB_STAGE_BUNDLES]);
            transport.advance(wanted - transport.bundleCount(), progress);
        }

        Stopwatch stage(report.seconds[RB_STAGE_SOLVE]);
        const uint32_t bundles = transport.bundleCount();
        progress.report(RB_STAGE_SOLVE, std::min(1.0, double(bundles) / settings.maxBundles));
        std::array<Irradiance, 2> half;
        for (int h = 0; h < 2; ++h)
            half[h] = transport.irradiance(Half(h), kHalfTolerance * settings.targetError);
        double noise = 0, signal = 0;
        for (size_t side = 0; side < n; ++side) {
            const glm::dvec3 a(half[0].direct[side] + half[0].indirect[side]);
            const glm::dvec3 b(half[1].direct[side] + half[1].indirect[side]);
            const double directVariance = double(shot.error[side]) * shot.error[side];
            noise += weight[side] * (0.25 * glm::dot(a - b, a - b) + 3 * directVariance);
            signal += weight[side] * 0.25 * glm::dot(a + b, a + b);
        }
        const double bias = transport.bias();
        report.estimatedError = signal > 0 ? std::sqrt(noise / signal + bias * bias) : 0;

        if (report.estimatedError <= settings.targetError) break;
        if (bundles >= most) {
            report.warnings.push_back(
                "max_bundles was reached at " + std::to_string(bundles) +
                " bundles: the noise is " + std::to_string(100 * report.estimatedError) +
                " % and not below " + std::to_string(100 * settings.targetError) + " %");
            break;
        }
        // Double at most; less where the error's slope says that less will do.
        const double factor =
            std::pow(report.estimatedError / settings.targetError, 1 / kErrorSlope);
        wanted = std::min(most, (uint32_t(bundles * std::min(2.0, 1.05 * factor)) + 2) & ~1u);
    }

    Stopwatch stage(report.seconds[RB_STAGE_SOLVE]);
    const float tolerance =
        float(std::clamp(kFinalShare * report.estimatedError, kLeastTolerance, kMostTolerance));
    Irradiance irradiance = transport.finish(tolerance, wantedSides, report);

    if (const uint64_t cycles = trace->tracer->cycleCount())
        report.warnings.push_back(std::to_string(cycles) +
                                  " cycles of patches that cover each other were broken anywhere: "
                                  "the projector AUTO has none");

    // What more bundles do not help.
    double wrong = trace->tracer->disorderedShare();
    if (settings.smallPatches == "ROULETTE")
        wrong +=
            leakedShare(scene, patches, weight, trace->surrounding.open, transport.openShare());
    if (wrong > 0) {
        const double error = errorByWrongExchanges(patches, wrong);
        report.estimatedError = std::hypot(report.estimatedError, error);
        if (error > settings.targetError)
            report.warnings.push_back("the projector put " + std::to_string(100 * wrong) +
                                      " % of the lines in a wrong order or through surfaces, which "
                                      "more bundles do not mend: the error is about " +
                                      std::to_string(100 * error) + " %");
    }
    progress.report(RB_STAGE_SOLVE, 1);
    return irradiance;
}

const Patches& Bake::patches() const { return trace->patches; }

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
