// SPDX-License-Identifier: GPL-3.0-or-later
//
// The image of a world as a source of light: a tree of its regions, from which receivers take
// samples in proportion to radiance times cosine, and the irradiance without occluders.
//
// Sources: Clarberg, Jarosz, Akenine-Moller and Jensen, "Wavelet Importance Sampling" (2005) for
// warping points level by level by the product of light and cosine; Arvo, "Applications of
// Irradiance Tensors to the Simulation of Non-Lambertian Phenomena" (1995): above the horizon,
// irradiance is the product of the light's first moment with the normal.
// Differs:
// - No wavelets: a binary tree of equirectangular regions with the exact first moments of their
//   light. Its branches end where the radiance hardly varies, so that smooth skies are cheap and a
//   sun of a few pixels is found by every sample that should.
// - The product is exact for regions above the horizon. It is summed from the smallest of those
//   that the horizon cuts, which take the cosine's mean over a flat piece.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <array>
#include <cstdint>
#include <vector>

#include "scene/scene.h"
#include "transport/light_source.h"

namespace raybundle {

class WorldSource : public LightSource {
  public:
    // The image must not be black.
    explicit WorldSource(const WorldImage& given);

    LightSample sample(const glm::vec3& point, const glm::vec3& normal,
                       glm::vec2 uv) const override;
    std::optional<glm::vec3> irradiance(const glm::vec3& point,
                                        const glm::vec3& normal) const override;
    const PartNeighbours& parts() const override { return partNeighbours; }
    std::vector<float> sumOfSeen(const glm::vec3& normal,
                                 const std::vector<float>& seen) const override;
    LightSample sampleSeen(const glm::vec3& normal, glm::vec2 uv,
                           const std::vector<float>& sumOfSeen) const override;
    bool isOutOfSight(const ReceiverPlace& place) const override;
    float distance(const glm::vec3& point) const override;
    int mostSamples() const override { return 1024; }
    bool surrounds() const override { return true; }
    glm::vec3 power() const override { return glm::vec3(0.0f); }
    glm::vec3 shootingPower(float sceneRadius) const override;
    EmittedRay emit(const glm::vec4& u, float sceneRadius) const override;

    // Of the tree.
    size_t regionCount() const { return regions.size(); }

  private:
    // Pixels [x0, x1) x [y0, y1), and the light of all directions in them.
    struct Region {
        uint32_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;
        uint32_t second = 0;       // child; the first child is the next region. 0: no children
        bool cutsColumns = false;  // the children lie side by side, else one above the other
        int32_t part = -1;         // that it is, if it is one
        float solidAngle = 0;      // sr
        float reach = 0;           // sine of the angle from the axis to the farthest direction
        glm::vec3 axis{0.0f};      // its middle
        std::array<glm::vec3, 2> half{glm::vec3(0.0f), glm::vec3(0.0f)};  // edges from the middle
        glm::vec3 flux{0.0f};    // integral of the radiance, W/m^2
        float strength = 0;      // sum of the channels of flux
        glm::vec3 moment{0.0f};  // integral of the radiance's channels' sum times direction
        std::array<glm::vec3, 3> moments{};  // the same by channel
    };
    struct Extremes {
        float least, most;  // sum of the channels of the radiance
    };
    struct Choice {
        const Region* region;
        glm::vec2 uv;
        float probability;
        int32_t part;
    };

    // The light as a plane sees it: neighbouring receivers have it in common.
    struct Facing {
        glm::vec3 normal{0.0f}, irradiance{0.0f};
        // Per region that the horizon cuts, and its children: the irradiance from it, all channels
        // together. -1 of all others.
        std::vector<float> weight;
    };

    Extremes build(uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1);
    void findParts(uint32_t region);
    void findPartNeighbours();
    void measure(Region& region) const;
    void setPixel(Region& region) const;
    // Walks from a region to one without children; weights(region, wa, wb) tells those of its own.
    template <class Weights>
    Choice choose(const Region& from, glm::vec2 uv, float probability, Weights weights) const;
    Choice chooseFacing(const Region& from, glm::vec2 uv, float probability,
                        const glm::vec3& normal) const;
    static LightSample sampleOf(const Choice& choice, const glm::vec3& normal,
                                const glm::vec3& direction);
    glm::vec3 directionIn(const Region& region, glm::vec2 uv) const;
    glm::vec3 look(uint32_t index, const glm::vec3& normal, std::vector<float>& weights) const;
    const Facing& facingOf(const glm::vec3& normal) const;
    // The irradiance from a region, all channels together, or nearly.
    float weightOf(uint32_t region, const Facing& facing) const;
    bool isSeen(uint32_t region, const glm::vec3& normal) const;
    uint32_t firstChild(const Region& region) const { return uint32_t(&region - &regions[0]) + 1; }

    const WorldImage image;
    std::vector<double> height;        // z of the lower edge of each row, and of the top
    std::vector<double> heightAngle;   // integral of the cosine of the elevation below it, squared
    std::vector<double> cosine, sine;  // of the azimuth of the left edge of each column, and last
    float leastVariation = 0;          // of a region with children, W/m^2
    std::vector<Region> regions;
    std::vector<uint32_t> partRegions;  // that together are all of the source
    PartNeighbours partNeighbours;

    mutable tbb::enumerable_thread_specific<Facing> facing;  // of the last receiver
};

}  // namespace raybundle
