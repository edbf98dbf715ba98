// SPDX-License-Identifier: GPL-3.0-or-later
//
// LINE_REUSE on surfaces that are not Lambert's: the light that lines bring depends on the
// direction in which light of the sources leaves (first_shot/directed_light.h), and on the angles
// at which reflected light leaves and arrives.
//
// The light of the sources, and its dependence on the direction, is known before the solve.
// Reflected light is known only after the solve. The system is then solved again with three
// corrections that follow from the solution: how reflected light from under a layer depends on the
// angle at which it leaves, in which directions sides send light that arrives from given directions
// (transport/scattered_light.h), and how much sides reflect at the angles at which light arrives.
// If surfaces send much light by direction, this is repeated.
//
// A few lines suffice for light that is a small part of all light, or that changes slowly from side
// to side. Some of the lines of each side then represent all of them.

#include <Eigen/Core>
#include <algorithm>

#include "job/cancellation.h"
#include "patches/side.h"
#include "sampling/sobol.h"
#include "scene/channels.h"
#include "transport/kept_lines.h"
#include "transport/line_reuse.h"

namespace raybundle {
namespace {

// The number of entries of a row that are used at least, if the row has as many: this constant
// divided by the target error, between kFewestEntries and kMostEntries. The error of leaving out
// the other entries must be small beside the target error. In an office and in a box, with all
// surfaces painted or of metal, 64 entries deviate by 0.04 to 0.3 % (RMS) from all entries of a
// row, 32 entries by 0.1 to 0.4 %, and 16 entries by 0.3 to 0.7 %. Bakes of the office with a
// target of 10 % and drafts are as near to a bake with 2 % with 8 entries as with 16 (within 0.02
// %, 3 seeds).
constexpr float kLeastEntriesTimesError = 0.4f;
constexpr float kFewestEntries = 8, kMostEntries = 256;
// The number of entries that are used at least to find which of the 36 cells of directions are open
// to the sky.
constexpr size_t kLeastOpenEntries = 1024;
constexpr float kMostReflectance = 0.999f;
// Sides per task; each side takes long.
constexpr size_t kInTask = 256;

}  // namespace

LineReuse::Enough LineReuse::enoughLines(double share) const {
    const float entries = kLeastEntriesTimesError / accuracy.targetError;
    return {share, size_t(std::clamp(entries, kFewestEntries, kMostEntries))};
}

template <class Add>
void LineReuse::alongLines(Half half, const LineWeights& weights, const Enough& enough,
                           uint32_t side, const Add& add) const {
    if (weights.m[side] == 0) return;
    const float perLine = weights.x[side] / weights.m[side];
    uint32_t number = 0;
    for (uint32_t h = 0; h < 2; ++h) {
        if (half != Half::BOTH && half != Half(h)) continue;
        const LineRows& rows = counts.rows(h);
        const size_t all = size_t(rows.last(side) - rows.first(side));
        const uint32_t seed = hash(side, h);
        rows.visitSome(
            side, std::max(enough.entries, size_t(enough.share * double(all))),
            // Positions in the steps are random, because the order of the bundles follows a
            // pattern.
            [&](size_t step) { return double(hash(seed, uint32_t(step)) >> 8) * 0x1p-24; },
            [&](uint32_t from, float lines) {
                add(perLine * lines * weights.x[from], from, number++);
            });
    }
}

bool LineReuse::isUndirected(Half half, uint32_t side) const {
    if (!usesCells(half)) return directedLight.isNone(side);
    return scatteredOfSources.isDark(side) || (!shot.sentOn.empty() && shot.sentOn[side]);
}

std::vector<glm::vec3> LineReuse::directed(Half half, const LineWeights& weights) const {
    if (scatteredOfSources.isNone() || shot.incoming.empty()) return {};
    const std::vector<float> exposed = exposedShare();
    std::vector<glm::vec3> brought(counts.sideCount(), glm::vec3(0.0f));
    const Enough enough = enoughLines(directedLight.neededLines());
    forEachSide<kInTask>(brought.size(), [&](uint32_t i) {
        alongLines(half, weights, enough, i, [&](float share, uint32_t from, uint32_t entry) {
            if (isUndirected(half, from) || exposed[from] <= 0) return;
            brought[i] +=
                share / exposed[from] *
                (!usesCells(half) ? directedLight.between(from, i, hash(i, entry))
                                  : scatteredOfSources.towards(
                                        from, directedLight.wayBetween(from, i, hash(i, entry))));
        });
    });
    return brought;
}

KeptLines LineReuse::keptLines(Half half, const LineWeights& weights, size_t ofSide) const {
    KeptLines kept{ofSide, std::vector<KeptLines::Line>(ofSide * counts.sideCount())};
    forEachSide<kInTask>(counts.sideCount(), [&](uint32_t i) {
        const auto first = kept.lines.begin() + ptrdiff_t(ofSide * i);
        alongLines(half, weights, {0, ofSide}, i, [&](float share, uint32_t from, uint32_t entry) {
            first[entry] = {
                from, share,
                ScatteredLight::placeOf(patches.normal(from),
                                        directedLight.wayBetween(from, i, hash(i, entry)))};
        });
    });
    return kept;
}

std::vector<glm::vec3> LineReuse::directedAlongKept(Half half, const LineWeights& weights,
                                                    LineSolution& guess) const {
    if (scatteredOfSources.isNone() || shot.incoming.empty()) return {};
    const size_t ofSide = enoughLines().entries;
    if (!guess.lines || guess.lines->ofSide != ofSide)
        guess.lines = std::make_shared<const KeptLines>(keptLines(half, weights, ofSide));
    const KeptLines& kept = *guess.lines;
    const std::vector<float> exposed = exposedShare();
    std::vector<glm::vec3> brought(counts.sideCount(), glm::vec3(0.0f));
    forEachSide<kInTask>(brought.size(), [&](uint32_t i) {
        const KeptLines::Line* line = &kept.lines[ofSide * i];
        for (size_t k = 0; k < ofSide && line->share > 0; ++k, ++line)
            if (exposed[line->from] > 0 && !isUndirected(half, line->from))
                brought[i] += line->share / exposed[line->from] *
                              scatteredOfSources.towards(line->from, line->place);
    });
    return brought;
}

void LineReuse::findOpen(const LineWeights& weights, ScatteredLight& scattered) const {
    const Enough enough{0, std::max(enoughLines().entries, kLeastOpenEntries)};
    forEachSide<kInTask>(counts.sideCount(), [&](uint32_t i) {
        const float sky = skyShare(weights, i);
        if (scattered.isNone(i) || sky == 0) return;
        ScatteredLight::Hemisphere met{};
        alongLines(Half::BOTH, weights, enough, i, [&](float share, uint32_t from, uint32_t entry) {
            scattered.add(i, -directedLight.wayBetween(from, i, hash(i, entry)), share, met);
        });
        scattered.setOpen(i, met, sky);
    });
}

float LineReuse::skyShare(const LineWeights& weights, uint32_t side) const {
    if (worldRadiance == glm::vec3(0.0f) || weights.m[side] == 0) return 0;
    const auto& lines = counts.sky[side];
    return weights.x[side] * float(lines[0] + lines[1]) / weights.m[side];
}

double LineReuse::findAngles(const LineWeights& weights, const std::vector<glm::vec3>& reflected,
                             const Irradiance& light, ByAngle& byAngle) const {
    const size_t n = counts.sideCount();
    const std::vector<float> exposed = exposedShare();
    const auto before = std::move(byAngle.scattered);
    byAngle.scattered = std::make_shared<ScatteredLight>(before ? *before : scatteredOfSources);
    ScatteredLight& scattered = *byAngle.scattered;
    if (!before) findOpen(weights, scattered);
    const glm::vec3 worldExitance = glm::pi<float>() * worldRadiance;
    byAngle.brought = byAngle.ofSources;
    byAngle.brought.resize(n, glm::vec3(0.0f));
    if (!patches.byAngle.empty()) byAngle.reflected.resize(n);
    forEachSide<kInTask>(n, [&](uint32_t i) {
        const glm::vec3 normal = patches.normal(i);
        const bool scatters = !scattered.isNone(i);
        // Sum of the angle terms (scene/angles.h) of the arriving light, weighted by its
        // brightness.
        glm::vec4 terms(0.0f);
        // Sum of the brightness.
        float sum = 0;
        ScatteredLight::Cells arriving{};
        if (const float sky = skyShare(weights, i); sky > 0) {
            const auto [angles, share] = scatters ? scattered.addSky(i, worldExitance, arriving)
                                                  : std::pair(sky * kEverywhere, sky);
            terms += brightest(worldExitance) * angles;
            sum += brightest(worldExitance) * share;
        }
        alongLines(
            Half::BOTH, weights, enoughLines(), i, [&](float share, uint32_t from, uint32_t entry) {
                const glm::vec3 way = directedLight.wayBetween(from, i, hash(i, entry));
                glm::vec3 all = shot.emission[from] + reflected[from];
                if (directedLight.hasLayers()) {
                    const glm::vec3 layered = directedLight.layer(from, way) * reflected[from];
                    byAngle.brought[i] += share * layered;
                    all += layered;
                }
                if (!scattered.isNone(from)) {
                    if (before) all += before->towards(from, way);
                    if (exposed[from] > 0)
                        all += scatteredOfSources.towards(from, way) / exposed[from];
                }
                const float brightness = share * std::max(brightest(all), 0.0f);
                terms += brightness * angleTerms(-glm::dot(way, normal));
                sum += brightness;
                if (scatters) scattered.add(i, -way, share * all, arriving);
            });
        if (scatters) scattered.set(i, arriving);
        if (byAngle.reflected.empty() || !(sum > 0)) return;
        const glm::vec3 more = sumOfTerms(patches.byAngle[i], terms / sum - kEverywhere);
        byAngle.reflected[i] =
            glm::clamp(more, -patches.reflectance[i], kMostReflectance - patches.reflectance[i]) *
            (light.all(i) - light.ofSources[i]);
    });
    if (scattered.isNone()) return 0;
    double bent = 0, all = 0;
    for (uint32_t side = 0; side < n; ++side) {
        const double area = double(patches.area[patchOf(side)]);
        all += area * double(brightest(reflected[side]));
        if (!scattered.isNone(side)) bent += area * double(scattered.contrast(side));
    }
    const Enough needed = enoughLines(shareOfLines(bent, all));
    forEachSide<kInTask>(n, [&](uint32_t i) {
        alongLines(Half::BOTH, weights, needed, i, [&](float share, uint32_t from, uint32_t entry) {
            if (scattered.isNone(from)) return;
            const glm::vec3 way = directedLight.wayBetween(from, i, hash(i, entry));
            byAngle.brought[i] += share * scattered.towards(from, way);
        });
    });
    return all > 0 ? bent / all : 0;
}

}  // namespace raybundle
