// SPDX-License-Identifier: GPL-3.0-or-later
//
// What one receiver gets from the sources: samples of each, until their error is small enough.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "direct_light/direct_light.h"
#include "direct_light/outlook.h"
#include "lights/receiver_place.h"

namespace raybundle {
namespace {

// Shadow rays per receiver and source for sources of little weight.
constexpr int kFewSamples = 4;
constexpr size_t kFewSources = 4;
// A source of less than this share of the light that a receiver could get takes few samples, one of
// less than the second half as many as others.
constexpr float kSmallShare = 0.06f, kMiddleShare = 0.25f;
// What n samples tell nothing of: a part s of a source is missed by all with the probability
// (1 - s)^n, and then s is wrong; this over n at most, in the mean.
constexpr float kMissed = 0.37f;
// The same beside the edge of a shadow, where most receivers are wholly lit or dark after all; and
// the root of the probability that one has what its neighbour has. The true error is 0.47 of the
// stated one in the edge of a plate's shadow, steps of samples included (first_shot_test.cpp).
constexpr float kMissedEdge = 0.2f, kAsNeighbour = 0.5f;
// Where part of the samples is blocked: stratified samples of a straight edge are alike in all
// blocks, though they tell its place no better than to this share of one of them.
constexpr float kStepOfSamples = 0.6f;
// A receiver that is in the dark after so many samples of a source that surrounds it stays there.
// One whose neighbours are too, after fewer.
constexpr int kDarkSamples = 256, kDarkSamplesOfDark = 64;
// A closed form whose largest value is so many times its smallest on a patch takes more points.
constexpr float kSmooth = 1.1f;

// Share of a source that n samples may have missed of which all are blocked, or none, where a
// neighbour has so much contrast, as a share of the source: as much as that neighbour sees of it,
// or does not see, with the probability that all miss it.
float missedBeside(float contrast, float n) {
    const float half = std::min(contrast, 0.5f);
    const float step = 0.5f * (1 - std::sqrt(1 - 4 * half * half));
    return std::max(kMissedEdge / n, kAsNeighbour * step * std::exp(-0.5f * n * step));
}

}  // namespace

// Running sums of one source over a block of samples.
struct DirectLight::Block {
    glm::vec3 open{0.0f};     // sum of the samples as if unblocked
    glm::vec3 visible{0.0f};  // sum of those that are not blocked
    glm::vec4 angles{0.0f};   // the same, of their brightest channels times angleTerms
    int count = 0;

