// SPDX-License-Identifier: GPL-3.0-or-later
//
// Samples of one source at one receiver, each with a shadow ray. The samples are summed in blocks
// of consecutive samples. The differences between the blocks estimate the error of the mean.
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

// Sums over samples.
struct SampleSums {
    glm::vec3 open{0.0f};     // irradiance if nothing blocked the samples, W/m^2
    glm::vec3 visible{0.0f};  // irradiance by the unblocked share, W/m^2
    glm::vec4 angles{0.0f};   // unblocked light: brightest channel times angleTerms
    int count = 0;

    void add(const SampleSums& other);
    // Returns the mean irradiance: the closed form times the visible share, or the plain mean if
    // there is no closed form.
    glm::vec3 estimate(const std::optional<glm::vec3>& closed) const;
};
using SampleBlocks = std::array<SampleSums, kSampleBlocks>;

// Collects the directions from which the light of a source comes.
class Origins {
  public:
    // `random` must differ from receiver to receiver.
    explicit Origins(uint32_t random) : random(random) {}

    // Adds light from a unit direction; `more` is its brightness.
    void add(const glm::vec3& direction, float more);

    Incoming incoming;

  private:
    uint32_t random;
    float brightness = 0;
};

// Takes the samples of one source at one receiver.
class SourceSamples {
  public:
    // `side` is the patch side on which the receiver lies. `seed` scrambles the Sobol sequence of
    // the samples. The references must outlive the object.
    SourceSamples(const Visibility& visibility, const LightSource& source,
                  const ReceiverPlace& place, uint32_t side, uint32_t seed)
        : visibility(visibility),
          source(source),
          place(place),
          side(side),
          points(seed),
          choosesPlaces(source.choosesPlaces()) {}

    // Takes further samples in proportion to what is visible of each part of the source
    // (Outlook::seen).
    void guideBy(const std::vector<float>& seen) {
        isGuided = true;
        sumOfSeen = source.sumOfSeen(place.normal, seen);
    }
    // Set where to record the parts that samples go to, and the directions that the light comes
    // from.
    void noteSightings(Sightings* to) { sightings = to; }
    void noteOrigins(Origins* to) { origins = to; }

    // Takes samples until there are `count`, a power of two: all at once if there are none yet,
    // else by doubling their number. Each block consists of consecutive samples and begins at a
    // multiple of its size, so that it is stratified as well as all samples together. Other blocks
    // would differ by more than the error of their mean.
    void take(int count);

    const SampleBlocks& blocks() const { return sums; }
    SampleSums all() const;
    // Returns the means of angleTerms over all samples. The ratio of two sums is biased if there
    // are few samples and some of them are much brighter than others; the bias is removed by the
    // jackknife (Quenouille, "Notes on Bias in Estimation", 1956).
    glm::vec4 meanAngles() const;
    // Returns the number of shadow rays so far.
    uint64_t rays() const { return rayCount; }

  private:
    // Samples that wait for their shadow rays, which are traced in packets.
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
    std::vector<float> sumOfSeen;  // see LightSource::sumOfSeen; empty unless guided
    Sightings* sightings = nullptr;
    Origins* origins = nullptr;
    SampleBlocks sums;
    uint64_t rayCount = 0;
};

}  // namespace raybundle
