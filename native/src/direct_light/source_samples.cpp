// SPDX-License-Identifier: GPL-3.0-or-later
#include "direct_light/source_samples.h"

#include <algorithm>

#include "scene/angles.h"
#include "scene/channels.h"

namespace raybundle {

void SampleSums::add(const SampleSums& other) {
    open += other.open;
    visible += other.visible;
    angles += other.angles;
    count += other.count;
}

glm::vec3 SampleSums::estimate(const std::optional<glm::vec3>& closed) const {
    if (count == 0) return glm::vec3(0.0f);
    if (!closed) return visible / float(count);
    glm::vec3 mean = *closed;
    for (int c = 0; c < 3; ++c)
        if (open[c] > 0) mean[c] *= visible[c] / open[c];
    return mean;
}

void Origins::add(const glm::vec3& direction, float more) {
    brightness += more;
    random = hash(random, 0);
    if (more > 0) incoming.add(direction, more / brightness, random);
}

SampleSums SourceSamples::all() const {
    SampleSums all;
    for (const SampleSums& block : sums) all.add(block);
    return all;
}

glm::vec4 SourceSamples::meanAngles() const {
    const SampleSums all = this->all();
    const glm::vec4 mean = all.angles / brightest(all.visible);
    glm::vec4 sum(0.0f);
    for (const SampleSums& block : sums) {
        const float rest = brightest(all.visible - block.visible);
        if (!(rest > 0)) return mean;
        sum += (all.angles - block.angles) / rest;
    }
    const float n = float(sums.size());
    return glm::clamp(n * mean - (n - 1) / n * sum, 0.0f, 1.0f);
}

void SourceSamples::take(int count) {
    Waiting waiting;
    for (int taken = int(kSampleBlocks) * sums[0].count; taken < count;) {
        int each = count / int(kSampleBlocks);
        if (taken > 0) {
            each = taken / 2;
            joinBlocks();
        }
        for (; taken < int(kSampleBlocks) * each; ++taken)
            takeSample(taken, sums[size_t(taken / each)], waiting);
        if (waiting.count > 0) trace(waiting);
    }
}

// Joins the four blocks into two, and empties the other two.
void SourceSamples::joinBlocks() {
    for (size_t k = 0; k < kSampleBlocks / 2; ++k) {
        const SampleSums second = sums[2 * k + 1];
        sums[k] = sums[2 * k];
        sums[k].add(second);
    }
    std::fill(sums.begin() + kSampleBlocks / 2, sums.end(), SampleSums());
}

void SourceSamples::takeSample(int index, SampleSums& block, Waiting& waiting) {
    const glm::vec4 u = points[uint32_t(index)];
    const auto [point, weight] =
        choosesPlaces ? source.placeOn(place, {u.x, u.y}) : PatchPoint{place.at({u.x, u.y})};
    const glm::vec2 uv(u.z, u.w);
    LightSample sample = isGuided ? source.sampleSeen(place.normal, uv, sumOfSeen)
                                  : source.sample(point, place.normal, uv);
    sample.irradiance *= weight;
    ++block.count;
    if (brightest(sample.irradiance) <= 0) return;
    block.open += sample.irradiance;
    if (!source.castsShadows) {
        see(block, sample.irradiance, sample.direction);
        return;
    }
    waiting.samples[size_t(waiting.count)] = {sample.irradiance, &block, sample.part};
    waiting.rays[size_t(waiting.count++)] = sample.ray(point);
    if (waiting.count == Visibility::kPacket) trace(waiting);
}

void SourceSamples::trace(Waiting& waiting) {
    std::array<float, Visibility::kPacket> shares;
    visibility.visibleShares(side, waiting.rays.data(), waiting.count, shares.data());
    for (size_t k = 0; k < size_t(waiting.count); ++k) {
        const Waiting::Sample& sample = waiting.samples[k];
        see(*sample.block, shares[k] * sample.irradiance, waiting.rays[k].direction);
        if (sightings) sightings->add(sample.part, shares[k] > 0);
    }
    rayCount += uint64_t(waiting.count);
    waiting.count = 0;
}

void SourceSamples::see(SampleSums& block, const glm::vec3& irradiance,
                        const glm::vec3& direction) {
    block.visible += irradiance;
    const float brightness = brightest(irradiance);
    block.angles += brightness * angleTerms(glm::dot(direction, place.normal));
    if (origins) origins->add(direction, brightness);
}

}  // namespace raybundle