    void add(const Block& other) {
        open += other.open;
        visible += other.visible;
        angles += other.angles;
        count += other.count;
    }
    // Means of angleTerms. Less what few samples of which some are much brighter are off in the
    // mean (Quenouille, "Notes on Bias in Estimation", 1956).
    template <class Blocks>
    glm::vec4 meanAngles(const Blocks& blocks) const {
        const glm::vec4 mean = angles / brightest(visible);
        glm::vec4 sum(0.0f);
        for (const Block& block : blocks) {
            const float rest = brightest(visible - block.visible);
            if (!(rest > 0)) return mean;
            sum += (angles - block.angles) / rest;
        }
        const float n = float(blocks.size());
        return glm::clamp(n * mean - (n - 1) / n * sum, 0.0f, 1.0f);
    }
    // What a block's angleTerms add to the means of all blocks.
    glm::vec4 surplusAngles(const Block& block) const {
        const float all = brightest(visible);
        return float(kBlocks) * (block.angles - angles / all * brightest(block.visible)) / all;
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

// Where the light of a source comes from.
struct DirectLight::Origins {
    uint32_t random;  // differs from receiver to receiver
    Incoming incoming;
    float brightness = 0;

    void add(const glm::vec3& direction, float more) {
        brightness += more;
        random = hash(random, 0);
        if (more > 0) incoming.add(direction, more / brightness, random);
    }
};

// About what each source would give without occluders, to share out the samples: by one sample, or
// another where that gets nothing. Empty where there are so few sources that it does not pay.
std::vector<float> DirectLight::unblockedWeights(const Place& place) const {
    if (sources.size() <= kFewSources || !skips.skipWeak) return {};
    static const glm::vec2 kAt[2] = {{0.25f, 0.25f}, {0.5f, 0.75f}};
    std::vector<float> weights(sources.size());
    for (size_t k = 0; k < sources.size(); ++k) {
        if (isOutOfSight(*sources[k], place)) continue;
        for (int i = 0; i < 2 && !(weights[k] > 0); ++i)
            weights[k] = brightest(
                sources[k]->sample(place.at(kAt[i]), place.normal, kAt[1 - i]).irradiance);
    }
    return weights;
}

AngleFactors DirectLight::shownByAngle(uint32_t side, const glm::vec4& angles) const {
    AngleFactors factors{};
    if (!showsByAngle) return factors;
    constexpr float kLeastShown = 0.05f;  // less shows too little of the light to be clean
    const Parent& parent = patches.parentAt(side);
    const Material& material = scene.materialOf(parent.instance, size_t(parent.face));
    const glm::vec3 all = glm::max(material.shown(side % 2, angles), kLeastShown);
    for (size_t term = 0; term < factors.size(); ++term)
        factors[term] = material.shownByAngle[side % 2][term] / all;
    return factors;
}

// Each source takes samples until its standard error is below its share of the tolerance.
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
        // The variance that the receiver may have is shared out by that, or evenly: what is bright
        // may be hidden. Of few sources seldom more than one has noise.
        if (sources.size() > kFewSources)
            own.tolerance *=
                std::sqrt(std::max(weights.empty() ? 0 : share, 1 / float(sources.size())));
        if (share < kSmallShare)
            own.samples = kFewSamples;
        else if (share < kMiddleShare)
            own.samples = std::max(kFewSamples, aim.samples / 2);
        if (own.samples < aim.samples) ++sum.weak;
        const LightPart part = gatherFrom(k, receiver, place, own, seen, sightings, sum);
        sum.add(uint32_t(k), part, isUnpowered(k, receiver.side), hash(receiver.seed, uint32_t(k)));
        if (parts) parts[k] = part;
    }
    return sum;
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

// Mean of the closed form over a patch, if the source does not know it, by Gauss quadrature (degree
// 3 on a parallelogram, 2 on a triangle), on more parts where it varies much: beside a source it
// falls from a finite value at the common edge with an infinite slope.
std::optional<glm::vec3> DirectLight::closedMean(const LightSource& source, const Place& place,
                                                 float tolerance, float& error) const {
    glm::vec3 low, high;
    error = 0;
    if (place.radius == 0 || place.radius < source.farPatch() * source.distance(place.centroid()))
        return source.irradiance(place.centroid(), place.normal);
    if (const auto mean = source.meanIrradiance(place)) return mean;
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
    const auto finest = quadrature(source, place, 16, low, high);
    error = brightest(glm::abs(*finest - *fine)) / 4;
    return finest;
}

// Takes the first `count` samples, or doubles those in `blocks` until there are so many: powers of
// two. Each block has consecutive ones, from a multiple of their number on, so that it is
// stratified like all of them: of others the blocks would differ by more than their mean is off.
template <class SampleAt>
void DirectLight::takeSamples(const LightSource& source, const SampleAt& sampleAt,
                              const SobolPoints& points, uint32_t side, const Place& place,
                              int count, std::array<Block, kBlocks>& blocks, Sightings* sightings,
                              Origins* origins, Gathered& sum) const {
    std::array<ShadowRay, Visibility::kPacket> rays;
    struct Held {
        glm::vec3 irradiance;
        Block* block;
        uint32_t part;
    };
    std::array<Held, Visibility::kPacket> held;
    int waiting = 0;
    const bool choosesPlaces = source.choosesPlaces();
    auto see = [&](Block& block, const glm::vec3& irradiance, const glm::vec3& direction) {
        block.visible += irradiance;
        const float brightness = brightest(irradiance);
        block.angles += brightness * angleTerms(glm::dot(direction, place.normal));
        if (origins) origins->add(direction, brightness);
    };
    auto trace = [&] {
        std::array<float, Visibility::kPacket> shares;
        visibility.visibleShares(side, rays.data(), waiting, shares.data());
        for (size_t k = 0; k < size_t(waiting); ++k) {
            see(*held[k].block, shares[k] * held[k].irradiance, rays[k].direction);
            if (sightings) sightings->add(held[k].part, shares[k] > 0);
        }
        sum.rays += uint64_t(waiting);
        waiting = 0;
    };
    auto take = [&](int i, Block& block) {
        const glm::vec4 u = points[uint32_t(i)];
        const auto [point, weight] =
            choosesPlaces ? source.placeOn(place, {u.x, u.y}) : PatchPoint{place.at({u.x, u.y})};
        LightSample sample = sampleAt(point, glm::vec2(u.z, u.w));
        sample.irradiance *= weight;
        ++block.count;
        if (brightest(sample.irradiance) <= 0) return;
        block.open += sample.irradiance;
        if (!source.castsShadows) {
            see(block, sample.irradiance, sample.direction);
            return;
        }
        held[size_t(waiting)] = {sample.irradiance, &block, sample.part};
        rays[size_t(waiting++)] = sample.ray(point);
        if (waiting == Visibility::kPacket) trace();
    };
    for (int taken = int(kBlocks) * blocks[0].count; taken < count;) {
        int each = count / int(kBlocks);
        if (taken > 0) {
            each = taken / 2;
            for (size_t k = 0; k < kBlocks / 2; ++k) {
                const Block second = blocks[2 * k + 1];
                blocks[k] = blocks[2 * k];
                blocks[k].add(second);
            }
            std::fill(blocks.begin() + kBlocks / 2, blocks.end(), Block());
        }
        for (; taken < int(kBlocks) * each; ++taken) take(taken, blocks[size_t(taken / each)]);
        if (waiting > 0) trace();
    }
}

LightPart DirectLight::gatherFrom(size_t index, const Receiver& receiver, const Place& place,
                                  const Aim& aim, Seen& seen, Sightings* sightings,
                                  Gathered& sum) const {
    const float tolerance = aim.tolerance;
    const LightSource& source = *sources[index];
    const int mostSamples = aim.mostGrowth * source.mostSamples();
    const bool hasParts = !source.parts().empty();
    const Outlook* const outlook = hasParts ? aim.outlook : nullptr;
    const int darkSamples =
        aim.mostGrowth * (outlook && outlook->isDark ? kDarkSamplesOfDark : kDarkSamples);
    const bool isGuided = outlook && !outlook->seen.empty();
    // Among receivers that look alike a part that one alone sees is missed there alone, and one
    // that all see is missed by all their samples: in the mean of squares over so many, what is
    // missed is less by their number at least.
    const float alike = outlook ? float(outlook->receivers) : 1.0f;
    if (isOutOfSight(source, place)) {
        ++sum.hidden;
        return {};
    }
    // Inside a solid it is dark, unless a source is in there too: look before taking all
    // samples.
    const bool isInside = skips.skipInside && !source.staysInside() && receiver.side % 2 == 1 &&
                          patches.parents[patches.parentOf[receiver.side / 2]].isSolid;
    if (isInside) ++sum.inside;
    int next = isInside ? std::min(kFewSamples, aim.samples) : aim.samples;
    std::array<Block, kBlocks> blocks;
    Block all;
    const uint32_t ownSeed = hash(seed, hash(receiver.seed, uint32_t(index)));
    const SobolPoints points(ownSeed);
    Origins origins{ownSeed, {}};
    const bool keepsOrigins = !patches.scattering.empty() && !receiver.point;
    std::optional<glm::vec3> closed;
    float closedError = 0, variance = 0;
    const std::vector<float> sumOfSeen =
        isGuided ? source.sumOfSeen(place.normal, outlook->seen) : std::vector<float>();
    auto sampleAt = [&](const glm::vec3& point, glm::vec2 uv) {
        return isGuided ? source.sampleSeen(place.normal, uv, sumOfSeen)
                        : source.sample(point, place.normal, uv);
    };
    for (;;) {
        takeSamples(source, sampleAt, points, receiver.side, place, next, blocks,
                    hasParts ? sightings : nullptr, keepsOrigins ? &origins : nullptr, sum);
        all = {};
        for (const Block& block : blocks) all.add(block);
        if (skips.skipLit && !closed && !isGuided &&
            (brightest(all.open) <= 0 || brightest(all.visible) > 0))
            closed = closedMean(source, place, tolerance, closedError);
        // No sample faced the receiver: few of them may, beside a source of many faces.
        if (brightest(all.open) <= 0 && all.count < mostSamples &&
            (source.isNarrow || (closed && brightest(*closed) > 0))) {
            next = 4 * all.count;
            continue;
        }
        const bool isLit = all.visible == all.open, isDark = brightest(all.visible) <= 0;
        const float n = float(all.count);
        const float open = brightest(all.open) / n;
        const float part = isInside             ? 0
                           : source.surrounds() ? kMissed / n
                           : aim.besideShadow > 0 && (isLit || isDark)
                               ? missedBeside(aim.besideShadow / open, n)
                               : 0;
        const float missed = part * open;
        if (isDark) {
            if (missed > tolerance && all.count < darkSamples && seen[index]) {
                next = 4 * all.count;
                continue;
            }
            if (!source.surrounds()) sum.unblockedLight += open;
            return {glm::vec3(0.0f), missed * missed / alike, 0, glm::vec4(0.0f), {}};
        }
        // By the first pass alone, so that the order of the receivers does not matter.
        if (std::isinf(tolerance)) seen[index] = true;
        const glm::vec3 mean = all.estimate(closed);
        variance = missed * missed / alike;
        float wanted = missed * missed;
        const AngleFactors byAngle =
            shownByAngle(receiver.side, all.angles / brightest(all.visible));
        for (const Block& block : blocks) {
            const glm::vec3 shown = mean * sumOfTerms(byAngle, all.surplusAngles(block));
            const float d = brightest(glm::abs(block.estimate(closed) - mean + shown));
            variance += d * d / (kBlocks * (kBlocks - 1));
            wanted += d * d / (kBlocks * (kBlocks - 1));
        }
        if (!isLit) {
            const float step = kStepOfSamples * open / n;
            variance += step * step;
            wanted += step * step;
        }
        if (all.count >= aim.samples &&
            (wanted <= tolerance * tolerance || all.count >= mostSamples))
            break;
        next = all.count < aim.samples ? aim.samples
                                       : (isGuided || source.surrounds() ? 2 : 4) * all.count;
    }
    if (closed && all.visible == all.open) ++sum.unblocked;
    const float visible = std::min(1.0f, brightest(all.visible) / brightest(all.open));
    const glm::vec3 irradiance = all.estimate(closed);
    if (brightest(irradiance) > 0)
        origins.incoming.weight =
            brightest(all.visible) / (float(all.count) * brightest(irradiance));
    const float open = brightest(closed ? *closed : all.open / float(all.count));
    const float contrast = open * std::sqrt(visible * (1 - visible));
    if (!source.surrounds()) {
        sum.unblockedLight += open;
        sum.lampLight += brightest(irradiance);
        sum.shadowContrast += contrast;
    }
    return {irradiance, variance + closedError * closedError, contrast,
            brightest(irradiance) * all.meanAngles(blocks), origins.incoming};
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
        SobolPoints(hash(seed, ~receiver.seed)), receiver.side, place, Sightings::kMost, blocks,
        &sightings, nullptr, sum);
}

}  // namespace raybundle
