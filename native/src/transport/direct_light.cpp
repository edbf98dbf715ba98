// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/direct_light.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <numeric>

namespace raybundle {
namespace {

// Emission up to this many times the mean exitance of the scene is left to the bundles.
constexpr double kBundledEmission = 1.5;
// Of light that was scaled: a squared relative error that has grown by less than this is as it was.
constexpr float kSameError = 1.1f;
// Shadow rays per receiver and source for sources of little weight.
constexpr int kFewSamples = 4;
constexpr size_t kFewSources = 4;
// A source of less than this share of the light that a receiver could get takes few samples, one of
// less than the second half as many as others.
constexpr float kSmallShare = 0.06f, kMiddleShare = 0.25f;
// What n samples tell nothing of: a part s of a source is missed by all with the probability
// (1 - s)^n, and then s is wrong; this over n at most, in the mean.
constexpr float kMissed = 0.37f;
// The same beside the edge of a shadow, where most receivers are wholly lit or dark after all: the
// true error is 0.8 of the stated one in the edge of a plate's shadow (first_shot_test.cpp).
constexpr float kMissedEdge = 0.2f;
// A receiver that is in the dark after so many samples of a source that surrounds it stays there.
// One whose neighbours are too, after fewer.
constexpr int kDarkSamples = 256, kDarkSamplesOfDark = 64;
// Receivers that learn together what they see of such a source: at first, and then by more samples.
constexpr size_t kWideCluster = 128, kNearCluster = 16;
constexpr float kNearPower = 0.9f;
// A closed form whose largest value is so many times its smallest on a patch takes more points.
constexpr float kSmooth = 1.1f;
// A patch smaller than this share of its distance from a source needs one point only: the error is
// about a quarter of its square, 0.3 %.
constexpr float kFar = 0.1f;
// Points of a source by which its light at the corners of a face is compared: the same for all.
constexpr uint32_t kSlopeSamples = 32;
// For the power balance: rays of all sources together, and of each at least.
constexpr uint32_t kEscapeRays = 16384, kLeastEscapeRays = 1024;

// Estimate of the scene's mean exitance by the light of a set: all power over the area, times the
// bounces of the mean reflectance. Only its order of magnitude matters. emission: of the set, per
// side.
double meanExitance(const Scene& scene, const Patches& patches,
                    const std::vector<glm::vec3>& emission, int32_t lightSet) {
    double emitted = 0, reflectance = 0;
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        emitted += patches.area[side / 2] * brightest(emission[side]);
        if (side % 2 == 0)
            reflectance += patches.area[side / 2] * brightest(patches.reflectance[side]);
    }
    const double area = patches.totalArea;
    for (const Light& light : scene.lights) {
        if (light.lightSet != lightSet) continue;
        const double strength = std::max({light.strength.x, light.strength.y, light.strength.z});
        switch (light.kind) {
            case Light::Kind::POINT:
                emitted += 4 * glm::pi<double>() * strength;
                break;
            case Light::Kind::SUN:
                emitted += 0.25 * area * strength;
                break;
            case Light::Kind::AREA:
                emitted += 4 * glm::pi<double>() * strength *
                           glm::length(glm::cross(light.axisU, light.axisV));
                break;
        }
    }
    glm::vec3 world = scene.worldRadianceOf(lightSet);
    if (scene.worldLightSet == lightSet) world += scene.worldImage.meanRadiance();
    emitted += area * glm::pi<double>() * brightest(world);
    return emitted / area / std::max(0.05, 1 - reflectance / area);
}

}  // namespace

// Running sums of one source over a block of samples.
struct DirectLight::Block {
    glm::vec3 open{0.0f};     // sum of the samples as if unblocked
    glm::vec3 visible{0.0f};  // sum of those that are not blocked
    float grazing = 0;        // the same, of their brightest channels times grazingShare
    int count = 0;

    void add(const Block& other) {
        open += other.open;
        visible += other.visible;
        grazing += other.grazing;
        count += other.count;
    }
    // The closed form times the visible share; the plain mean where there is no closed form.
    glm::vec3 estimate(const std::optional<glm::vec3>& closed) const {
        if (count == 0) return glm::vec3(0.0f);
        if (!closed) return visible / float(count);
        glm::vec3 mean = *closed;
        for (int c = 0; c < 3; ++c)
            if (open[c] > 0) mean[c] *= visible[c] / open[c];
        return mean;
    }
};

