// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/starved_sides.h"

#include <algorithm>
#include <glm/gtc/constants.hpp>

#include "job/cancellation.h"
#include "patches/side.h"
#include "sampling/sobol.h"
#include "sampling/sphere_sampling.h"
#include "surfaces/translucence.h"
#include "transport/scattered_light.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

// Each side casts kLocalRays rays. If there are many sides, each casts fewer, but at least
// kFewLocalRays, to stay below kMostLocalRays in all.
constexpr size_t kLocalRays = 64, kFewLocalRays = 16, kMostLocalRays = 8 << 20;
constexpr int kMaxSweeps = 64;
// The sweeps end when the exitance changes by less than this, relative to the largest exitance.
constexpr float kSettledChange = 1e-5f;
constexpr uint32_t kNoHit = UINT32_MAX;

}  // namespace

StarvedSides::StarvedSides(const StarvedInput& input, const StarvedRays& rays,
                           Irradiance& irradiance)
    : input(input),
      how(rays),
      surface(rays.clusters ? rays.clusters->members() : input.patches),
      shotLight(handOver(input, input.shot)),
      irradiance(irradiance) {}

void StarvedSides::find(const std::vector<bool>& wanted) {
    isOther.resize(input.counts.sideCount());
    for (uint32_t i = 0; i < input.counts.sideCount(); ++i) {
        throwIfCancelledAt(i);
        // A patch of a cut tile needs only its share of the lines of a tile.
        const uint32_t enough = std::max(1u, how.minLines >> (2 * input.patches.level(patchOf(i))));
        const bool isStarved = input.counts.linesMetInAll(i) < enough;
        if (isStarved && wanted[i])
            starved.push_back(i);
        else
            isOther[i] = isStarved;
    }
    if (!starved.empty())
        raysPerSide = std::clamp(kMostLocalRays / starved.size(), kFewLocalRays, kLocalRays);
}

void StarvedSides::castRays(const std::vector<bool>& wanted) {
    find(wanted);
    for (size_t first = 0; first < starved.size();) {
        const size_t last = starved.size();
        hits.resize(last * raysPerSide, kNoHit);
        weights.resize(last);
        known.resize(last);
        parallelFor(first, last, [&](size_t k) { castRaysOf(k); });
        for (size_t k = first * raysPerSide; k < last * raysPerSide; ++k)
            if (hits[k] != kNoHit && isOther[hits[k]]) {
                isOther[hits[k]] = false;
                starved.push_back(hits[k]);
            }
        first = last;
    }
}

void StarvedSides::castRaysOf(size_t k) {
    const uint32_t side = starved[k];
    const SobolPoints points(hash(how.seed, side));
    const glm::vec3 worldExitance = glm::pi<float>() * input.worldRadiance;
    const float lines = float(input.counts.linesMet(side));
    glm::vec3 direct(0.0f), byDirection(0.0f);
    float weight = lines;
    for (size_t i = 0; i < raysPerSide; ++i) {
        const glm::vec4 u = points[uint32_t(i)];
        const uint32_t from = how.clusters ? how.clusters->memberOf(side, uint32_t(i)) : side;
        const glm::vec3 direction = cosineDirection(surface.normal(from), {u.z, u.w});
        float distance = 0;
        auto hit = how.visibility.firstHit(from, surface.point(patchOf(from), {u.x, u.y}),
                                           direction, &distance);
        if (hit && isCovered(surface, from, *hit, direction, distance)) continue;
        if (hit && how.clusters) hit = how.clusters->sideOf(*hit);
        if (hit) {
            hits[k * raysPerSide + i] = *hit;
            if (!input.directedLight.isNone(*hit) && input.exposed[*hit] > 0)
                byDirection += input.directedLight.towards(*hit, -direction) / input.exposed[*hit];
            if (irradiance.scattered && !irradiance.scattered->isNone(*hit))
                byDirection += irradiance.scattered->towards(*hit, -direction);
        }
        direct += hit ? input.shot.emission[*hit] : worldExitance;
        ++weight;
    }
    weights[k] = weight;
    if (weight == 0) return;
    const glm::vec3 fromSources = shotLight.ofSources[side];
    const glm::vec3 lineDirect = irradiance.direct[side] - fromSources;
    irradiance.direct[side] = fromSources + (lines * lineDirect + direct) / weight;
    known[k] = lines * (irradiance.indirect[side] - shotLight.indirect[side]) + byDirection;
}

void StarvedSides::addReflected(const std::vector<glm::vec3>& reflected) {
    std::vector<glm::vec3> sent = reflected, next(starved.size());
    if (!input.patches.translucence.empty())
        for (size_t i = 0; i < sent.size(); ++i)
            sent[i] += passedOn(input, i, irradiance.all(opposite(i)));
    // Starved sides may see each other, so sweeps are repeated until their exitance has settled.
    for (int k = 0; k < kMaxSweeps; ++k)
        if (sweep(sent, next)) return;
}

// Computes the light that arrives at the starved sides from the exitance `sent` (per side), and
// updates their exitance in `sent`. Returns whether their exitance has settled. `next` is working
// memory, per side in `starved`.
bool StarvedSides::sweep(std::vector<glm::vec3>& sent, std::vector<glm::vec3>& next) {
    const Patches& patches = input.patches;
    parallelFor(size_t(0), starved.size(), [&](size_t k) {
        const uint32_t side = starved[k];
        glm::vec3 sum = known[k];
        for (size_t i = 0; i < raysPerSide; ++i)
            if (const uint32_t hit = hits[k * raysPerSide + i]; hit != kNoHit) sum += sent[hit];
        const glm::vec3 arriving = weights[k] > 0 ? sum / weights[k] : glm::vec3(0.0f);
        irradiance.indirect[side] = shotLight.indirect[side] + arriving;
        next[k] = shotLight.unshot[side] +
                  patches.reflectance[side] *
                      (irradiance.direct[side] - shotLight.ofSources[side] + arriving);
    });
    glm::vec3 change(0.0f), most(0.0f);
    for (size_t k = 0; k < starved.size(); ++k) {
        next[k] += passedOn(input, starved[k], irradiance.all(opposite(starved[k])));
        change = glm::max(change, glm::abs(next[k] - sent[starved[k]]));
        most = glm::max(most, next[k]);
        sent[starved[k]] = next[k];
    }
    return glm::all(glm::lessThanEqual(change, kSettledChange * most));
}

}  // namespace raybundle
