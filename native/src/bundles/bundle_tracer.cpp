// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundles/bundle_tracer.h"

#include <numeric>

#include "job/cancellation.h"

namespace raybundle {

namespace {
constexpr uint32_t kExactBundles = 32;

void joinClusters(const Clusters& clusters, BundleLines& lines) {
    for (Exchange& e : lines.exchanges) e = {clusters.sideOf(e.i), clusters.sideOf(e.j), e.lines};
    for (uint32_t& side : lines.sky) side = clusters.sideOf(side);
    for (uint32_t& side : lines.touching) side = clusters.sideOf(side);
}

}  // namespace

BundleTracer::BundleTracer(ProjectorKind projector, const ProjectorInput& input,
                           DirectionKind directions, uint32_t seed, const Clusters* clusters)
    : pixelArea(double(input.pixelSize) * double(input.pixelSize)),
      directions(directions, seed),
      clusters(clusters && !clusters->isNone() ? clusters : nullptr),
      projectors([projector, input] { return makeProjector(projector, input); }) {}

std::vector<TracedBundle> BundleTracer::trace(uint32_t count) {
    const std::vector<Bundle> sequence = directions.next(count);
    std::vector<TracedBundle> traced(sequence.size());
    std::vector<uint64_t> joined(sequence.size());  // per bundle: number of lines of its exchanges
    parallelFor(size_t(0), sequence.size(), [&](size_t k) {
        traced[k].bundle = sequence[k];
        projectors.local()->project(sequence[k], traced[k].lines);
        if (clusters) joinClusters(*clusters, traced[k].lines);
        for (const Exchange& e : traced[k].lines.exchanges) joined[k] += e.lines;
    });
    bundles += count;
    exchanges = std::accumulate(joined.begin(), joined.end(), exchanges);
    for (const TracedBundle& t : traced) {
        lines += t.lines.lines;
        drawn += t.lines.drawn;
        disordered += t.lines.disordered;
        cycles += t.lines.cycles;
    }
    return traced;
}

Surroundings surroundings(const ProjectorInput& input, uint32_t seed) {
    if (input.patches.count() == 0) return {};
    // ROULETTE is not used here, since it lets neighbouring patches of a surface touch each other.
    ProjectorInput exact = input;
    exact.smallPatches = SmallPatches::CENTRE_SAMPLING;
    BundleTracer tracer(ProjectorKind::FRAGMENT_LISTS, exact, DirectionKind::LOW_DISCREPANCY, seed);
    std::vector<uint32_t> lines(input.patches.sideCount(), 0), sky(lines), touching(lines);
    for (const TracedBundle& traced : tracer.trace(kExactBundles)) {
        for (const Exchange& e : traced.lines.exchanges) {
            lines[e.i] += e.lines;
            lines[e.j] += e.lines;
        }
        for (uint32_t side : traced.lines.sky) {
            ++lines[side];
            ++sky[side];
        }
        for (uint32_t side : traced.lines.touching) ++touching[side];
    }
    Surroundings result{std::vector<float>(lines.size(), 1.0f),
                        std::vector<float>(lines.size(), 0.0f)};
    for (size_t i = 0; i < lines.size(); ++i) {
        const float all = float(lines[i] + touching[i]);
        if (touching[i] > 0) result.exposed[i] = float(lines[i]) / all;
        if (lines[i] > 0) result.open[i] = float(sky[i]) / float(lines[i]);
    }
    return result;
}

}  // namespace raybundle