// Where a receiver is: all of a patch, or a point.
struct DirectLight::Place {
    glm::vec3 origin, a{0.0f}, b{0.0f};  // a point is origin + u * a + v * b
    glm::vec3 middle, normal;
    float radius = 0;  // of a sphere around the middle that holds it, metres
    bool isTriangle = false;

    Place(const Patches& patches, const Receiver& receiver) : normal(receiver.normal) {
        if (receiver.point) {
            origin = middle = *receiver.point;
            return;
        }
        const uint32_t patch = receiver.side / 2;
        const Parent& parent = patches.parents[patches.parentOf[patch]];
        isTriangle = parent.isTriangle;
        origin = patches.point(patch, {0, 0});
        a = patches.point(patch, {1, 0}) - origin;
        b = patches.point(patch, {0, 1}) - origin;
        middle = at({0.5f, 0.5f});
        radius = 0.5f * (glm::length(a) + glm::length(b));
    }

    // u, v uniform in [0, 1]^2: uniform by area. The square is folded onto a triangle.
    glm::vec3 at(glm::vec2 uv) const {
        if (isTriangle && uv.x + uv.y > 1) uv = 1.0f - uv;
        return origin + uv.x * a + uv.y * b;
    }
    glm::vec3 centroid() const { return isTriangle ? origin + (a + b) / 3.0f : middle; }
};

DirectLight::DirectLight(const Scene& scene, const Patches& patches, const Visibility& visibility,
                         uint32_t seed, int32_t lightSet, const Skips& skips)
    : patches(patches),
      visibility(visibility),
      seed(seed),
      skips(skips),
      emitted(patches.emission),
      bundled(patches.sideCount()),
      gathered(patches.sideCount()) {
    for (size_t side = 0; side < emitted.size(); ++side) {
        const uint32_t instance = patches.parents[patches.parentOf[side / 2]].instance;
        if (scene.instances[instance].lightSet != lightSet) emitted[side] = glm::vec3(0.0f);
    }
    const double brightLimit = kBundledEmission * meanExitance(scene, patches, emitted, lightSet);
    std::vector<bool> isSource(patches.sideCount(), false);
    for (size_t side = 0; side < isSource.size(); ++side) {
        if (!patches.parentAt(uint32_t(side)).exchanges) continue;
        if (brightest(emitted[side]) > brightLimit) {
            isSource[side] = true;
            gathered[side] = patches.opacityOf(uint32_t(side / 2)) * emitted[side];
        } else {
            bundled[side] = emitted[side];
        }
    }
    sources = raybundle::lightSources(scene, patches, isSource, gathered, lightSet);
}

void DirectLight::gatherThese(std::vector<Gathered>& results, const std::vector<uint32_t>& these,
                              const std::function<Receiver(size_t)>& receiverAt,
                              const std::vector<Aim>& aims, Seen& seen,
                              const std::function<void(double)>& progress, LightBySource* bySource,
                              std::vector<Sightings>* sightings) const {
    constexpr size_t kSlice = 1 << 14;  // receivers between two looks at the cancel flag
    for (size_t from = 0; from < these.size(); from += kSlice) {
        progress(0.5 * double(from) / double(these.size()));
        tbb::parallel_for(from, std::min(from + kSlice, these.size()), [&](size_t k) {
            Gathered& result = results[these[k]];
            const uint64_t before = result.rays;
            result = gather(receiverAt(these[k]), aims[k], seen,
                            bySource ? bySource->of(these[k]) : nullptr,
                            sightings ? &(*sightings)[these[k]] : nullptr);
            result.rays += before;
        });
    }
}

void DirectLight::shootCoarsely(CoarseShot& coarse, const std::vector<uint32_t>& these,
                                const std::function<Receiver(size_t)>& receiverAt,
                                const std::function<void(double)>& progress, bool hasNeighbours,
                                LightBySource* bySource, std::vector<Sightings>* sightings) const {
    coarse.seen.resize(sources.size());
    coarse.bundled = 0;
    for (size_t side = 0; side < bundled.size(); ++side)
        coarse.bundled +=
            double(patches.area[side / 2] * brightest(bundled[side])) / patches.totalArea;
    if (sources.empty()) return;
    Seen seen(sources.size());
    const Aim aim{INFINITY, hasNeighbours ? kNeighbourSamples : kFirstSamples, false};
    gatherThese(coarse.gathered, these, receiverAt, std::vector<Aim>(these.size(), aim), seen,
                progress, bySource, sightings);
    for (size_t k = 0; k < seen.size(); ++k) coarse.seen[k] = coarse.seen[k] || seen[k];
}

