// SPDX-License-Identifier: GPL-3.0-or-later
//
// Receivers of direct light (direct_light/direct_light.h), the results of a gather, and the aims
// that control how many samples a receiver takes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "lights/incoming.h"
#include "patches/patches.h"
#include "scene/angles.h"
#include "scene/channels.h"

namespace raybundle {

// A place where direct light is gathered: a whole patch side, for which the result is the mean over
// the patch, or a point on a side.
struct Receiver {
    // Index of the patch side.
    uint32_t side = 0;
    glm::vec3 normal{0.0f};          // unit; a point may have a shading normal
    std::optional<glm::vec3> point;  // metres, relative to Patches::centre
    uint32_t seed = 0;               // of the random samples
    // Whether to gather only the light that passes surfaces: that of sources without shadows, and,
    // on surfaces that do not stop direct light, that of all sources. Lines that end at the first
    // surface cannot bring this light.
    bool passingOnly = false;
    // The sources whose light is gathered: all, those that surround the receiver, or the others.
    enum class Of { ALL, SURROUNDING, OTHERS } of = Of::ALL;
    float errorFactor = 1;   // factor on the error that the receiver may have
    float targetFactor = 1;  // factor on the target error: that of the object
    bool isShown = true;     // false: the result shows only light that this receiver reflects
    // Irradiance that the receiver gets besides the light of the sources, brightest channel, W/m^2.
    float otherLight = 0;
};

struct Outlook;

// Two adjacent receivers, given by their indices.
struct ReceiverPair {
    uint32_t first = 0, second = 0;
};

// The light that one receiver gets from one source.
struct LightPart {
    glm::vec3 irradiance{0.0f};  // W/m^2
    float variance = 0;          // of the brightest channel, (W/m^2)^2
    float contrast = 0;          // standard deviation over the receiver caused by shadows, W/m^2
    glm::vec4 angles{0.0f};      // brightest channel times the means of angleTerms, W/m^2
    Incoming incoming;           // directions of the light; set where surfaces scatter by direction

    // Returns this light for a source that is `factor` times as strong in each channel. The samples
    // have the colour of the light, so the variance and the angles scale with the brightest
    // channel.
    LightPart scaled(const glm::vec3& factor) const {
        const glm::vec3 light = factor * irradiance;
        const float most = brightest(irradiance) > 0 ? brightest(light) / brightest(irradiance)
                                                     : brightest(factor);
        return {light, most * most * variance, most * contrast, most * angles, incoming};
    }
};

// The light that one receiver gets from all sources.
struct Gathered {
    glm::vec3 irradiance{0.0f};  // W/m^2
    // Part of `irradiance` that is not a share of a source's power(): see isUnpowered in add().
    glm::vec3 unpowered{0.0f};
    float variance = 0;        // of the brightest channel, (W/m^2)^2
    float contrast = 0;        // sum over the sources, W/m^2
    float shadowContrast = 0;  // sum over the sources that do not surround the receiver, W/m^2
    glm::vec4 angles{0.0f};    // sum over the sources, W/m^2
    float brightness = 0;      // sum of the brightest channels over the sources, W/m^2
    float lampLight = 0;  // part of `brightness` from sources that do not surround the receiver
    float unblockedLight = 0;  // value of `lampLight` without occluders, W/m^2
    Incoming incoming;         // directions of the light of all sources, weighted by brightness
    uint32_t noisiest = 0;     // source with the largest variance
    float mostVariance = 0;    // variance of this source
    uint64_t rays = 0;
    uint64_t unblocked = 0;  // number of sources without noise that are wholly visible
    uint64_t hidden = 0;     // number of sources that the receiver cannot face; no samples taken
    uint64_t weak = 0;    // number of sources with fewer rays because they give little of the light
    uint64_t inside = 0;  // number of sources with fewer rays because the side is inside a solid

