// SPDX-License-Identifier: GPL-3.0-or-later
//
// Measures the inner loops of a bake one by one, so that a change can be judged within a minute.
// Usage: micro SCENE.json [options of Google Benchmark] [--threads N]
// The script of the same name exports a scene first.
//
// The loops run on one thread, or with --threads N on N threads where they are parallel (Merge,
// Solve, ...).
//   Project           projects a bundle with the default pixels; reports lines and fragments per
//                     second
//   Project10k        projects a bundle of 100 x 100 lines over 20 000 patches, as in the thesis
//   Merge             adds 128 bundles to the line counts of 128 other bundles
//   Solve             solves both halves of 256 bundles, to a tenth of the default target
//   ShadowRays        casts rays from patches to a point light at the centre of the scene
//   ClosestHits       casts cosine-distributed rays from patches
//   FirstShotGather   runs the first shot at the default target
//   LeastSquares      reconstructs one field of light on all objects
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include "bake/bake.h"
#include "bundles/bundle_tracer.h"
#include "bundles/fragment_lists.h"
#include "bundles/line_counts.h"
#include "direct_light/direct_light.h"
#include "first_shot/first_shot.h"
#include "patches/patches.h"
#include "reconstruction/least_squares.h"
#include "reconstruction/reconstruction.h"
#include "reconstruction/smooth_regions.h"
#include "sampling/sobol.h"
#include "sampling/sphere_sampling.h"
#include "scene_file.h"
#include "transport/line_reuse.h"
#include "visibility/visibility.h"

namespace raybundle::bench {
namespace {

constexpr float kPixelsPerPatch = 2;  // as in bake/trace.cpp
constexpr uint32_t kTraced = 256, kMerged = 128;
constexpr uint32_t kRays = 1024;  // number of precomputed Sobol points

// A scene prepared for tracing.
struct Subject {
    explicit Subject(const std::string& path)
        : scene(readScene(path)),
          patches(subdivide(scene, 0, size_t(settings.maxPatches))),
          visibility(patches),
          pixelSize(std::sqrt(patches.totalArea / double(patches.count()) / kPixelsPerPatch)) {}

    ProjectorInput input(float pixels) const { return {patches, visibility, pixels}; }
    std::vector<TracedBundle> trace(uint32_t count) const {
        BundleTracer tracer(ProjectorKind::FRAGMENT_LISTS, input(float(pixelSize)),
                            DirectionKind::LOW_DISCREPANCY, 0);
        return tracer.trace(count);
    }