std::vector<Gathered> DirectLight::gather(
    size_t count, const std::function<Receiver(size_t)>& receiverAt, float targetError,
    const std::function<void(double)>& progress, CoarseShot first,
    const std::vector<ReceiverPair>& neighbours, LightBySource* bySource) const {
    std::vector<Sightings> sightings;
    if (first.gathered.empty()) {
        if (surrounding()) sightings.resize(count);
        first.gathered.resize(count);
        std::vector<uint32_t> these(count);
        std::iota(these.begin(), these.end(), 0u);
        shootCoarsely(first, these, receiverAt, progress, !neighbours.empty(), bySource,
                      sightings.empty() ? nullptr : &sightings);
    }
    std::vector<Gathered> results = std::move(first.gathered);
    if (sources.empty()) return results;
    Seen seen(sources.size());
    for (size_t k = 0; k < seen.size(); ++k) seen[k] = first.seen[k];

    Aims further = aimsAfter(results, patches, receiverAt, neighbours, targetError);
    const auto outlooks = lookAround(further, results, receiverAt, std::move(sightings));
    gatherThese(
        results, further.receivers, receiverAt, further.aims, seen,
        [&](double done) { progress(0.5 + done); }, bySource, nullptr);
    return results;
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
    tbb::parallel_for(size_t(0), count, [&](size_t k) {
        Gathered& result = results[these[k]];
        sightings[these[k]] = {};
        look(source, receiverAt(these[k]), *aims[k]->outlook, sightings[these[k]], result);
    });
    outlooks[1] =
        Outlooks(source.parts(), these, receiverAt, patches, sightings, kNearCluster, kNearPower);
    for (size_t k = 0; k < count; ++k) aims[k]->outlook = outlooks[1].of(k);
    return outlooks;
}

void DirectLight::look(const LightSource& source, const Receiver& receiver, const Outlook& outlook,
                       Sightings& sightings, Gathered& sum) const {
    const Place place(patches, receiver);
    const std::vector<float> sumOfSeen = source.sumOfSeen(place.normal, outlook.seen);
    std::array<Block, kBlocks> blocks;
    takeSamples(
        source,
        [&](const glm::vec3&, glm::vec2 uv) {
            return source.sampleSeen(place.normal, uv, sumOfSeen);
        },
        SobolPoints(hash(seed, ~receiver.seed)), receiver.side, place, 0,
        Sightings::kMost / int(kBlocks), blocks, &sightings, sum);
}

std::vector<Gathered> DirectLight::scale(const LightBySource& before,
                                         const std::vector<LightBySource::Match>& matches,
                                         const std::function<Receiver(size_t)>& receiverAt,
                                         float targetError,
                                         const std::function<void(double)>& progress) const {
    std::vector<Gathered> results = before.scaled(matches, [&](size_t source, size_t receiver) {
        return isUnpowered(source, receiverAt(receiver).side);
    });
    // Those that took as many samples as they may did so before.
    const std::vector<Gathered> then = before.asItWas();
    Aims further = aimsAfter(results, patches, receiverAt, {}, targetError);
    size_t count = 0;
    for (size_t k = 0; k < further.receivers.size(); ++k) {
        const Gathered &now = results[further.receivers[k]], &was = then[further.receivers[k]];
        const float light = brightest(now.irradiance), lightThen = brightest(was.irradiance);
        if (now.variance * lightThen * lightThen <= kSameError * was.variance * light * light)
            continue;
        further.receivers[count] = further.receivers[k];
        further.aims[count++] = further.aims[k];
    }
    further.receivers.resize(count);
    Seen seen(sources.size());
    for (std::atomic<bool>& source : seen) source = true;
    gatherThese(results, further.receivers, receiverAt, further.aims, seen, progress, nullptr,
                nullptr);
    return results;
}