    // Adds the light of one source. `source` is its index. `isUnpowered` is true if the light is
    // not a share of the source's power(): the source has none, or surfaces do not stop its light.
    // For `random` see Incoming::add.
    void add(uint32_t source, const LightPart& part, bool isUnpowered, uint32_t random) {
        if (part.variance > mostVariance) {
            mostVariance = part.variance;
            noisiest = source;
        }
        irradiance += part.irradiance;
        if (isUnpowered) unpowered += part.irradiance;
        variance += part.variance;
        contrast += part.contrast;
        angles += part.angles;
        const float more = brightest(part.irradiance);
        const float sampled = more * part.incoming.weight;
        const float all = brightness * incoming.weight + sampled;
        brightness += more;
        if (!(all > 0)) return;
        incoming.add(part.incoming, sampled / all, random);
        incoming.weight = all / brightness;
    }
    // Returns the fraction, 0 to 1, of the unoccluded light that arrives from sources that do not
    // surround the receiver. Returns 1 if there is no such light.
    float visibleShare() const { return unblockedLight > 0 ? lampLight / unblockedLight : 1.0f; }
    // Returns the means of angleTerms over the received light.
    glm::vec4 meanAngles() const { return brightness > 0 ? angles / brightness : kEverywhere; }
};

// Standard error that direct light may have, as a share of the target error. Errors of receivers
// are independent, while an error of the bundles is shared by many receivers.
constexpr float kDirectShare = 0.75f;

// The accuracy that the samples of one receiver must reach.
struct Aim {
    float tolerance = INFINITY;  // largest standard error, W/m^2
    int samples = 0;             // minimum number of samples of each source
    // Largest factor by which the number of samples may exceed that which a source otherwise takes.
    int mostGrowth = 1;
    // Positive if the samples may have missed the edge of a shadow that a neighbour sees: the
    // smallest amount by which the contrast of a neighbour exceeds that of this receiver, W/m^2.
    // Infinite if all these neighbours see far more or far less of the light. Otherwise 0.
    float besideShadow = 0;
    // Visibility of the source that surrounds the receiver, or null if it is not known. Not owned.
    const Outlook* outlook = nullptr;
    // Whether samples that agree may have missed a part that nothing else reveals. The receiver has
    // no neighbours, or takes few samples, because the source gives little of the light that the
    // receiver could get. If the other sources are hidden, it may give most of the light.
    bool mayMiss = false;
};

// The receivers that need more samples after a coarse shot, and the aim of each of them.
//
// Differs from an equal error for all receivers:
// - Where few receivers have noise (at the edges of shadows), each of them may have a larger error,
//   as long as their total error is small relative to the mean light.
// - Samples that agree prove little if a neighbour disagrees, so receivers with such neighbours
//   take more samples.
struct Aims {
    // Indices of the receivers, and the aims in the same order.
    std::vector<uint32_t> receivers;
    std::vector<Aim> aims;

    // Removes all receivers for which isKept(receiver, aim) returns false.
    template <class IsKept>
    void keep(const IsKept& isKept) {
        size_t count = 0;
        for (size_t k = 0; k < receivers.size(); ++k) {
            if (!isKept(receivers[k], aims[k])) continue;
            receivers[count] = receivers[k];
            aims[count++] = aims[k];
        }
        receivers.resize(count);
        aims.resize(count);
    }
};

// Returns for each of `count` receivers whether it is in any pair of `neighbours`.
std::vector<bool> haveNeighbours(size_t count, const std::vector<ReceiverPair>& neighbours);

// Returns the receivers that need more samples. `results` is the outcome of the coarse shot per
// receiver, `receiverAt` returns the receiver of an index, and `neighbours` are all adjacent pairs.
// `targetError` is relative.
Aims aimsAfter(const std::vector<Gathered>& results, const Patches& patches,
               const std::function<Receiver(size_t)>& receiverAt,
               const std::vector<ReceiverPair>& neighbours, float targetError);

// First number of shadow rays per receiver and source: for receivers that can compare themselves
// with their neighbours, and for all other receivers.
constexpr int kNeighbourSamples = 8, kFirstSamples = 16;

}  // namespace raybundle
