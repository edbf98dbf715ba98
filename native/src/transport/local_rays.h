// SPDX-License-Identifier: GPL-3.0-or-later
//
// Local rays that carry light. Rays leave the sources that the first shot left over, chosen by
// power, and continue from the sides that they hit. Random walks and the single-ray operator of
// stochastic iteration share this code.
//
// (visibility/local_lines.h has the lines of first shots, whose numbers are allotted to emitters.)
//
// Sources: thesis sections 2.4.2 (fig. 2.11: rays from a surface) and 2.6 (single-ray operator).
// Differs:
// - Each ray chooses its source independently by power, instead of a quota of rays per source. The
//   closed-form variances of random walks hold for this choice.
// - The world is a source too. Its light comes from all around the scene's sphere.
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

// The origin of the light of a ray.
enum class RayLight : uint8_t {
    WORLD,     // comes from the world, not reflected
    EMITTED,   // comes from emission, not reflected
    REFLECTED  // was reflected at least once
};

// A record of some rays.
struct RayLog {
    // An estimate of the power that reaches a side, W, from one sample that stands for all. The
    // mean over all samples, with 0 for samples without a score, is the estimate of the transport.
    struct Score {
        uint32_t side;
        RayLight light;
        glm::vec3 power;
    };
    std::vector<Score> scores;
    std::vector<uint32_t> rays;  // one entry per ray: the side that it left
    // One entry per ray that left the scene: the side that it left.
    std::vector<uint32_t> escapes;
};

// A ray from a source. Its power, W, is that of all sources, in the colour of its own source.
struct SourceRay {
    std::optional<uint32_t> hit;  // the side that the ray hits; empty if it leaves the scene
    RayLight light;
    glm::vec3 power;
};

// Casts rays from sources and sides.
class LocalRays {
  public:
    // All objects that `input` refers to must outlive the object. input.exposed must have an entry
    // for each side.
    explicit LocalRays(const TransportInput& input);

    // Returns the power of all sources, summed over the channels, W.
    double power() const { return cumulative.empty() ? 0 : cumulative.back(); }

    // Shoots a ray from a random source. power() must not be 0.
    SourceRay fromSources(std::mt19937_64& random, RayLog& log) const;

    // Returns the side that a ray from a random point of a side meets first, or nothing if it
    // leaves the scene. The direction is distributed by the cosine. Adds the ray to `log`.
    std::optional<uint32_t> fromSide(uint32_t side, std::mt19937_64& random, RayLog& log) const;

    // Returns the area of the exposed part of a side, m^2.
    float area(uint32_t side) const { return float(surfaces.exposedArea(side)); }

    // Returns the reflectance of a side in the channel where it is largest.
    static float reflectance(const Patches& patches, uint32_t side) {
        return brightest(patches.reflectance[side]);
    }

  private:
    struct Source {
        uint32_t side;  // meaningless for the world
        RayLight light;
        glm::vec3 colour;  // sum of the channels is 1
    };
    void addSource(uint32_t side, RayLight light, const glm::vec3& power);
    // Returns whether another surface touches a side at a point.
    bool isCovered(uint32_t side, const glm::vec3& point) const;
    std::optional<uint32_t> fromWorld(std::mt19937_64& random) const;

    const LitSurfaces surfaces;
    const Visibility& visibility;
    std::vector<Source> sources;
    // Per source: power of all sources up to and including it, W.
    std::vector<double> cumulative;
};

}  // namespace raybundle