// Each source takes samples until its standard error is below `tolerance`.
Gathered DirectLight::gather(const Receiver& receiver, const Aim& aim, Seen& seen, LightPart* parts,
                             Sightings* sightings) const {
    Gathered sum;
    const Place place(patches, receiver);
    const std::vector<float> weights = unblockedWeights(place);
    const float total = std::accumulate(weights.begin(), weights.end(), 0.0f);
    for (size_t k = 0; k < sources.size(); ++k) {
        if (receiver.passingOnly && sources[k]->castsShadows &&
            patches.parentAt(receiver.side).stopsDirect)
            continue;
        const float share = weights.empty() ? 1 : weights[k] / std::max(total, 1e-30f);
        Aim own = aim;
        if (share < kSmallShare)
            own.samples = kFewSamples;
        else if (share < kMiddleShare)
            own.samples = std::max(kFewSamples, aim.samples / 2);
        if (own.samples < aim.samples) ++sum.weak;
        const LightPart part = gatherFrom(k, receiver, place, own, seen, sightings, sum);
        sum.add(part, isUnpowered(k, receiver.side));
        if (parts) parts[k] = part;
    }
    return sum;
}

// Mean of the closed form over a patch by Gauss quadrature (degree 3 on a parallelogram, 2 on a
// triangle), on more parts where it varies much: beside a source it falls from a finite value
// at the common edge with an infinite slope.
std::optional<glm::vec3> DirectLight::closedMean(const LightSource& source, const Place& place,
                                                 float tolerance, float& error) const {
    glm::vec3 low, high;
    error = 0;
    if (place.radius == 0 || place.radius < kFar * source.distance(place.centroid()))
        return source.irradiance(place.centroid(), place.normal);
    const auto coarse = quadrature(source, place, 1, low, high);
    if (!coarse) return coarse;
    // The points of the quadrature alone may be alike by symmetry.
    const auto middle = source.irradiance(place.centroid(), place.normal);
    if (brightest(glm::max(high, *middle)) <= kSmooth * brightest(glm::min(low, *middle)))
        return coarse;
    const auto fine = quadrature(source, place, 4, low, high);
    // The error falls with the square of the parts, or at a kink with their number.
    error = brightest(glm::abs(*fine - *coarse)) / 4;
    if (error <= tolerance) return fine;
    error /= 4;
    return quadrature(source, place, 16, low, high);
}

std::optional<glm::vec3> DirectLight::quadrature(const LightSource& source, const Place& place,
                                                 int parts, glm::vec3& low, glm::vec3& high) const {
    // The patch cut into parts is like a parent with that grid.
    Parent grid;
    grid.isTriangle = place.isTriangle;
    grid.countA = grid.countB = uint16_t(parts);
    static constexpr float kGauss = 0.21132487f;  // (1 - 1 / sqrt 3) / 2
    static const glm::vec2 kSquare[4] = {
        {kGauss, kGauss}, {1 - kGauss, kGauss}, {kGauss, 1 - kGauss}, {1 - kGauss, 1 - kGauss}};
    static const glm::vec2 kTriangle[3] = {
        {1.0f / 6, 1.0f / 6}, {2.0f / 3, 1.0f / 6}, {1.0f / 6, 2.0f / 3}};
    const int points = place.isTriangle ? 3 : 4;
    glm::vec3 sum(0.0f);
    low = glm::vec3(INFINITY);
    high = glm::vec3(0.0f);
    for (uint32_t part = 0; part < grid.patchCount(); ++part)
        for (int k = 0; k < points; ++k) {
            const glm::vec2 st = grid.pointOn(part, place.isTriangle ? kTriangle[k] : kSquare[k]);
            const auto value =
                source.irradiance(place.origin + st.x * place.a + st.y * place.b, place.normal);
            if (!value) return std::nullopt;
            sum += *value;
            low = glm::min(low, *value);
            high = glm::max(high, *value);
        }
    return sum / float(grid.patchCount() * points);
}

// About what each source would give without occluders, to share out the samples; empty where
// there are so few sources that it does not pay.
std::vector<float> DirectLight::unblockedWeights(const Place& place) const {
    if (sources.size() <= kFewSources || !skips.skipWeak) return {};
    static const glm::vec2 kAt[2] = {{0.25f, 0.25f}, {0.5f, 0.75f}};
    std::vector<float> weights(sources.size());
    for (size_t k = 0; k < sources.size(); ++k) {
        if (isOutOfSight(*sources[k], place)) continue;
        for (int i = 0; i < 2; ++i)
            weights[k] += brightest(
                sources[k]->sample(place.at(kAt[i]), place.normal, kAt[1 - i]).irradiance);
    }
    return weights;
}

