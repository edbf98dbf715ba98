// SPDX-License-Identifier: GPL-3.0-or-later
//
// The bake on one page: patches, first shot, bundles, solve, reconstruction.
// Sources: the two-step structure is that of thesis section 5.2 (first shot, then bundles); the
// stop criterion stands for section 4.3.3. Differs: see the heads of the stages' files.
#include "bake/bake.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "bake/geometry_hash.h"
#include "bundles/fragment_lists.h"
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
// Sides with fewer lines than this also gather with local rays.
constexpr uint32_t kStarvedLines = 16;
// The noise falls with the number of bundles to about this power.
constexpr double kErrorSlope = 0.65;
// Relative residual of the last solve: a share of the noise, within these bounds.
constexpr double kFinalShare = 0.01, kLeastTolerance = 1e-6, kMostTolerance = 2e-4;
constexpr float kHalfTolerance = 0.05f;  // of the halves' solves, times the target error
// Lines held before they are merged into the counts, bytes.
constexpr size_t kMergeBytes = size_t(256) << 20;

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

}  // namespace

// Patches and traced lines, which stay valid as long as the geometry does.
struct Bake::Trace {
    Trace(uint64_t hash, Patches made)
        : hash(hash), patches(std::move(made)), visibility(patches), counts(patches.sideCount()) {}

    const uint64_t hash;
    Patches patches;
    const Visibility visibility;
    LineCounts counts;
    uint32_t bundles = 0;
    float pixelSize = 0;  // metres
};

// What the solve found, per side, W/m^2.
struct Bake::Solution {
    explicit Solution(size_t sides) : irradiance(sides), reflected(sides) {}

    Irradiance irradiance;
    std::vector<glm::vec3> reflected;  // exitance without emission
};

Bake::Bake() = default;
Bake::~Bake() = default;

void Bake::run(const Scene& scene) {
    tbb::task_arena arena(settings.threads > 0 ? settings.threads : tbb::task_arena::automatic);
    arena.execute([&] { runStages(scene); });
}

void Bake::runStages(const Scene& scene) {
    Report report;
    {
        Stopwatch total(report.totalSeconds);
        report.warnings = scene.warnings;
        makePatches(scene, report);

        const DirectLight directLight(scene, trace->patches, trace->visibility,
                                      uint32_t(settings.seed));
        FirstShot shot;
        {
            Stopwatch stage(report.seconds[RB_STAGE_FIRST_SHOT]);
            shot = gatherFirstShot(directLight, trace->patches, settings.targetError, progress);
        }
        report.shadowRays = shot.rays;
        report.skipped.push_back(
            {"noise of direct light", "source wholly visible: closed form", shot.unblockedSides});
        report.skipped.push_back(
            {"shadow rays", "side and source face away from each other", shot.hiddenSides});

        const Solution solution = solveToTarget(scene, shot, report);
        balanceEnergy(shot, solution, scene, report);

        Stopwatch stage(report.seconds[RB_STAGE_RECONSTRUCTION]);
        light = reconstruct(scene, trace->patches, directLight, solution.irradiance,
                            trace->counts.exposedShare(), settings, progress, report);
    }
    report.patches = trace->patches.count();
    report.bundles = trace->bundles;
    report.lines = trace->counts.lines;
    report.exchanges = trace->counts.exchangeCount();
    json = report.json();
    ran = true;
}

void Bake::makePatches(const Scene& scene, Report& report) {
    Stopwatch stage(report.seconds[RB_STAGE_PATCHES]);
    progress.report(RB_STAGE_PATCHES, 0);
    const uint64_t hash = geometryHash(scene, settings);
    if (trace && trace->hash == hash) {
        assignMaterials(scene, trace->patches);
        report.skipped.push_back(
            {"patches and lines", "geometry unchanged since the last bake", trace->bundles});
    } else {
        trace.reset();
        trace = std::make_unique<Trace>(
            hash, subdivide(scene, settings.patchSize, size_t(settings.maxPatches)));
        const Patches& patches = trace->patches;
        // Fix the pixel for all bundles: power per line is the same for all only then.
        const double mean =
            std::min(double(patches.size) * patches.size,
                     patches.totalArea / double(std::max<size_t>(1, patches.count())));
        trace->pixelSize =
            settings.linesPerBundle > 0
                ? patches.radius * std::sqrt(glm::pi<float>() / float(settings.linesPerBundle))
                : std::max(float(std::sqrt(mean / kPixelsPerPatch)),
                           2 * patches.radius / kMaxPlanePixels);
    }
    const Patches& patches = trace->patches;
    report.warnings.insert(report.warnings.end(), patches.warnings.begin(), patches.warnings.end());
    if (patches.degenerateFaces)
        report.skipped.push_back({"faces", "zero area", patches.degenerateFaces});
    progress.report(RB_STAGE_PATCHES, 1);
}

