// SPDX-License-Identifier: GPL-3.0-or-later
//
// What one receiver gets from the sources: samples of each, until their error is small enough.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "direct_light/closed_mean.h"
#include "direct_light/direct_light.h"
#include "direct_light/outlook.h"
#include "direct_light/source_samples.h"
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
// stated one in the edge of a plate's shadow, steps of samples included (shadows_test.cpp).
constexpr float kMissedEdge = 0.2f, kAsNeighbour = 0.5f;
// Where part of the samples is blocked: stratified samples of a straight edge are alike in all
// blocks, though they tell its place no better than to this share of one of them.
constexpr float kStepOfSamples = 0.6f;
// A receiver that is in the dark after so many samples of a source that surrounds it stays there.
// One whose neighbours are too, after fewer.
constexpr int kDarkSamples = 256, kDarkSamplesOfDark = 64;

// Share of a source that n samples may have missed of which all are blocked, or none, where a
// neighbour has so much contrast, as a share of the source: as much as that neighbour sees of it,
// or does not see, with the probability that all miss it.
float missedBeside(float contrast, float n) {
    const float half = std::min(contrast, 0.5f);
    const float step = 0.5f * (1 - std::sqrt(1 - 4 * half * half));
    return std::max(kMissedEdge / n, kAsNeighbour * step * std::exp(-0.5f * n * step));
}

// What a block's angleTerms add to the means of all blocks.
glm::vec4 surplusAngles(const SampleSums& all, const SampleSums& block) {
    const float light = brightest(all.visible);
    return float(kSampleBlocks) * (block.angles - all.angles / light * brightest(block.visible)) /
           light;
}

}  // namespace

// Takes the samples of one source at one receiver until their error is small enough.
class DirectLight::SourceGather {
  public:
    SourceGather(const DirectLight& light, size_t index, const Receiver& receiver,
                 const ReceiverPlace& place, const Aim& aim)
        : light(light),
          source(*light.sources[index]),
          receiver(receiver),
          place(place),
          aim(aim),
          hasParts(!source.parts().empty()),
          outlook(hasParts ? aim.outlook : nullptr),
          isGuided(outlook && !outlook->seen.empty()),
          isInside(light.skips.skipInside && !source.staysInside() && receiver.side % 2 == 1 &&
                   light.patches.parents[light.patches.parentOf[receiver.side / 2]].isSolid),
          mostSamples(aim.mostGrowth * source.mostSamples()),
          seed(hash(light.seed, hash(receiver.seed, uint32_t(index)))),
          samples(light.visibility, source, place, receiver.side, seed),
          origins(seed) {
        if (isGuided) samples.guideBy(outlook->seen);
        if (!light.patches.scattering.empty() && !receiver.point) samples.noteOrigins(&origins);
    }

    // seen: whether any receiver got light of the source. sightings: to be filled; or null.
    // Counts what it does in `sum`.
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
        // Inside a solid it is dark, unless a source is in there too: look before taking all
        // samples.
        int next = isInside ? std::min(kFewSamples, aim.samples) : aim.samples;
        for (;;) {
            take(next);
            // No sample faced the receiver: few of them may, beside a source of many faces.
            if (brightest(all.open) <= 0 && all.count < mostSamples &&
                (source.isNarrow || (closed && brightest(*closed) > 0))) {
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
            // By the first pass alone, so that the order of the receivers does not matter.
            if (std::isinf(aim.tolerance)) seen = true;
            const float wanted = measureVariance(missed);
            if (all.count >= aim.samples &&
                (wanted <= aim.tolerance * aim.tolerance || all.count >= mostSamples))
                return litPart(sum);
            next = all.count < aim.samples ? aim.samples
                                           : (isGuided || source.surrounds() ? 2 : 4) * all.count;
        }
    }

    // Until there are so many.
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

    // By all samples so far.
    bool isLit() const { return all.visible == all.open; }
    bool isDark() const { return brightest(all.visible) <= 0; }
    // Irradiance as if nothing blocked it, W/m^2.
    float open() const { return brightest(all.open) / float(all.count); }

    // The share of the source that all samples may have missed.
    float missedShare() const {
        const float n = float(all.count);
        if (isInside) return 0;
        if (source.surrounds()) return kMissed / n;
        return aim.besideShadow > 0 && (isLit() || isDark())
                   ? missedBeside(aim.besideShadow / open(), n)
                   : 0;
    }

    // Among receivers that look alike a part that one alone sees is missed there alone, and one
    // that all see is missed by all their samples: in the mean of squares over so many, what is
    // missed is less by their number at least.
    float varianceOfMissed(float missed) const {
        return missed * missed / (outlook ? float(outlook->receivers) : 1.0f);
    }

    // Finds the variance; returns the one that samples are to take below the aim.
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
    const Outlook* const outlook;  // on the source; null: not known
    const bool isGuided;           // by what is seen of its parts
    const bool isInside;           // of a solid
    const int mostSamples;
    const uint32_t seed;
    SourceSamples samples;
    Origins origins;
    SampleSums all;                   // so far
    std::optional<glm::vec3> closed;  // the closed form, W/m^2
    float closedError = 0, variance = 0;
};

// About what each source would give without occluders, to share out the samples: by one sample, or
// another where that gets nothing. Empty where there are so few sources that it does not pay.
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

AngleFactors DirectLight::shownByAngle(uint32_t side, const glm::vec4& angles) const {
    AngleFactors factors{};
    if (!showsByAngle) return factors;
    constexpr float kLeastShown = 0.05f;  // less shows too little of the light to be clean
    const Parent& parent = patches.parentAt(side);
    const MaterialSide& surface =
        scene.materialOf(parent.instance, size_t(parent.face)).sides[side % 2];
    const glm::vec3 all = glm::max(surface.shown(angles), kLeastShown);
    for (size_t term = 0; term < factors.size(); ++term)
        factors[term] = surface.shownByAngle[term] / all;
    return factors;
}

// Each source takes samples until its standard error is below its share of the tolerance.
Gathered DirectLight::gather(const Receiver& receiver, const Aim& aim, Seen& seen, LightPart* parts,
                             Sightings* sightings) const {
    Gathered sum;
    const ReceiverPlace place(patches, receiver);
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

LightPart DirectLight::gatherFrom(size_t index, const Receiver& receiver,
                                  const ReceiverPlace& place, const Aim& aim, Seen& seen,
                                  Sightings* sightings, Gathered& sum) const {
    if (isOutOfSight(*sources[index], place)) {
        ++sum.hidden;
        return {};
    }
    return SourceGather(*this, index, receiver, place, aim).run(seen[index], sightings, sum);
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
