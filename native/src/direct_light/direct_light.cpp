// SPDX-License-Identifier: GPL-3.0-or-later
#include "direct_light/direct_light.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <numeric>

#include "job/cancellation.h"
#include "lights/emissive_meshes.h"
#include "lights/receiver_place.h"
#include "patches/side.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

// Scaled light is gathered again only if its squared relative error has grown by more than this
// factor.
constexpr float kSameError = 1.1f;
// Receivers per cluster that share an outlook on a surrounding source: in the first round, made
// from the coarse pass, and in the second round, made from more samples.
constexpr size_t kWideCluster = 128, kNearCluster = 16;
constexpr float kNearPower = 0.9f;
// Largest number of receivers for which sightings are stored: 130 bytes per receiver and 2 kB per
// cluster.
constexpr size_t kMostLookingAround = 1 << 19;
// Largest number of passes. A receiver that finds the edge of a shadow may have neighbours that
// have missed it too, so each pass may cause another one.
constexpr int kMostPasses = 16;
// At this target error or a larger one, as in drafts, no further pass is made for fewer than this
// share of the receivers. To find them takes most of such a pass.
constexpr float kLaxTarget = 0.2f;
constexpr size_t kFewReceivers = 1000;  // of this many, one
// Samples per source for comparing its light at the corners of a face. All corners use the same
// samples.
constexpr uint32_t kSlopeSamples = 32;
// Rays for the power balance: of all sources together, and of each source at least.
constexpr uint32_t kPowerRays = 16384, kLeastPowerRays = 1024;

bool showAnyByAngle(const Scene& scene) {
    return std::any_of(scene.materials.begin(), scene.materials.end(),
                       [](const Material& material) { return material.showsByAngle(); });
}

}  // namespace

DirectLight::DirectLight(const Scene& scene, const Patches& patches, const Visibility& visibility,
                         uint32_t seed, int32_t lightSet, const Skips& skips)
    : DirectLight(scene, patches, visibility, seed, skips,
                  std::make_unique<const EmissionSplit>(
                      splitEmission(scene, patches, visibility, lightSet, seed, skips))) {
    sources = raybundle::lightSources(scene, patches, split->isSource, split->ofSources, lightSet);
}

DirectLight::DirectLight(const Scene& scene, const Patches& patches, const Visibility& visibility,
                         uint32_t seed, const Skips& skips, EmissionSplit reflected)
    : DirectLight(scene, patches, visibility, seed, skips,
                  std::make_unique<const EmissionSplit>(std::move(reflected))) {
    sources = meshSources(scene, patches, split->isSource, split->ofSources, split->directed.get());
}

DirectLight::DirectLight(const Scene& scene, const Patches& patches, const Visibility& visibility,
                         uint32_t seed, const Skips& skips,
                         std::unique_ptr<const EmissionSplit> split)
    : scene(scene),
      patches(patches),
      visibility(visibility),
      seed(seed),
      skips(skips),
      showsByAngle(showAnyByAngle(scene)),
      split(std::move(split)) {}

void DirectLight::gatherThese(std::vector<Gathered>& results, const Aims& these,
                              const GatherAt& gatherAt,
                              const std::function<void(double)>& progress) const {
    // Receivers between two calls of `progress`, which may cancel.
    constexpr size_t kSlice = 1 << 14;
    const size_t count = these.receivers.size();
    for (size_t from = 0; from < count; from += kSlice) {
        progress(0.5 * double(from) / double(count));
        parallelFor(from, std::min(from + kSlice, count), [&](size_t k) {
            const uint32_t receiver = these.receivers[k];
            Gathered& result = results[receiver];
            const uint64_t before = result.rays;
            result = gatherAt(receiver, these.aims[k]);
            result.rays += before;
        });
    }
}

void DirectLight::shootCoarsely(CoarseShot& coarse, const std::vector<uint32_t>& these,
                                const std::function<Receiver(size_t)>& receiverAt,
                                const std::function<void(double)>& progress,
                                const std::vector<ReceiverPair>& neighbours,
                                LightBySource* bySource) const {
    Seen seen = noneSeen();
    coarse.seen.resize(seen.size());
    coarse.bundled = 0;
    for (size_t side = 0; side < split->bundled.size(); ++side)
        coarse.bundled += double(patches.area[patchOf(side)] * brightest(split->bundled[side])) /
                          patches.totalArea;
    if (sources.empty()) return;
    const std::vector<bool> hasNeighbour = haveNeighbours(coarse.gathered.size(), neighbours);
    Aims first{these, {}};
    for (uint32_t k : these)
        first.aims.push_back({INFINITY, hasNeighbour[k] ? kNeighbourSamples : kFirstSamples, 1, 0,
                              nullptr, !hasNeighbour[k]});
    gatherThese(
        coarse.gathered, first,
        [&](uint32_t receiver, const Aim& aim) {
            return gather(receiverAt(receiver), aim, seen,
                          bySource ? bySource->of(receiver) : nullptr,
                          coarse.sightings.empty() ? nullptr : &coarse.sightings[receiver]);
        },
        progress);
    for (size_t k = 0; k < seen.size(); ++k) coarse.seen[k] = coarse.seen[k] || seen[k];
}