// Samples [first, first + kBlocks * each), `each` to a block: consecutive ones are stratified.
template <class SampleAt>
void DirectLight::takeSamples(const LightSource& source, const SampleAt& sampleAt,
                              const SobolPoints& points, uint32_t side, const Place& place,
                              int first, int each, std::array<Block, kBlocks>& blocks,
                              Sightings* sightings, Gathered& sum) const {
    std::array<ShadowRay, Visibility::kPacket> rays;
    struct Held {
        glm::vec3 irradiance;
        Block* block;
        uint32_t part;
    };
    std::array<Held, Visibility::kPacket> held;
    int count = 0;
    auto see = [&](Block& block, const glm::vec3& irradiance, const glm::vec3& direction) {
        block.visible += irradiance;
        block.grazing += brightest(irradiance) * grazingShare(glm::dot(direction, place.normal));
    };
    auto trace = [&] {
        std::array<float, Visibility::kPacket> shares;
        visibility.visibleShares(side, rays.data(), count, shares.data());
        for (size_t k = 0; k < size_t(count); ++k) {
            see(*held[k].block, shares[k] * held[k].irradiance, rays[k].direction);
            if (sightings) sightings->add(held[k].part, shares[k] > 0);
        }
        sum.rays += uint64_t(count);
        count = 0;
    };
    for (int i = 0; i < int(kBlocks) * each; ++i) {
        const glm::vec4 u = points[uint32_t(first + i)];
        const glm::vec3 point = place.at({u.x, u.y});
        const LightSample sample = sampleAt(point, glm::vec2(u.z, u.w));
        Block& block = blocks[size_t(i / each)];
        ++block.count;
        if (brightest(sample.irradiance) <= 0) continue;
        block.open += sample.irradiance;
        if (!source.castsShadows) {
            see(block, sample.irradiance, sample.direction);
            continue;
        }
        held[size_t(count)] = {sample.irradiance, &block, sample.part};
        rays[size_t(count++)] = {point, sample.direction, sample.distance};
        if (count == Visibility::kPacket) trace();
    }
    if (count > 0) trace();
}

