// SPDX-License-Identifier: GPL-3.0-or-later
//
// What gathers direct light (direct_light/direct_light.h), what it gets, and what it aims at.
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

// Where direct light is to be known: a whole patch side (the mean over it), or a point on one.
struct Receiver {
    uint32_t side = 0;
    glm::vec3 normal{0.0f};          // unit; a point may have a shading normal
    std::optional<glm::vec3> point;  // relative to Patches::centre
    uint32_t seed = 0;               // of its samples
    // Only the light that lines which end at the first surface do not bring it.
    bool passingOnly = false;
    float errorFactor = 1;  // its error may be so many times that of others
    bool isShown = true;    // whether its light is shown, and not only that of what it lights
    float otherLight = 0;   // what it gets beside that, of the brightest channel, W/m^2
};

struct Outlook;

// Two receivers beside each other, by their numbers.
struct ReceiverPair {
    uint32_t first = 0, second = 0;
};

// What one receiver got from one source.
struct LightPart {
    glm::vec3 irradiance{0.0f};  // W/m^2
    float variance = 0;          // of the brightest channel
    float contrast = 0;          // standard deviation over the receiver that shadows make, W/m^2
    glm::vec4 angles{0.0f};      // the brightest channel times the means of angleTerms
    Incoming incoming;           // where surfaces scatter by direction

    // From a source so many times as strong. The samples have the colour of the light.
    LightPart scaled(const glm::vec3& factor) const {
        const glm::vec3 light = factor * irradiance;
        const float most = brightest(irradiance) > 0 ? brightest(light) / brightest(irradiance)
                                                     : brightest(factor);
        return {light, most * most * variance, most * contrast, most * angles, incoming};
    }
};

// What one receiver got.
struct Gathered {
    glm::vec3 irradiance{0.0f};  // W/m^2
    glm::vec3 unpowered{0.0f};   // part of it from sources without a power of their own
    float variance = 0;          // of the brightest channel
    float contrast = 0;          // sums over the sources: of theirs
    float shadowContrast = 0;    // of theirs, of those that do not surround the receiver
    glm::vec4 angles{0.0f};      // of theirs
    float brightness = 0;        // of their brightest channels
    float lampLight = 0;         // of those of sources that do not surround the receiver
    float unblockedLight = 0;    // the same if nothing was in between
    Incoming incoming;           // of theirs, by brightness
    uint32_t noisiest = 0;       // of them: the one with the most variance
    float mostVariance = 0;      // of that one
    uint64_t rays = 0;
    uint64_t unblocked = 0;  // sources without noise: wholly visible
    uint64_t hidden = 0;     // sources that it cannot face, without a sample
    uint64_t weak = 0;       // sources that took fewer rays since they give little of the light
    uint64_t inside = 0;     // sources that took fewer rays since it is the inside of a solid

    // random: see Incoming::add.
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
    // Share of the light of sources that do not surround the receiver that nothing stops on its
    // way; 1 where there is none.
    float visibleShare() const { return unblockedLight > 0 ? lampLight / unblockedLight : 1.0f; }
    // Means of angleTerms.
    glm::vec4 meanAngles() const { return brightness > 0 ? angles / brightness : kEverywhere; }
};

// Standard error that direct light may keep, as a share of the target: errors of receivers are
// independent, while those of bundles are shared by many.
constexpr float kDirectShare = 0.75f;

// What a receiver's samples are to reach.
struct Aim {
    float tolerance = INFINITY;  // standard error, W/m^2
    int samples = 0;             // of each source, at least
    int mostGrowth = 1;          // at most, so many times the samples that a source otherwise takes
    // Where a shadow's edge may have been missed: the least contrast that a neighbour has more,
    // W/m^2; infinite if all such neighbours see far more or less of the light; 0 elsewhere.
    float besideShadow = 0;
    // On the source that surrounds the receiver, if that is known.
    const Outlook* outlook = nullptr;
};

// After a coarse shot: the receivers that need more samples, and the aims of these.
//
// Differs from an equal error for all: where few receivers have noise (the edges of shadows), each
// may have more of it, as long as all together have little beside the mean light. And samples that
// agree prove little where a neighbour disagrees: those receivers take more.
struct Aims {
    std::vector<uint32_t> receivers;
    std::vector<Aim> aims;

    // Those alone of which isKept(receiver, aim) is true.
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
Aims aimsAfter(const std::vector<Gathered>& results, const Patches& patches,
               const std::function<Receiver(size_t)>& receiverAt,
               const std::vector<ReceiverPair>& neighbours, float targetError);

// Shadow rays per receiver and source at first: of those that can tell from their neighbours
// whether they are enough, and of others.
constexpr int kNeighbourSamples = 8, kFirstSamples = 16;

}  // namespace raybundle