CoarseShot DirectLight::shootCoarsely(size_t count,
                                      const std::function<Receiver(size_t)>& receiverAt,
                                      const std::function<void(double)>& progress,
                                      const std::vector<ReceiverPair>& neighbours,
                                      LightBySource* bySource) const {
    CoarseShot coarse;
    if (surrounding() && count <= kMostLookingAround) coarse.sightings.resize(count);
    coarse.gathered.resize(count);
    std::vector<uint32_t> all(count);
    std::iota(all.begin(), all.end(), 0u);
    shootCoarsely(coarse, all, receiverAt, progress, neighbours, bySource);
    return coarse;
}

std::vector<Gathered> DirectLight::gather(
    size_t count, const std::function<Receiver(size_t)>& receiverAt, float targetError,
    const std::function<void(double)>& progress, CoarseShot first,
    const std::vector<ReceiverPair>& neighbours, LightBySource* bySource) const {
    if (first.gathered.empty())
        first = shootCoarsely(count, receiverAt, progress, neighbours, bySource);
    std::vector<Gathered> results = std::move(first.gathered);
    if (sources.empty()) return results;
    Seen seen = noneSeen();
    for (size_t k = 0; k < seen.size(); ++k) seen[k] = first.seen[k];

    Aims further = aimsAfter(results, patches, receiverAt, neighbours, targetError);
    const auto outlooks = lookAround(further, results, receiverAt, std::move(first.sightings));
    refine(results, std::move(further), {receiverAt, targetError, progress, neighbours},
           [&](uint32_t receiver, const Aim& aim) {
               return gather(receiverAt(receiver), aim, seen,
                             bySource ? bySource->of(receiver) : nullptr, nullptr);
           });
    return results;
}

void DirectLight::refine(std::vector<Gathered>& results, Aims further, const Passes& passes,
                         const GatherAt& gatherAt) const {
    const auto& [receiverAt, targetError, progress, neighbours] = passes;
    std::vector<Aim> last(neighbours.empty() ? 0 : results.size());  // per receiver
    for (int pass = 0; pass < kMostPasses && !further.receivers.empty(); ++pass) {
        gatherThese(results, further, gatherAt,
                    [&, &report = progress](double done) { report(pass == 0 ? 0.5 + done : 1.0); });
        if (neighbours.empty()) break;  // only neighbours can reveal a missed edge of a shadow
        for (size_t k = 0; k < further.receivers.size(); ++k)
            last[further.receivers[k]] = further.aims[k];
        further = aimsAfter(results, patches, receiverAt, neighbours, targetError);
        further.keep([&](uint32_t k, const Aim& aim) {
            const float told = last[k].besideShadow;
            const bool isFiner = results[k].shadowContrast == 0 && aim.besideShadow < 0.5f * told;
            return aim.besideShadow > 0 && (told == 0 || isFiner);
        });
        for (size_t k = 0; k < further.receivers.size(); ++k)
            further.aims[k].outlook = last[further.receivers[k]].outlook;
        const bool areFew = further.receivers.size() * kFewReceivers < results.size();
        if (targetError >= kLaxTarget && areFew) break;
    }
}

std::array<Outlooks, 2> DirectLight::lookAround(Aims& further, std::vector<Gathered>& results,
                                                const std::function<Receiver(size_t)>& receiverAt,
                                                std::vector<Sightings> sightings) const {
    if (sightings.empty()) return {};
    const LightSource& source = *surrounding();
    std::vector<uint32_t> these;
    std::vector<Aim*> aims;
    for (size_t k = 0; k < further.aims.size(); ++k)
        if (sightings[further.receivers[k]].seenShare() < kWellSeen) {
            these.push_back(further.receivers[k]);
            aims.push_back(&further.aims[k]);
        }
    std::array<Outlooks, 2> outlooks;
    outlooks[0] =
        Outlooks(source.parts(), these, receiverAt, patches, sightings, kWideCluster, 0.5f);
    size_t count = 0;
    for (size_t k = 0; k < these.size(); ++k) {
        aims[k]->outlook = outlooks[0].of(k);
        if (aims[k]->outlook->isDark) continue;
        these[count] = these[k];
        aims[count++] = aims[k];
    }
    these.resize(count);
    parallelFor(size_t(0), count, [&](size_t k) {
        Gathered& result = results[these[k]];
        sightings[these[k]] = {};
        look(source, receiverAt(these[k]), *aims[k]->outlook, sightings[these[k]], result);
    });
    outlooks[1] =
        Outlooks(source.parts(), these, receiverAt, patches, sightings, kNearCluster, kNearPower);
    for (size_t k = 0; k < count; ++k) aims[k]->outlook = outlooks[1].of(k);
    return outlooks;
}