    const Settings settings;
    const Scene scene;
    const Patches patches;
    const Visibility visibility;
    const double pixelSize;
};

std::unique_ptr<const Subject> subject;

void project(benchmark::State& state, const Patches& patches, float pixelSize) {
    FragmentLists lists(patches, pixelSize, SmallPatches::CENTRE_SAMPLING, {});
    const std::vector<Bundle> bundles = Directions(DirectionKind::LOW_DISCREPANCY, 0).next(64);
    size_t lines = 0, fragments = 0, exchanges = 0, k = 0;
    for (auto _ : state) {
        BundleLines out;
        lists.project(bundles[k++ % bundles.size()], out);
        benchmark::DoNotOptimize(out);
        lines += out.lines;
        fragments += out.sky.size() / 2 + out.touching.size() / 2;
        for (const Exchange& e : out.exchanges) exchanges += e.lines;
    }
    fragments += exchanges;
    state.counters["lines"] = benchmark::Counter(double(lines), benchmark::Counter::kIsRate);
    state.counters["exchanges"] =
        benchmark::Counter(double(exchanges), benchmark::Counter::kIsRate);
    state.counters["outlines"] = double(patches.sheets.sheets.size() + patches.sheets.loose.size());
    state.counters["fragments"] =
        benchmark::Counter(double(fragments), benchmark::Counter::kIsRate);
}

void Project(benchmark::State& state) {
    project(state, subject->patches, float(subject->pixelSize));
}
BENCHMARK(Project)->Unit(benchmark::kMicrosecond);

void Project10k(benchmark::State& state) {
    const float size = float(std::sqrt(subject->patches.totalArea / 20000));
    const Patches patches = subdivide(subject->scene, size, 1 << 20);
    // The disk of the bounding sphere has 10 000 pixels.
    project(state, patches, patches.radius * std::sqrt(3.14159265f / 10000));
    state.counters["patches"] = double(patches.count());
}
BENCHMARK(Project10k)->Unit(benchmark::kMicrosecond);

void Merge(benchmark::State& state) {
    std::vector<TracedBundle> first = subject->trace(kTraced);
    const std::vector<TracedBundle> next(first.end() - kMerged, first.end());
    first.resize(kTraced - kMerged);
    for (auto _ : state) {
        state.PauseTiming();
        LineCounts counts(subject->patches.sideCount());
        counts.add(first);
        state.ResumeTiming();
        counts.add(next);
        benchmark::DoNotOptimize(counts.exchangeCount());
    }
    size_t exchanges = 0;
    for (const TracedBundle& traced : next) exchanges += traced.lines.exchanges.size();
    state.SetItemsProcessed(int64_t(state.iterations() * exchanges));
}
BENCHMARK(Merge)->Unit(benchmark::kMillisecond);

FirstShot shootAll(const DirectLight& light) {
    const Progress progress;
    return gather({light, subject->patches, subject->visibility, subject->settings, progress});
}

void Solve(benchmark::State& state) {
    LineCounts counts(subject->patches.sideCount());
    counts.add(subject->trace(kTraced));
    const DirectLight light(subject->scene, subject->patches, subject->visibility, 0);
    const FirstShot shot = shootAll(light);
    const std::vector<float> exposed;
    const LineReuse lines(subject->patches, counts, shot, subject->scene.worldRadiance, exposed);
    for (auto _ : state)
        for (Half half : {Half(0), Half(1)}) {
            std::vector<glm::vec3> reflected(counts.sideCount(), glm::vec3(0.0f));
            benchmark::DoNotOptimize(
                lines.solve(half, 0.1f * subject->settings.targetError, reflected));
        }
    // The rows may hold a pair more than once.
    size_t pairs = 0;
    for (uint32_t i = 0; i < counts.sideCount(); ++i) pairs += counts.row(i).size();
    pairs /= 2;
    state.counters["pairs"] = double(pairs);
    state.counters["bytes per pair"] = double(counts.byteCount()) / double(pairs);
}
BENCHMARK(Solve)->Unit(benchmark::kMillisecond);

template <class Ray>
void shootRays(benchmark::State& state, const Ray& ray) {
    const Patches& patches = subject->patches;
    for (auto _ : state)
        for (uint32_t i = 0; i < kRays; ++i) {
            const glm::vec4 u = sobolPoint(i, 1);
            const uint32_t side = 2 * uint32_t(u.z * float(patches.count()));
            benchmark::DoNotOptimize(ray(side, patches.point(side / 2, {u.x, u.y}), u));
        }
    state.SetItemsProcessed(int64_t(state.iterations() * kRays));
}

void ShadowRays(benchmark::State& state) {
    shootRays(state, [](uint32_t side, const glm::vec3& point, const glm::vec4&) {
        const glm::vec3 to = -point;  // towards the centre of the scene
        const float distance = std::max(glm::length(to), 1e-6f);
        return subject->visibility.visibleShare(side, {point, to / distance, distance});
    });
}
BENCHMARK(ShadowRays);

void ClosestHits(benchmark::State& state) {
    shootRays(state, [](uint32_t side, const glm::vec3& point, const glm::vec4& u) {
        return subject->visibility.firstHit(
            side, point, cosineDirection(subject->patches.normal(side), {u.w, u.x}));
    });
}
BENCHMARK(ClosestHits);

void FirstShotGather(benchmark::State& state) {
    for (auto _ : state) {
        const DirectLight light(subject->scene, subject->patches, subject->visibility, 0);
        benchmark::DoNotOptimize(shootAll(light));
    }
}
BENCHMARK(FirstShotGather)->Unit(benchmark::kMillisecond);

void LeastSquares(benchmark::State& state) {
    const Scene& scene = subject->scene;
    const Patches& patches = subject->patches;
    const std::vector<InstanceRange> ranges = instanceRanges(scene, patches);
    const std::vector<float> exposed(patches.sideCount(), 1.0f);
    std::vector<glm::vec3> field(patches.sideCount());
    for (uint32_t side = 0; side < field.size(); ++side)
        field[side] = glm::vec3(sobolPoint(side, 2));
    for (auto _ : state)
        for (size_t i = 0; i < ranges.size(); ++i) {
            const Instance& instance = scene.instances[i];
            if (instance.role != RB_ROLE_BAKE) continue;
            const SmoothRegions regions =
                smoothRegions(scene.meshes[size_t(instance.mesh)], patches.cells,
                              ranges[i].firstCell, ranges[i].lastCell);
            benchmark::DoNotOptimize(leastSquares({patches, exposed},
                                                  {ranges[i], regions, instance.side},
                                                  subject->settings.regularization, {&field}));
        }
}
BENCHMARK(LeastSquares)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace raybundle::bench

int main(int count, char** values) {
    benchmark::Initialize(&count, values);
    int threads = 1;
    if (count == 4 && std::strcmp(values[2], "--threads") == 0) {
        threads = std::atoi(values[3]);
        count = 2;
    }
    if (count != 2 || threads < 1) {
        std::fputs("usage: micro SCENE.json [options of Google Benchmark] [--threads N]\n", stderr);
        return 2;
    }
    try {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                        size_t(threads));
        raybundle::bench::subject = std::make_unique<raybundle::bench::Subject>(values[1]);
        benchmark::RunSpecifiedBenchmarks();
        raybundle::bench::subject.reset();
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "micro: %s\n", error.what());
        return 2;
    }
}
