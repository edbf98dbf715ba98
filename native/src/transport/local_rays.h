// SPDX-License-Identifier: GPL-3.0-or-later
//
// Local rays that carry light: from the sources that the first shot left, chosen by power, and on
// from the sides that they hit. What random walks and the single-ray operator have in common.
//
// (Lines whose numbers are allotted to emitters, for first shots: visibility/local_lines.h.)
//
// Sources: thesis sections 2.4.2 (fig. 2.11: rays from a surface) and 2.6 (single-ray operator).
// Differs:
// - Rays choose their source independently by power and not by a quota per source: the closed
//   variances of random walks hold for that.
// - The world is a source too: it shines in from all around the scene's sphere.
// - A ray leaves from the part of a patch that no other surface covers.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <random>
#include <vector>

#include "scene/channels.h"
#include "transport/transport.h"

namespace raybundle {

// What the light of a ray has gone through.
enum class RayLight : uint8_t {
    WORLD,     // nothing: it came from the world
    EMITTED,   // nothing: it came from emission
    REFLECTED  // at least one reflection
};

// What some rays did; scores are powers that reached a side, W, each for all samples at once.
struct RayLog {
    struct Score {
        uint32_t side;
        RayLight light;
        glm::vec3 power;
    };
    std::vector<Score> scores;
    std::vector<uint32_t> rays;     // sides that a ray left, once per ray
    std::vector<uint32_t> escapes;  // those of them whose ray left the scene
};

// A ray from a source with the power of all sources, in the colour of its own; W.
struct SourceRay {
    std::optional<uint32_t> hit;  // side
    RayLight light;
    glm::vec3 power;
};

class LocalRays {
  public:
    // What `input` refers to must outlive it.
    explicit LocalRays(const TransportInput& input);

    // Power of all sources, summed over the channels, W.
    double power() const { return cumulative.empty() ? 0 : cumulative.back(); }

    // Shoots a ray from a source; power() must not be zero.
    SourceRay fromSources(std::mt19937_64& random, RayLog& log) const;

    // The side that a ray from a random point of a side meets first, if any.
    std::optional<uint32_t> fromSide(uint32_t side, std::mt19937_64& random, RayLog& log) const;

    // The area of a side that gets light, m^2.
    float area(uint32_t side) const { return float(surfaces.exposedArea(side)); }

    // Largest reflectance of a side.
    static float reflectance(const Patches& patches, uint32_t side) {
        return brightest(patches.reflectance[side]);
    }

  private:
    struct Source {
        uint32_t side;  // none for the world
        RayLight light;
        glm::vec3 colour;  // its channels sum to 1
    };
    void addSource(uint32_t side, RayLight light, const glm::vec3& power);
    bool isCovered(uint32_t side, const glm::vec3& point) const;
    std::optional<uint32_t> fromWorld(std::mt19937_64& random) const;

    const LitSurfaces surfaces;
    const Patches& patches;
    const Visibility& visibility;
    std::vector<Source> sources;
    std::vector<double> cumulative;  // per source: power up to it, W
};

}  // namespace raybundle