std::vector<Gathered> DirectLight::gatherFresh(const LightBySource& before,
                                               const LightBySource::Matches& matches,
                                               const std::function<Receiver(size_t)>& receiverAt,
                                               float targetError,
                                               const std::function<void(double)>& progress,
                                               const std::vector<ReceiverPair>& neighbours) const {
    std::vector<Gathered> results =
        before.scaled(matches.ofKept, [&](size_t source, size_t receiver) {
            return isUnpowered(source, receiverAt(receiver).side);
        });
    Seen seen = noneSeen();
    for (std::atomic<bool>& source : seen) source = true;
    if (!matches.fresh.empty())
        addFresh(results, matches.fresh, {receiverAt, targetError, progress, neighbours}, seen);
    // Receivers that already took as many samples as allowed also have a large error. A further
    // pass would not reduce it, so the error is compared with the one before.
    Aims further = aimsAfter(results, patches, receiverAt, {}, targetError);
    further.keep([&](uint32_t k, const Aim&) {
        const Gathered &now = results[k], was = before.asItWas(k);
        const float light = brightest(now.irradiance), lightThen = brightest(was.irradiance);
        return now.variance * lightThen * lightThen > kSameError * was.variance * light * light;
    });
    gatherThese(
        results, further,
        [&](uint32_t receiver, const Aim& aim) {
            return gather(receiverAt(receiver), aim, seen, nullptr, nullptr);
        },
        progress);
    return results;
}

// The kept light does not say what it was without occluders. The shadows whose edges further passes
// look for are therefore those of fresh sources alone.
void DirectLight::addFresh(std::vector<Gathered>& results, const std::vector<size_t>& fresh,
                           const Passes& passes, Seen& seen) const {
    const std::vector<Gathered> kept = results;
    // The errors of several sources add up.
    const float share = sources.size() > kFewSources
                            ? std::sqrt(float(fresh.size()) / float(sources.size()))
                            : 1.0f;
    auto gatherAt = [&](uint32_t k, const Aim& aim) {
        const Receiver receiver = passes.receiverAt(k);
        const ReceiverPlace place(patches, receiver);
        Aim own = aim;
        own.tolerance *= share;
        Gathered result = kept[k];
        for (size_t source : fresh)
            result.add(uint32_t(source),
                       gatherFrom(source, receiver, place, own, seen, nullptr, result),
                       isUnpowered(source, receiver.side), hash(receiver.seed, uint32_t(source)));
        return result;
    };
    Aims first;
    const std::vector<bool> hasNeighbour = haveNeighbours(results.size(), passes.neighbours);
    for (uint32_t k = 0; k < results.size(); ++k) {
        first.receivers.push_back(k);
        first.aims.push_back({INFINITY, hasNeighbour[k] ? kNeighbourSamples : kFirstSamples, 1, 0,
                              nullptr, !hasNeighbour[k]});
    }
    gatherThese(results, first, gatherAt, passes.progress);
    Aims further =
        aimsAfter(results, patches, passes.receiverAt, passes.neighbours, passes.targetError);
    further.keep([&](uint32_t k, const Aim& aim) {
        return aim.besideShadow > 0 || results[k].variance > kSameError * kept[k].variance;
    });
    refine(results, std::move(further), passes, gatherAt);
}

bool DirectLight::isSurrounding() const {
    return std::any_of(sources.begin(), sources.end(),
                       [](const auto& source) { return source->surrounds(); });
}

const LightSource* DirectLight::surrounding() const {
    for (const auto& source : sources)
        if (!source->parts().empty()) return source.get();
    return nullptr;
}

bool DirectLight::isUnpowered(size_t source, uint32_t side) const {
    return brightest(sources[source]->power()) <= 0 || !sources[source]->castsShadows ||
           !patches.parentAt(side).stopsDirect;
}

