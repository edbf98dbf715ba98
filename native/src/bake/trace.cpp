// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/trace.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "reconstruction/corner_gather.h"
#include "reconstruction/shown_light.h"
#include "visibility/exposed_share.h"

namespace raybundle {
namespace {

// Pixels per mean patch area. The time to 2 % noise is nearly constant from 1 to 4, with its
// minimum at this value (cornell_box and big_room, 5 seeds).
constexpr float kPixelsPerPatch = 2.0f;
// Pixels per mean patch area outside of windows of finer pixels. Most lines should be in the
// windows.
constexpr float kPixelsPerPatchAround = 0.25f;
constexpr int kMaxPlanePixels = 4096;  // along the diameter of the scene or the island

// Returns the edge of a pixel, m, from the mean area of `count` patches with the total area `area`
// (m^2). The mean counts as size * size at most (`size` in m). `radius` is the radius of the scene
// or the island, m.
float pixelSize(double area, size_t count, float size, float radius) {
    const double mean =
        std::min(double(size) * double(size), area / double(std::max<size_t>(1, count)));
    return std::max(float(std::sqrt(mean / double(kPixelsPerPatch))), 2 * radius / kMaxPlanePixels);
}

// Returns one edge for the pixels of all patches and bundles, m. Every line carries the same power
// only if all pixels are equal.
float pixelSize(const Patches& patches, int linesPerBundle) {
    if (linesPerBundle > 0)
        return patches.radius * std::sqrt(glm::pi<float>() / float(linesPerBundle));
    return pixelSize(patches.totalArea, patches.tileCount, patches.size, patches.radius);
}

// Returns the density of lines, with windows of finer pixels around small patches.
LineDensity densityOf(const Patches& patches) {
    std::vector<double> area(patches.islands.size(), 0);
    std::vector<size_t> count(area.size(), 0);
    for (const Parent& parent : patches.parents) area[parent.island] += double(parent.area());
    for (const uint32_t parent : patches.parentOf) ++count[patches.parents[parent].island];
    std::vector<float> pixels, least;
    for (size_t k = 0; k < area.size(); ++k) {
        const Island& island = patches.islands[k];
        pixels.push_back(pixelSize(area[k], count[k], island.size, island.radius));
        least.push_back(2 * island.radius / kMaxPlanePixels);
    }
    return densityByDetail(patches, pixels, kPixelsPerPatchAround, least);
}

}  // namespace

Clusters clustersOf(const Scene& scene, const Patches& patches, const Settings& settings) {
    if (!settings.skipClusters || !settings.hasLineWindows() || !settings.gathersFirstShot())
        return Clusters(patches);
    return Clusters(patches, shownSides(scene, patches, settings), size_t(settings.maxPatches));
}

Trace::Trace(uint64_t hash, uint64_t likeness, Patches made, const Scene& scene,
             const Settings& settings)
    : hash(hash),
      likeness(likeness),
      patches(std::move(made)),
      clusters(clustersOf(scene, patches, settings)),
      visibility(patches),
      counts(0) {
    for (const Parent& parent : patches.parents)
        if (parent.stopsDirect != parent.exchanges && !directVisibility)
            directVisibility =
                std::make_unique<const Visibility>(patches, Blockers::STOPPING_DIRECT);
    if (settings.hasLineWindows() && patches.count() > 0)
        density = densityOf(clusters.patches());
    else
        density.pixelSize = pixelSize(patches, settings.linesPerBundle);
}

void Trace::startLines(const Settings& settings) {
    const ProjectorInput input = projectorInput(settings);
    if (!settings.skipSheets || input.smallPatches == SmallPatches::ROULETTE || input.singleLine)
        patches.sheets = withoutSheets(patches);
    counts = LineCounts(clusters.patches().sideCount());
    tracer = std::make_unique<BundleTracer>(settings.projector, input, settings.directions,
                                            uint32_t(settings.seed), &clusters);
    // Only line reuse with exact projection finds out while it traces which surfaces touch.
    if (!settings.countsLines() || !settings.isProjectionExact())
        surrounding = surroundingsOf(settings);
}

void Trace::measureExposedShare(uint32_t seed) {
    if (!surrounding.exposed.empty() || exposedFrom == counts.bundles) return;
    const std::vector<uint32_t> sides = counts.coveredInPart();
    const std::vector<float> share = exposedShareOf(sides, visibility, clusters, seed);
    for (size_t k = 0; k < sides.size(); ++k) counts.setExposedShare(sides[k], share[k]);
    exposedFrom = counts.bundles;
}

Surroundings Trace::surroundingsOf(const Settings& settings) const {
    const uint32_t seed = uint32_t(settings.seed);
    Surroundings result = surroundings(exactInput(settings), seed);
    std::vector<uint32_t> sides;
    for (uint32_t side = 0; side < result.exposed.size(); ++side)
        if (result.exposed[side] > 0 && result.exposed[side] < 1) sides.push_back(side);
    const std::vector<float> share = exposedShareOf(sides, visibility, Clusters(patches), seed);
    for (size_t k = 0; k < sides.size(); ++k) result.exposed[sides[k]] = share[k];
    return result;
}

ProjectorInput Trace::projectorInput(const Settings& settings) const {
    return {patches,
            visibility,
            density.pixelSize,
            settings.smallPatches,
            settings.planeCount,
            settings.planePlacement,
            settings.planeCoherence != 0,
            settings.linesPerBundle == 1,
            density.windows};
}

ProjectorInput Trace::exactInput(const Settings& settings) const {
    ProjectorInput exact = projectorInput(settings);
    if (exact.singleLine) exact.pixelSize = pixelSize(patches, 0);
    exact.singleLine = false;
    return exact;
}

const StandIns& Trace::standInsFor(const std::vector<bool>* isShown, uint64_t aims) {
    if (!standIns || standIns->aims != aims)
        standIns.emplace(AimedStandIns{aims, StandIns(patches, isShown, clusters.coarseness())});
    return standIns->standIns;
}

double Trace::linesPerBundle() const {
    return glm::pi<double>() * double(patches.radius) * double(patches.radius) /
           (double(density.pixelSize) * double(density.pixelSize));
}

std::vector<float> Trace::linesMet() const {
    std::vector<float> lines(counts.sideCount());
    for (uint32_t side = 0; side < lines.size(); ++side) lines[side] = float(counts.linesMet(side));
    return clusters.spread(lines);
}

std::vector<std::array<float, 2>> Trace::linesByHalf() const {
    std::vector<float> met = linesMet();
    std::vector<std::array<float, 2>> lines(met.size());
    for (uint32_t side = 0; side < lines.size(); ++side) {
        const std::array<uint32_t, 2>& total = counts.total[clusters.sideOf(side)];
        const float all = float(total[0]) + float(total[1]);
        for (size_t h = 0; h < 2; ++h)
            lines[side][h] = all > 0 ? met[side] * float(total[h]) / all : 0;
    }
    return lines;
}

double Trace::linesMetByAll() const {
    double lines = 0;
    for (uint32_t side = 0; side < counts.sideCount(); ++side) lines += counts.linesMet(side);
    return lines;
}

}  // namespace raybundle
