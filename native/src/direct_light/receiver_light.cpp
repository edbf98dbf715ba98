// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light of the sources at one receiver: takes samples of each source until their error is small
// enough.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "direct_light/closed_mean.h"
#include "direct_light/direct_light.h"
#include "direct_light/outlook.h"
#include "direct_light/source_samples.h"
#include "lights/joint_source.h"
#include "lights/receiver_place.h"
#include "patches/side.h"

namespace raybundle {
namespace {

// Samples for sources of little weight.
constexpr int kFewSamples = 4;
// A source that gives less than kSmallShare of the light that a receiver could get takes
// kFewSamples. A source below kMiddleShare takes half as many samples as others.
constexpr float kSmallShare = 0.06f, kMiddleShare = 0.25f;
// At least this number of such sources are sampled as one, each with at least this share of the
// weight of all sources.
constexpr size_t kFewestJoined = 12;
constexpr float kLeastWeight = 1e-4f;
// n samples all miss a part with the share s of a source with the probability (1 - s)^n; the
// estimate is then off by s. The mean of this error over all samples is at most kMissed / n.
constexpr float kMissed = 0.37f;
// kMissedEdge takes the place of kMissed beside the edge of a shadow, where most receivers turn out
// to be fully lit or fully dark. kAsNeighbour is the square root of the probability that a receiver
// has the same visible share as its neighbour. In the edge of a plate's shadow the true error is
// 0.47 of the stated one, the steps of samples included (shadows_test.cpp).
constexpr float kMissedEdge = 0.2f, kAsNeighbour = 0.5f;
// Error of partly blocked samples, in units of the share of one sample. Stratified samples of a
// straight edge agree in all blocks, although they locate the edge no better than to this fraction
// of a sample.
constexpr float kStepOfSamples = 0.6f;
// A receiver that is dark after kDarkSamples samples of a source that surrounds it is taken for
// dark. If its neighbours are dark too, kDarkSamplesOfDark samples suffice.
constexpr int kDarkSamples = 256, kDarkSamplesOfDark = 64;

// Returns the share of a source that n samples may have missed if all or none of them are blocked
// and a neighbour has the given contrast, as a share of the source. The neighbour then sees the
// share `step` of the source, or all but this share; the result includes the probability that all n
// samples miss it.
float missedBeside(float contrast, float n) {
    const float half = std::min(contrast, 0.5f);
    const float step = 0.5f * (1 - std::sqrt(1 - 4 * half * half));
    return std::max(kMissedEdge / n, kAsNeighbour * step * std::exp(-0.5f * n * step));
}

// Returns by how much the mean angleTerms of all blocks would change with the given block.
glm::vec4 surplusAngles(const SampleSums& all, const SampleSums& block) {
    const float light = brightest(all.visible);
    return float(kSampleBlocks) * (block.angles - all.angles / light * brightest(block.visible)) /
           light;
}

}  // namespace

// Samples one source at one receiver until the error is small enough.
class DirectLight::SourceGather {
  public:
    // `random` selects the random numbers, and must differ from source to source.
    SourceGather(const DirectLight& light, const LightSource& source, uint32_t random,
                 const Receiver& receiver, const ReceiverPlace& place, const Aim& aim)
        : light(light),
          source(source),
          receiver(receiver),
          place(place),
          aim(aim),
          hasParts(!source.parts().empty()),
          outlook(hasParts ? aim.outlook : nullptr),
          isGuided(outlook && !outlook->seen.empty()),
          isInside(light.skips.skipInside && !source.staysInside() && isBack(receiver.side) &&
                   light.patches.parentAt(receiver.side).isSolid),
          mostSamples(aim.mostGrowth * source.mostSamples()),
          seed(hash(light.seed, hash(receiver.seed, random))),
          samples(light.visibility, source, place, receiver.side, seed),
          origins(seed) {
        if (isGuided) samples.guideBy(outlook->seen);
        if (!light.patches.scattering.empty() && !receiver.point) samples.noteOrigins(&origins);
    }