// Adds bundles by doubling until the difference of the two halves' solutions meets the target, then
// solves on all lines.
Bake::Solution Bake::solveToTarget(const Scene& scene, const FirstShot& shot, Report& report) {
    const Patches& patches = trace->patches;
    const size_t n = patches.sideCount();
    const LineReuse solver(patches, trace->counts, shot.irradiance, shot.emission,
                           scene.worldRadiance);
    Solution solution(n);

    auto isBlack = [](const glm::vec3& v) { return v == glm::vec3(0.0f); };
    const bool isDark = isBlack(scene.worldRadiance) &&
                        std::all_of(shot.emission.begin(), shot.emission.end(), isBlack) &&
                        std::all_of(shot.irradiance.begin(), shot.irradiance.end(), isBlack);
    if (n == 0) report.warnings.push_back("the scene has no faces");
    if (n > 0 && isDark)
        report.warnings.push_back(
            "no light reaches any surface: there is no lamp, no emission and no "
            "world that does; the result is black");
    if (n == 0 || isDark) {
        report.skipped.push_back({"bundles and solve", "there is no light to exchange", 1});
        return solution;
    }

    // Sides whose noise counts: those with a result.
    std::vector<float> weight(n, 0);
    bool anyBaked = false;
    for (const Instance& instance : scene.instances) anyBaked |= instance.role == RB_ROLE_BAKE;
    for (size_t side = 0; side < n; ++side) {
        const Instance& instance =
            scene.instances[patches.parents[patches.parentOf[side / 2]].instance];
        if (!anyBaked || (instance.role == RB_ROLE_BAKE && side % 2 == size_t(instance.side)))
            weight[side] = patches.area[side / 2];
    }

    std::array<std::vector<glm::vec3>, 2> reflected{solution.reflected, solution.reflected};
    const uint32_t most = std::max(2u, uint32_t(settings.maxBundles) & ~1u);
    uint32_t wanted =
        std::max(trace->bundles, std::min(most, (uint32_t(settings.minBundles) + 1) & ~1u));
    for (;;) {
        if (wanted > trace->bundles) traceBundles(wanted - trace->bundles, report);

        Stopwatch stage(report.seconds[RB_STAGE_SOLVE]);
        progress.report(RB_STAGE_SOLVE,
                        std::min(1.0, double(trace->bundles) / settings.maxBundles));
        std::array<Irradiance, 2> half;
        for (int h = 0; h < 2; ++h)
            half[h] = solver.solve(Half(h), kHalfTolerance * settings.targetError, reflected[h]);
        double noise = 0, signal = 0;
        for (size_t side = 0; side < n; ++side) {
            const glm::dvec3 a(half[0].direct[side] + half[0].indirect[side]);
            const glm::dvec3 b(half[1].direct[side] + half[1].indirect[side]);
            const double directVariance = double(shot.error[side]) * shot.error[side];
            noise += weight[side] * (0.25 * glm::dot(a - b, a - b) + 3 * directVariance);
            signal += weight[side] * 0.25 * glm::dot(a + b, a + b);
        }
        report.estimatedError = signal > 0 ? std::sqrt(noise / signal) : 0;

        const bool full = 2 * trace->counts.byteCount() > size_t(settings.memoryLimit * 1e6);
        if (report.estimatedError <= settings.targetError) break;
        if (trace->bundles >= most || full) {
            report.warnings.push_back(
                std::string(full ? "memory_limit" : "max_bundles") + " was reached at " +
                std::to_string(trace->bundles) + " bundles: the noise is " +
                std::to_string(100 * report.estimatedError) + " % and not below " +
                std::to_string(100 * settings.targetError) + " %");
            break;
        }
        // Double at most; less where the error's slope says that less will do.
        const double factor =
            std::pow(report.estimatedError / settings.targetError, 1 / kErrorSlope);
        wanted =
            std::min(most, (uint32_t(trace->bundles * std::min(2.0, 1.05 * factor)) + 2) & ~1u);
    }

    Stopwatch stage(report.seconds[RB_STAGE_SOLVE]);
    for (size_t side = 0; side < n; ++side)
        solution.reflected[side] = 0.5f * (reflected[0][side] + reflected[1][side]);
    const float tolerance =
        float(std::clamp(kFinalShare * report.estimatedError, kLeastTolerance, kMostTolerance));
    solution.irradiance = solver.solve(Half::BOTH, tolerance, solution.reflected);
    std::vector<bool> hasResult(n);
    for (size_t side = 0; side < n; ++side) hasResult[side] = weight[side] > 0;
    const size_t starved =
        solver.gatherStarvedSides(trace->visibility, kStarvedLines, uint32_t(settings.seed),
                                  hasResult, solution.reflected, solution.irradiance);
    if (starved)
        report.skipped.push_back({"bundles on small patches",
                                  "too few lines met them: they gathered with local rays",
                                  starved});
    progress.report(RB_STAGE_SOLVE, 1);
    return solution;
}

