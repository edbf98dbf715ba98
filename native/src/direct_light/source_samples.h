// SPDX-License-Identifier: GPL-3.0-or-later
//
// Samples of one source at one receiver, each with a shadow ray. They are kept as sums over blocks
// of consecutive samples, whose differences tell how far their mean is off.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "direct_light/outlook.h"
#include "lights/incoming.h"
#include "lights/light_source.h"
#include "lights/receiver_place.h"
#include "sampling/sobol.h"
#include "visibility/visibility.h"

namespace raybundle {

constexpr size_t kSampleBlocks = 4;

// Sums over some samples.
struct SampleSums {
    glm::vec3 open{0.0f};     // irradiance as if nothing blocked them, W/m^2
    glm::vec3 visible{0.0f};  // irradiance by those that nothing blocks, W/m^2
    glm::vec4 angles{0.0f};   // of these: the brightest channel times angleTerms
    int count = 0;

    void add(const SampleSums& other);
    // Mean irradiance: the closed form times the visible share, or without a closed form the plain
    // mean.
    glm::vec3 estimate(const std::optional<glm::vec3>& closed) const;
};
using SampleBlocks = std::array<SampleSums, kSampleBlocks>;

// Where the light of a source comes from.
class Origins {
  public:
    // random: differs from receiver to receiver.
    explicit Origins(uint32_t random) : random(random) {}

    void add(const glm::vec3& direction, float more);

    Incoming incoming;

  private:
    uint32_t random;
    float brightness = 0;
};

class SourceSamples {
  public:
    // side: the patch side that the receiver lies on. seed: of the samples, which are those of a
    // Sobol sequence. References must outlive the object.
    SourceSamples(const Visibility& visibility, const LightSource& source,
                  const ReceiverPlace& place, uint32_t side, uint32_t seed)
        : visibility(visibility),
          source(source),
          place(place),
          side(side),
          points(seed),
          choosesPlaces(source.choosesPlaces()) {}

    // From now on in proportion to what is seen of each part of the source (Outlook::seen).
    void guideBy(const std::vector<float>& seen) {
        isGuided = true;
        sumOfSeen = source.sumOfSeen(place.normal, seen);
    }
    // Where samples go and where light comes from is to be noted there.
    void noteSightings(Sightings* to) { sightings = to; }
    void noteOrigins(Origins* to) { origins = to; }

    // Takes the first `count` samples, or doubles those there are until there are so many: powers
    // of two. Each block has consecutive ones, from a multiple of their number on, so that it is
    // stratified like all of them: of others the blocks would differ by more than their mean is
    // off.
    void take(int count);

    const SampleBlocks& blocks() const { return sums; }
    SampleSums all() const;
    // Means of angleTerms over all samples, less what few samples of which some are much brighter
    // are off in the mean (Quenouille, "Notes on Bias in Estimation", 1956).
    glm::vec4 meanAngles() const;
    // Shadow rays so far.
    uint64_t rays() const { return rayCount; }

  private:
    // Samples that wait for their shadow rays, which are traced together.
    struct Waiting {
        std::array<ShadowRay, Visibility::kPacket> rays;
        struct Sample {
            glm::vec3 irradiance;
            SampleSums* block;
            uint32_t part;
        };
        std::array<Sample, Visibility::kPacket> samples;
        int count = 0;
    };
    void takeSample(int index, SampleSums& block, Waiting& waiting);
    void trace(Waiting& waiting);
    void see(SampleSums& block, const glm::vec3& irradiance, const glm::vec3& direction);
    void joinBlocks();

    const Visibility& visibility;
    const LightSource& source;
    const ReceiverPlace& place;
    const uint32_t side;
    const SobolPoints points;
    const bool choosesPlaces;
    bool isGuided = false;
    std::vector<float> sumOfSeen;  // if guided: see LightSource::sumOfSeen
    Sightings* sightings = nullptr;
    Origins* origins = nullptr;
    SampleBlocks sums;
    uint64_t rayCount = 0;
};

}  // namespace raybundle