    // Takes the samples and returns the light. `seen` is set if the receiver gets light of the
    // source. `sightings` receives where the samples went; may be null. Adds the counts of rays to
    // `sum`.
    LightPart run(std::atomic<bool>& seen, Sightings* sightings, Gathered& sum) {
        if (isInside) ++sum.inside;
        if (hasParts) samples.noteSightings(sightings);
        const LightPart part = takeSamples(seen, sum);
        sum.rays += samples.rays();
        return part;
    }

  private:
    LightPart takeSamples(std::atomic<bool>& seen, Gathered& sum) {
        const int darkSamples =
            aim.mostGrowth * (outlook && outlook->isDark ? kDarkSamplesOfDark : kDarkSamples);
        // The inside of a solid is dark unless a source is in there too. A few samples find out
        // before all are taken.
        int next = isInside ? std::min(kFewSamples, aim.samples) : aim.samples;
        for (;;) {
            take(next);
            // No sample faced the receiver. A source of many faces may have few that do, and a cone
            // may light a small part of the receiver, so take more samples.
            if (brightest(all.open) <= 0 && all.count < mostSamples &&
                (source.isNarrow || (closed ? brightest(*closed) > 0 : source.isSteepOn(place)))) {
                next = 4 * all.count;
                continue;
            }
            const float missed = missedShare() * open();
            if (isDark()) {
                if (missed > aim.tolerance && all.count < darkSamples && seen) {
                    next = 4 * all.count;
                    continue;
                }
                return darkPart(missed, sum);
            }
            // Only the first pass, which has an infinite tolerance, sets `seen`, so that the order
            // of the receivers does not matter.
            if (std::isinf(aim.tolerance)) seen = true;
            const float wanted = measureVariance(missed);
            if (all.count >= aim.samples &&
                (wanted <= aim.tolerance * aim.tolerance || all.count >= mostSamples))
                return litPart(sum);
            next = all.count < aim.samples ? aim.samples
                                           : (isGuided || source.surrounds() ? 2 : 4) * all.count;
        }
    }

    // Takes samples until there are `count`, and the closed form if it may be needed.
    void take(int count) {
        samples.take(count);
        all = samples.all();
        if (!light.skips.skipLit || closed || isGuided) return;
        if (!(brightest(all.open) <= 0 || brightest(all.visible) > 0)) return;
        if (const auto mean = closedMean(source, place, aim.tolerance)) {
            closed = mean->irradiance;
            closedError = mean->error;
        }
    }

    // These functions judge by all samples so far.
    bool isLit() const { return all.visible == all.open; }
    bool isDark() const { return brightest(all.visible) <= 0; }
    // Returns the irradiance if nothing blocked the source, W/m^2.
    float open() const { return brightest(all.open) / float(all.count); }

    // Returns the share of the source that all samples may have missed.
    float missedShare() const {
        const float n = float(all.count);
        if (isInside) return 0;
        if (source.surrounds()) return kMissed / n;
        if (!isLit() && !isDark()) return 0;
        const float beside = aim.besideShadow > 0 ? missedBeside(aim.besideShadow / open(), n) : 0;
        return std::max(beside, aim.mayMiss ? kMissed / n : 0);
    }

    // Variance of the light that samples may have missed, (W/m^2)^2. Receivers with a common
    // outlook take different samples: a part that only one of them sees is missed only there, and a
    // part that all of them see is missed only if all of them miss it. The mean square over these
    // receivers is therefore smaller by at least their number.
    float varianceOfMissed(float missed) const {
        return missed * missed / (outlook ? float(outlook->receivers) : 1.0f);
    }

    // Computes `variance` and returns the variance that must fall below the squared tolerance.
    float measureVariance(float missed) {
        const glm::vec3 mean = all.estimate(closed);
        variance = varianceOfMissed(missed);
        float wanted = missed * missed;
        const AngleFactors byAngle =
            light.shownByAngle(receiver.side, all.angles / brightest(all.visible));
        for (const SampleSums& block : samples.blocks()) {
            const glm::vec3 shown = mean * sumOfTerms(byAngle, surplusAngles(all, block));
            const float d = brightest(glm::abs(block.estimate(closed) - mean + shown));
            variance += d * d / (kSampleBlocks * (kSampleBlocks - 1));
            wanted += d * d / (kSampleBlocks * (kSampleBlocks - 1));
        }
        if (!isLit()) {
            const float step = kStepOfSamples * open() / float(all.count);
            variance += step * step;
            wanted += step * step;
        }
        return wanted;
    }

