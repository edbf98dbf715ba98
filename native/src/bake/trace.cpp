// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/trace.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

namespace raybundle {
namespace {

// Pixels per mean patch area. The time to 2 % noise is flat from 1 to 4, with its least here
// (cornell_box and big_room, 5 seeds).
constexpr float kPixelsPerPatch = 2.0f;
// The same outside of windows of finer pixels: most lines are to be in the windows.
constexpr float kPixelsPerPatchAround = 0.25f;
constexpr int kMaxPlanePixels = 4096;  // along the scene's diameter
// Surfaces not further apart than these shares of the scene's radius and of a patch touch.
constexpr float kTouchOfRadius = 1e-4f;
constexpr float kTouchOfPatch = 0.02f;

// Edge of a pixel, metres. The same for all bundles: power per line is the same for all only then.
float pixelSize(const Patches& patches, int linesPerBundle) {
    if (linesPerBundle > 0)
        return patches.radius * std::sqrt(glm::pi<float>() / float(linesPerBundle));
    const double mean =
        std::min(double(patches.size) * patches.size,
                 patches.totalArea / double(std::max<size_t>(1, patches.tileCount)));
    return std::max(float(std::sqrt(mean / kPixelsPerPatch)), 2 * patches.radius / kMaxPlanePixels);
}

}  // namespace

Trace::Trace(uint64_t hash, Patches made, const Settings& settings)
    : hash(hash), patches(std::move(made)), visibility(patches), counts(0) {
    for (const Parent& parent : patches.parents)
        if (parent.stopsDirect != parent.exchanges && !directVisibility)
            directVisibility =
                std::make_unique<const Visibility>(patches, Blockers::STOPPING_DIRECT);
    touchDistance = std::min(kTouchOfRadius * patches.radius, kTouchOfPatch * patches.finest);
    density.pixelSize = pixelSize(patches, settings.linesPerBundle);
    // Small patches get windows of finer pixels.
    if (settings.hasLineWindows())
        density = densityByDetail(patches, density.pixelSize, kPixelsPerPatchAround,
                                  2 * patches.radius / kMaxPlanePixels);
}

void Trace::startLines(const Settings& settings) {
    const ProjectorInput input = projectorInput(settings);
    if (!settings.skipSheets || input.smallPatches == SmallPatches::ROULETTE || input.singleLine)
        patches.sheets = withoutSheets(patches);
    counts = LineCounts(patches.sideCount());
    tracer = std::make_unique<BundleTracer>(settings.projector, input, settings.directions,
                                            uint32_t(settings.seed));
    // Only line reuse on exact projection sees what lies against what while it traces.
    if (settings.solver != "LINE_REUSE" || !settings.isProjectionExact())
        surrounding = surroundings(exactInput(settings), uint32_t(settings.seed));
}

ProjectorInput Trace::projectorInput(const Settings& settings) const {
    return {patches,
            visibility,
            density.pixelSize,
            touchDistance,
            settings.smallPatchesKind(),
            settings.planeCount,
            settings.planePlacementKind(),
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

double Trace::linesPerBundle() const {
    return glm::pi<double>() * double(patches.radius) * double(patches.radius) /
           (double(density.pixelSize) * double(density.pixelSize));
}

}  // namespace raybundle