LightPart DirectLight::gatherFrom(size_t index, const Receiver& receiver, const Place& place,
                                  const Aim& aim, Seen& seen, Sightings* sightings,
                                  Gathered& sum) const {
    const float tolerance = aim.tolerance;
    const LightSource& source = *sources[index];
    const bool hasParts = !source.parts().empty();
    const Outlook* const outlook = hasParts ? aim.outlook : nullptr;
    const int darkSamples = outlook && outlook->isDark ? kDarkSamplesOfDark : kDarkSamples;
    const bool isGuided = outlook && !outlook->seen.empty();
    if (isOutOfSight(source, place)) {
        ++sum.hidden;
        return {};
    }
    // Inside a solid it is dark, unless a source is in there too: look before taking all
    // samples.
    const bool isInside = skips.skipInside && receiver.side % 2 == 1 &&
                          patches.parents[patches.parentOf[receiver.side / 2]].isSolid;
    if (isInside) ++sum.inside;
    int next = isInside ? std::min(kFewSamples, aim.samples) : aim.samples;
    std::array<Block, kBlocks> blocks;
    Block all;
    const SobolPoints points(hash(seed, hash(receiver.seed, uint32_t(index))));
    std::optional<glm::vec3> closed;
    float closedError = 0, variance = 0;
    const std::vector<float> sumOfSeen =
        isGuided ? source.sumOfSeen(place.normal, outlook->seen) : std::vector<float>();
    auto sampleAt = [&](const glm::vec3& point, glm::vec2 uv) {
        return isGuided ? source.sampleSeen(place.normal, uv, sumOfSeen)
                        : source.sample(point, place.normal, uv);
    };
    for (;;) {
        takeSamples(source, sampleAt, points, receiver.side, place, all.count,
                    (next - all.count) / int(kBlocks), blocks, hasParts ? sightings : nullptr, sum);
        all = {};
        for (const Block& block : blocks) all.add(block);
        if (skips.skipLit && !closed && !isGuided &&
            (brightest(all.open) <= 0 || brightest(all.visible) > 0))
            closed = closedMean(source, place, tolerance, closedError);
        // No sample faced the receiver: few of them may, beside a source of many faces.
        if (brightest(all.open) <= 0 && all.count < source.mostSamples() &&
            (source.isNarrow || (closed && brightest(*closed) > 0))) {
            next = 4 * all.count;
            continue;
        }
        const bool isLit = all.visible == all.open, isDark = brightest(all.visible) <= 0;
        const float part = isInside                                  ? 0
                           : source.surrounds()                      ? kMissed
                           : aim.isBesideShadow && (isLit || isDark) ? kMissedEdge
                                                                     : 0;
        const float missed = part * brightest(all.open) / (float(all.count) * float(all.count));
        if (isDark) {
            if (missed > tolerance && all.count < darkSamples && seen[index]) {
                next = 4 * all.count;
                continue;
            }
            return {glm::vec3(0.0f), missed * missed, 0, 0};
        }
        // By the first pass alone, so that the order of the receivers does not matter.
        if (std::isinf(tolerance)) seen[index] = true;
        const glm::vec3 mean = all.estimate(closed);
        variance = missed * missed;
        for (const Block& block : blocks) {
            const float d = brightest(glm::abs(block.estimate(closed) - mean));
            variance += d * d / (kBlocks * (kBlocks - 1));
        }
        if (all.count >= aim.samples &&
            (variance <= tolerance * tolerance || all.count >= source.mostSamples()))
            break;
        next = all.count < aim.samples ? aim.samples : (isGuided ? 2 : 4) * all.count;
    }
    if (closed && all.visible == all.open) ++sum.unblocked;
    const float visible = std::min(1.0f, brightest(all.visible) / brightest(all.open));
    const glm::vec3 irradiance = all.estimate(closed);
    return {irradiance, variance + closedError * closedError,
            brightest(closed ? *closed : all.open / float(all.count)) *
                std::sqrt(visible * (1 - visible)),
            brightest(irradiance) * all.grazing / brightest(all.visible)};
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

glm::vec3 DirectLight::sample(const Receiver& receiver, uint32_t index) const {
    const Place place(patches, receiver);
    glm::vec3 sum(0.0f);
    for (size_t k = 0; k < sources.size(); ++k) {
        const glm::vec4 u = sobolPoint(index, hash(seed, hash(receiver.seed, uint32_t(k))));
        const glm::vec3 point = place.at({u.x, u.y});
        const LightSample sample = sources[k]->sample(point, place.normal, {u.z, u.w});
        if (brightest(sample.irradiance) <= 0) continue;
        const float share =
            sources[k]->castsShadows
                ? visibility.visibleShare(receiver.side, point, sample.direction, sample.distance)
                : 1;
        sum += share * sample.irradiance;
    }
    return sum;
}

void DirectLight::unblocked(uint32_t side, const glm::vec3* points, size_t count, float even,
                            glm::vec3* light) const {
    const Place place(patches, {side, patches.normal(side), std::nullopt, side});
    std::fill(light, light + count, glm::vec3(0.0f));
    // The same for all sources, so that sets of them get the same in one bake and in several.
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

bool DirectLight::isOutOfSight(const LightSource& source, const Place& place) const {
    return skips.skipFacing && source.isOutOfSight(place.middle, place.normal, place.radius);
}

std::vector<glm::dvec3> DirectLight::escapedShares() const {
    std::vector<glm::dvec3> shares(sources.size(), glm::dvec3(0.0));
    if (sources.empty()) return shares;
    const uint32_t rays = std::max(kLeastEscapeRays, kEscapeRays / uint32_t(sources.size()));
    for (size_t k = 0; k < sources.size(); ++k) {
        if (brightest(sources[k]->power()) <= 0 || !sources[k]->castsShadows) continue;
        tbb::enumerable_thread_specific<glm::dvec3> missed(glm::dvec3(0.0));
        tbb::parallel_for(tbb::blocked_range<uint32_t>(0, rays, 256), [&](const auto& range) {
            for (uint32_t i = range.begin(); i < range.end(); ++i) {
                const EmittedRay ray =
                    sources[k]->emit(sobolPoint(i, hash(seed, uint32_t(k))), patches.radius);
                const float share =
                    ray.side
                        ? visibility.visibleShare(*ray.side, ray.origin, ray.direction, INFINITY)
                        : visibility.escapingShare(ray.start(visibility.offset()), ray.direction);
                missed.local() += double(share) * glm::dvec3(ray.weight);
            }
        });
        for (const glm::dvec3& part : missed) shares[k] += part / double(rays);
    }
    return shares;
}

}  // namespace raybundle
