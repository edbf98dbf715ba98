// SPDX-License-Identifier: GPL-3.0-or-later
//
// A joint source: many sources that are sampled as one. Each sample chooses a source in proportion
// to a weight. With many lamps, each of which gives a receiver little of its light, the number of
// samples thus follows the light that they give together and not their number.
//
// Source: Shirley, Wang and Zimmerman, "Monte Carlo Techniques for Direct Lighting Calculations"
// (1996), section on multiple luminaires: dim sources are sampled together, bright ones one by one.
#pragma once

#include <cstdint>
#include <vector>

#include "lights/light_source.h"

namespace raybundle {

// Sources of a receiver that are sampled together. They must cast shadows and have no parts.
class JointSource : public LightSource {
  public:
    // `sources` must outlive the object.
    explicit JointSource(const LightSources& sources) : sources(&sources) {}

    // Returns whether a source can be joined.
    static bool canJoin(const LightSource& source) {
        return source.castsShadows && source.parts().empty() && !source.surrounds() &&
               !source.staysInside() && !source.isNarrow;
    }
    // Adds the source with this index. `weight` is about the light that it may give.
    void add(uint32_t index, float weight) {
        indices.push_back(index);
        weightUpTo.push_back(all() + weight);
    }
    // Returns the indices of the joined sources, in the order in which they were added.
    const std::vector<uint32_t>& joined() const { return indices; }
    // Returns the sum of all weights.
    float all() const { return weightUpTo.empty() ? 0 : weightUpTo.back(); }
    // Returns the source with the largest weight.
    uint32_t strongest() const;

    LightSample sample(const glm::vec3& point, const glm::vec3& normal,
                       glm::vec2 uv) const override;
    std::optional<glm::vec3> irradiance(const glm::vec3&, const glm::vec3&) const override {
        return std::nullopt;
    }
    bool isOutOfSight(const ReceiverPlace&) const override { return false; }
    float distance(const glm::vec3& point) const override;
    // A few samples that agree say little about all the sources.
    bool surrounds() const override { return true; }
    glm::vec3 power() const override { return glm::vec3(0.0f); }
    EmittedRay emit(const glm::vec4&, float) const override { return {}; }

  private:
    float weightOf(size_t k) const { return weightUpTo[k] - (k > 0 ? weightUpTo[k - 1] : 0); }

    const LightSources* sources;
    std::vector<uint32_t> indices;  // of the joined sources
    std::vector<float> weightUpTo;  // sums of the weights
};

}  // namespace raybundle