    LightPart darkPart(float missed, Gathered& sum) const {
        if (!source.surrounds()) sum.unblockedLight += open();
        return {glm::vec3(0.0f), varianceOfMissed(missed), 0, glm::vec4(0.0f), {}};
    }

    LightPart litPart(Gathered& sum) {
        if (closed && isLit()) ++sum.unblocked;
        const float visible = std::min(1.0f, brightest(all.visible) / brightest(all.open));
        const glm::vec3 irradiance = all.estimate(closed);
        if (brightest(irradiance) > 0)
            origins.incoming.weight =
                brightest(all.visible) / (float(all.count) * brightest(irradiance));
        const float unblocked = brightest(closed ? *closed : all.open / float(all.count));
        const float contrast = unblocked * std::sqrt(visible * (1 - visible));
        if (!source.surrounds()) {
            sum.unblockedLight += unblocked;
            sum.lampLight += brightest(irradiance);
            sum.shadowContrast += contrast;
        }
        return {irradiance, variance + closedError * closedError, contrast,
                brightest(irradiance) * samples.meanAngles(), origins.incoming};
    }

    const DirectLight& light;
    const LightSource& source;
    const Receiver& receiver;
    const ReceiverPlace& place;
    const Aim& aim;
    const bool hasParts;
    const Outlook* const outlook;  // on the source; null if there is none
    const bool isGuided;           // whether samples follow the visible parts of the source
    const bool isInside;           // whether the receiver is the inside of a solid
    const int mostSamples;
    const uint32_t seed;
    SourceSamples samples;
    Origins origins;
    SampleSums all;                   // sums over all samples so far
    std::optional<glm::vec3> closed;  // the closed form, W/m^2
    float closedError = 0, variance = 0;
};

// Returns about the light that each source would give without occluders, to distribute the samples.
// It uses one sample of each source, or a second one if the first gets no light. Returns an empty
// vector if there are too few sources for this to pay.
std::vector<float> DirectLight::unblockedWeights(const ReceiverPlace& place) const {
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

// Returns the factor on the tolerance of a source that gives this share of the light. The variance
// that the receiver may have is divided among the sources by their weight, but each gets at least
// an equal share, because a bright source may be hidden. With few sources seldom more than one has
// noise, so that each may have all of the variance.
float DirectLight::shareOfTolerance(float share) const {
    if (sources.size() <= kFewSources) return 1;
    return std::sqrt(std::max(share, 1 / float(sources.size())));
}

// Returns the dim sources of a receiver, joined: those with power of their own, and those without.
// A few sources are not joined, nor are sources beside one whose light at the receiver overflows.
std::vector<JointSource> DirectLight::jointSources(uint32_t side, const ReceiverPlace& place,
                                                   const std::vector<float>& weights) const {
    const float total = std::accumulate(weights.begin(), weights.end(), 0.0f);
    if (weights.size() < kFewestJoined || !std::isfinite(total)) return {};
    std::vector<JointSource> joints(2, JointSource(sources));
    for (uint32_t k = 0; k < sources.size(); ++k)
        if (weights[k] < kSmallShare * total && JointSource::canJoin(*sources[k]) &&
            !isOutOfSight(*sources[k], place) && !sources[k]->isSteepOn(place))
            // A source whose samples were below the horizon may light another part of the receiver.
            joints[isUnpowered(k, side)].add(k, std::max(weights[k], kLeastWeight * total));
    for (size_t k = joints.size(); k-- > 0;)
        if (joints[k].joined().size() < kFewestJoined) joints.erase(joints.begin() + ptrdiff_t(k));
    return joints;
}

AngleFactors DirectLight::shownByAngle(uint32_t side, const glm::vec4& angles) const {
    AngleFactors factors{};
    if (!showsByAngle) return factors;
    // Least shown share: below it a side shows too little of its light to look clean.
    constexpr float kLeastShown = 0.05f;
    const Parent& parent = patches.parentAt(side);
    const MaterialSide& surface =
        scene.materialOf(parent.instance, size_t(parent.face)).sides[isBack(side)];
    const glm::vec3 all = glm::max(surface.shown(angles), kLeastShown);
    for (size_t term = 0; term < factors.size(); ++term)
        factors[term] = surface.shownByAngle[term] / all;
    return factors;
}

// Samples each source until its standard error is below its share of the tolerance.
Gathered DirectLight::gather(const Receiver& receiver, const Aim& aim, Seen& seen, LightPart* parts,
                             Sightings* sightings) const {
    Gathered sum;
    const ReceiverPlace place(patches, receiver);
    const bool onlySurrounding = receiver.of == Receiver::Of::SURROUNDING;
    const std::vector<float> weights =
        onlySurrounding ? std::vector<float>() : unblockedWeights(place);
    const float total = std::accumulate(weights.begin(), weights.end(), 0.0f);
    // Dim sources are joined, unless the light of each is to be kept.
    const std::vector<JointSource> joints = parts || weights.empty() || receiver.passingOnly
                                                ? std::vector<JointSource>()
                                                : jointSources(receiver.side, place, weights);
    std::vector<bool> isJoined(joints.empty() ? 0 : sources.size(), false);
    for (const JointSource& joint : joints)
        for (const uint32_t k : joint.joined()) isJoined[k] = true;
    for (size_t k = 0; k < sources.size(); ++k) {
        if (!isJoined.empty() && isJoined[k]) continue;
        if (receiver.of != Receiver::Of::ALL && sources[k]->surrounds() != onlySurrounding)
            continue;
        if (receiver.passingOnly && sources[k]->castsShadows &&
            patches.parentAt(receiver.side).stopsDirect)
            continue;
        const float share = weights.empty() ? 1 : weights[k] / std::max(total, 1e-30f);
        Aim own = aim;
        own.tolerance *= shareOfTolerance(weights.empty() ? 0 : share);
        if (share < kSmallShare)
            own.samples = kFewSamples;
        else if (share < kMiddleShare)
            own.samples = std::max(kFewSamples, aim.samples / 2);
        if (own.samples < aim.samples) {
            own.mayMiss = true;
            ++sum.weak;
        }
        const LightPart part = gatherFrom(k, receiver, place, own, seen, sightings, sum);
        sum.add(uint32_t(k), part, isUnpowered(k, receiver.side), hash(receiver.seed, uint32_t(k)));
        if (parts) parts[k] = part;
    }
    for (const JointSource& joint : joints) {
        Aim own = aim;
        own.outlook = nullptr;
        own.tolerance *= shareOfTolerance(joint.all() / std::max(total, 1e-30f));
        sum.weak += joint.joined().size();
        const uint32_t random = hash(receiver.seed, ~joint.joined().front());
        const LightPart part = SourceGather(*this, joint, random, receiver, place, own)
                                   .run(seen[sources.size()], nullptr, sum);
        sum.add(joint.strongest(), part, isUnpowered(joint.strongest(), receiver.side), random);
    }
    return sum;
}

LightPart DirectLight::gatherFrom(size_t index, const Receiver& receiver,
                                  const ReceiverPlace& place, const Aim& aim, Seen& seen,
                                  Sightings* sightings, Gathered& sum) const {
    if (isOutOfSight(*sources[index], place)) {
        ++sum.hidden;
        return {};
    }
    return SourceGather(*this, *sources[index], uint32_t(index), receiver, place, aim)
        .run(seen[index], sightings, sum);
}

void DirectLight::look(const LightSource& source, const Receiver& receiver, const Outlook& outlook,
                       Sightings& sightings, Gathered& sum) const {
    const ReceiverPlace place(patches, receiver);
    SourceSamples samples(visibility, source, place, receiver.side, hash(seed, ~receiver.seed));
    samples.guideBy(outlook.seen);
    samples.noteSightings(&sightings);
    samples.take(Sightings::kMost);
    sum.rays += samples.rays();
}

}  // namespace raybundle