// Traces the next bundles of the sequence and merges their lines into the counts.
void Bake::traceBundles(uint32_t count, Report& report) {
    Stopwatch stage(report.seconds[RB_STAGE_BUNDLES]);
    // A cancel or failure on the way drops the trace: its number of bundles would no longer be
    // known.
    std::unique_ptr<Trace> target = std::move(trace);
    const Patches& patches = target->patches;
    const float touchDistance =
        std::min(kTouchOfRadius * patches.radius, kTouchOfPatch * patches.size);
    const std::vector<Bundle> sequence =
        bundles(settings.directionKind(), uint32_t(settings.seed), target->bundles, count);

    tbb::enumerable_thread_specific<FragmentLists> projectors(
        [&] { return FragmentLists(patches, target->pixelSize, touchDistance); });
    using Lines = std::array<std::vector<BundleLines>, 2>;
    Lines lines;
    size_t bytes = 0;
    const size_t step = 4 * size_t(std::max(1, tbb::this_task_arena::max_concurrency()));
    for (size_t from = 0; from < sequence.size(); from += step) {
        progress.report(RB_STAGE_BUNDLES, double(from) / double(sequence.size()));
        const size_t to = std::min(from + step, sequence.size());
        std::vector<BundleLines> traced(to - from);
        tbb::parallel_for(
            from, to, [&](size_t k) { projectors.local().project(sequence[k], traced[k - from]); });
        for (size_t k = from; k < to; ++k) {
            bytes += traced[k - from].byteCount();
            lines[sequence[k].half].push_back(std::move(traced[k - from]));
        }
        if (bytes > kMergeBytes || to == sequence.size()) {
            target->counts.add(lines);
            lines = Lines();
            bytes = 0;
        }
    }
    target->bundles += count;
    trace = std::move(target);
    progress.report(RB_STAGE_BUNDLES, 1);
}

// Compares the power that the lights emit with what surfaces absorb and what leaves the scene.
void Bake::balanceEnergy(const FirstShot& shot, const Solution& solution, const Scene& scene,
                         Report& report) const {
    const Patches& patches = trace->patches;
    const LineCounts& counts = trace->counts;
    const glm::vec3 worldExitance = glm::pi<float>() * scene.worldRadiance;
    const std::vector<float> share = counts.exposedShare();
    const std::vector<double> exposed(share.begin(), share.end());
    glm::dvec3 emitted = shot.emitted, absorbed(0.0), escaped = shot.escaped;
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        const glm::vec3 total =
            solution.irradiance.direct[side] + solution.irradiance.indirect[side];
        emitted += exposed[side] * power(patches, side, shot.emission[side]);
        absorbed +=
            exposed[side] * power(patches, side, (1.0f - patches.reflectance[side]) * total);
        const float m = float(counts.total[side][0] + counts.total[side][1]);
        if (m == 0) continue;
        const float open = float(counts.sky[side][0] + counts.sky[side][1]) / m;
        emitted += exposed[side] * power(patches, side, open * worldExitance);
        escaped +=
            exposed[side] *
            power(patches, side, open * (shot.emission[side] + patches.reflectance[side] * total));
    }
    report.emitted = sum(emitted);
    report.absorbed = sum(absorbed);
    report.escaped = sum(escaped);
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
