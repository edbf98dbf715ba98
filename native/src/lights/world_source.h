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
// - The product is exact for regions above the horizon. Those that it cuts take the cosine's mean
//   over a flat piece in the mean direction of their light, and are looked into no further than the
//   irradiance needs to be right to 1e-4.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <array>
#include <cstdint>
#include <vector>

#include "lights/light_source.h"
#include "scene/scene.h"

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
    // Pixels [x0, x1) x [y0, y1): what samples look at on their way, one cache line.
    struct Region {
        glm::vec3 axis{0.0f};    // its middle
        float reach = 0;         // sine of the angle from the axis to the farthest direction
        glm::vec3 moment{0.0f};  // integral of the radiance's channels' sum times direction
        float strength = 0;      // integral of the radiance's channels' sum, W/m^2
        std::array<glm::vec3, 2> half{glm::vec3(0.0f), glm::vec3(0.0f)};  // edges from the middle
        uint32_t second = 0;       // child; the first child is the next region. 0: no children
        int16_t part = -1;         // that it is, if it is one
        bool cutsColumns = false;  // the children lie side by side, else one above the other
    };
    // The same, of all its directions: what is asked for at the end.
    struct RegionLight {
        uint32_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;
        float solidAngle = 0;                // sr
        glm::vec3 flux{0.0f};                // integral of the radiance, W/m^2
        std::array<glm::vec3, 3> moments{};  // Region::moment by channel
    };
    struct Extremes {
        float least, most;  // sum of the channels of the radiance
    };
    struct Choice {
        uint32_t region;  // without children; kNone: no light comes from any
        glm::vec2 uv;
        float probability;
        int32_t part;
    };
    static constexpr uint32_t kNone = UINT32_MAX;

    // The light as a plane sees it: neighbouring receivers have it in common.
    struct Facing {
        glm::vec3 normal{0.0f}, irradiance{0.0f};
        // Per region: the irradiance from it, all channels together, if it is one of those that
        // were looked at. -1 of all others.
        std::vector<float> weight;
        std::vector<uint32_t> looked;
    };

    Extremes build(uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1);
    void findParts(uint32_t region);
    void findPartNeighbours();
    void measure(Region& region, RegionLight& light) const;
    void setPixel(Region& region, RegionLight& light) const;
    // Walks from a region to one without children; weightOf(region) tells how to share them out.
    template <class WeightOf>
    Choice choose(uint32_t from, glm::vec2 uv, float probability, const WeightOf& weightOf) const;
    Choice chooseFacing(uint32_t from, glm::vec2 uv, float probability,
                        const glm::vec3& normal) const;
    LightSample sampleOf(const Choice& choice, const glm::vec3& normal) const;
    glm::vec3 directionIn(const RegionLight& region, glm::vec2 uv) const;
    static bool isFlat(const Region& region);
    // Of the cosine by which a plane sees the light of a region that its horizon cuts.
    static float meanCosine(const Region& region, const glm::vec3& normal);
    glm::vec3 look(uint32_t index, Facing& facing) const;
    const Facing& facingOf(const glm::vec3& normal) const;
    // The irradiance from a region, all channels together, or nearly.
    float weightOf(uint32_t region, const Facing& facing) const;
    static float weightOf(const Region& region, const glm::vec3& normal);
    bool isSeen(uint32_t region, const glm::vec3& normal) const;

    const WorldImage image;
    std::vector<double> height;        // z of the lower edge of each row, and of the top
    std::vector<double> heightAngle;   // integral of the cosine of the elevation below it, squared
    std::vector<double> cosine, sine;  // of the azimuth of the left edge of each column, and last
    float leastVariation = 0;          // of a region with children, W/m^2
    float leastCut = 0;  // of a flat region whose children matter at the horizon, W/m^2
    std::vector<Region> regions;
    std::vector<RegionLight> lights;    // of each
    std::vector<uint32_t> partRegions;  // that together are all of the source
    PartNeighbours partNeighbours;

    mutable tbb::enumerable_thread_specific<Facing> facing;  // of the last receiver
};

}  // namespace raybundle