glm::vec3 sampleEach(const LightSources& sources, const Patches& patches,
                     const Visibility& visibility, const Receiver& receiver, uint32_t index,
                     uint32_t seed) {
    const ReceiverPlace place(patches, receiver);
    glm::vec3 sum(0.0f);
    for (size_t k = 0; k < sources.size(); ++k) {
        const glm::vec4 u = sobolPoint(index, hash(seed, hash(receiver.seed, uint32_t(k))));
        const glm::vec3 point = place.at({u.x, u.y});
        const LightSample sample = sources[k]->sampleAlone(point, place.normal, {u.z, u.w});
        if (brightest(sample.irradiance) <= 0) continue;
        const float share = sources[k]->castsShadows
                                ? visibility.visibleShare(receiver.side, sample.ray(point))
                                : 1;
        sum += share * sample.irradiance;
    }
    return sum;
}

void DirectLight::unblocked(uint32_t side, const glm::vec3* points, size_t count, float even,
                            glm::vec3* light) const {
    const ReceiverPlace place(patches, {side, patches.normal(side), std::nullopt, side});
    std::fill(light, light + count, glm::vec3(0.0f));
    // All sources use the same samples, so that several light sets give the same values in one bake
    // and in separate bakes.
    const SobolPoints samples(hash(seed, side));
    for (const auto& source : sources) {
        if (isOutOfSight(*source, place)) continue;
        const bool isEven = place.radius < even * source->distance(place.centroid());
        auto at = [&](const glm::vec3& point) {
            if (const auto closed = source->irradiance(point, place.normal)) return *closed;
            glm::vec3 sum(0.0f);
            for (uint32_t i = 0; i < kSlopeSamples; ++i)
                sum += source->sample(point, place.normal, {samples[i].z, samples[i].w}).irradiance;
            return sum / float(kSlopeSamples);
        };
        if (isEven) {
            const glm::vec3 middle = at(place.centroid());
            for (size_t k = 0; k < count; ++k) light[k] += middle;
        } else {
            for (size_t k = 0; k < count; ++k) light[k] += at(points[k]);
        }
    }
}

bool DirectLight::hasPassingLight(uint32_t side) const {
    if (!patches.parentAt(side).stopsDirect) return !sources.empty();
    return std::any_of(sources.begin(), sources.end(),
                       [](const auto& source) { return !source->castsShadows; });
}

bool DirectLight::isOutOfSight(const LightSource& source, const ReceiverPlace& place) const {
    return skips.skipFacing && source.isOutOfSight(place);
}

std::vector<PowerShares> DirectLight::powerShares() const {
    std::vector<size_t> all(sources.size());
    std::iota(all.begin(), all.end(), size_t(0));
    return powerShares(all);
}

std::vector<PowerShares> DirectLight::powerShares(const std::vector<size_t>& these) const {
    std::vector<PowerShares> shares(sources.size());
    if (sources.empty()) return shares;
    const uint32_t rays = std::max(kLeastPowerRays, kPowerRays / uint32_t(sources.size()));
    for (size_t k : these) {
        if (brightest(sources[k]->power()) <= 0 || !sources[k]->castsShadows) continue;
        const uint32_t own = hash(seed, uint32_t(k));
        const SobolPoints points(own);
        tbb::enumerable_thread_specific<PowerShares> sums;
        parallelFor(tbb::blocked_range<uint32_t>(0, rays, 256), [&](const auto& range) {
            for (uint32_t i = range.begin(); i < range.end(); ++i) {
                glm::vec4 u = points[i];
                // In a mesh of 2^n faces every Sobol point could lie at the same place of its
                // face's share of the power, for example on the fronts alone. A random shift within
                // the step prevents that.
                u.x = std::min(glm::fract(u.x + float(hash(own, i)) * 0x1p-32f / float(rays)),
                               0.9999999f);
                const EmittedRay ray = sources[k]->emit(u, patches.radius);
                const glm::dvec3 weight = glm::dvec3(ray.weight) / double(rays);
                float distance = 0;
                const auto met =
                    ray.side ? visibility.firstHit(*ray.side, ray.origin, ray.direction, &distance)
                             : visibility.firstHit(ray.start(visibility.offset()), ray.direction);
                if (!met)
                    sums.local().escaped += weight;
                else if (ray.side && isCovered(patches, *ray.side, *met, ray.direction, distance))
                    sums.local().covered += weight;
            }
        });
        for (const PowerShares& part : sums) {
            shares[k].escaped += part.escaped;
            shares[k].covered += part.covered;
        }
    }
    return shares;
}

}  // namespace raybundle
