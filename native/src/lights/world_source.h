// SPDX-License-Identifier: GPL-3.0-or-later
//
// The image of a world as a light source: a binary tree of the image's regions. Receivers sample it
// in proportion to radiance times cosine, and it gives the irradiance without occluders.
//
// Sources: Clarberg, Jarosz, Akenine-Moller and Jensen, "Wavelet Importance Sampling" (2005), for
// warping points level by level by the product of light and cosine; Arvo, "Applications of
// Irradiance Tensors to the Simulation of Non-Lambertian Phenomena" (1995), for the irradiance from
// regions above the horizon, which is the product of the light's first moment with the normal.
// Differs:
// - There are no wavelets. The tree consists of equirectangular regions with the exact first
//   moments of their light. Its branches end where the radiance hardly varies. Smooth skies are
//   therefore cheap, and a sun of a few pixels is found by every sample that should find it.
// - The product of light and cosine is exact only for regions above the horizon. For regions that
//   the horizon cuts, the cosine is that of a flat piece in the mean direction of the region's
//   light. Such a region is subdivided only until the irradiance is accurate to 1e-4.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "lights/light_source.h"
#include "scene/scene.h"

namespace raybundle {

// A light source that radiates the image of a world from infinity. Thread-safe after construction.
class WorldSource : public LightSource {
  public:
    // Copies the image. The image must not be black.
    explicit WorldSource(const WorldImage& given);
    // Returns whether the source was made from an equal image. Returns false for coarse images,
    // from which a source is made at once.
    bool isOf(const WorldImage& given) const;

    LightSample sample(const glm::vec3& point, const glm::vec3& normal,
                       glm::vec2 uv) const override;
    LightSample sampleAlone(const glm::vec3& point, const glm::vec3& normal,
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

    // Returns the number of regions in the tree.
    size_t regionCount() const { return regions.size(); }

  private:
    // The pixels [x0, x1) x [y0, y1) of the image. Holds only what a sample reads on its way
    // through the tree, which is one cache line.
    struct Region {
        glm::vec3 axis{0.0f};  // unit vector to the middle
        // Sine of the angle from the axis to the farthest direction; kMoreThanHalf if no horizon
        // leaves the region whole.
        float reach = 0;
        // Integral of radiance (sum of the channels) times direction over the solid angle, W/m^2.
        glm::vec3 moment{0.0f};
        float strength = 0;  // integral of the radiance (sum of the channels), W/m^2
        // Vectors from the middle to the middle of an edge, along azimuth and along elevation.
        std::array<glm::vec3, 2> half{glm::vec3(0.0f), glm::vec3(0.0f)};
        // Index of the second child, or 0 without children. The first child is the next region.
        uint32_t second = 0;
        int16_t part = -1;  // index of the part that the region is, or -1
        // Whether the children lie side by side; if not, one lies above the other.
        bool cutsColumns = false;
    };
    // Further data of a region, read only at the end of a sample's way. Indexed like `regions`.
    struct RegionLight {
        uint32_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;
        float solidAngle = 0;                // sr
        glm::vec3 flux{0.0f};                // integral of the radiance, W/m^2
        std::array<glm::vec3, 3> moments{};  // Region::moment by channel
    };
    // Extremes of the radiance, sum of the channels, W/(m^2 sr).
    struct Extremes {
        float least, most;
    };
    // A region without children that a sample has chosen.
    struct Choice {
        uint32_t region;  // kNone: no region gives light
        glm::vec2 uv;
        float probability;
        int32_t part;
    };
    static constexpr uint32_t kNone = UINT32_MAX;

    // The light of the regions as a plane with a certain normal receives it. Neighbouring receivers
    // often have the same normal, so that it is computed once for all of them.
    struct Facing {
        glm::vec3 normal{0.0f}, irradiance{0.0f};
        // Irradiance from each region, sum of the channels, W/m^2. -1 for regions that look() did
        // not visit.
        std::vector<float> weight;
        std::vector<uint32_t> looked;
    };

    Extremes build(uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1);
    void findParts(uint32_t region);
    void findPartNeighbours();
    void measure(Region& region, RegionLight& light) const;
    void setPixel(Region& region, RegionLight& light) const;
    // Descends from a region to one without children. weightOf(region) returns the weight by which
    // two siblings are chosen.
    template <class WeightOf>
    Choice choose(uint32_t from, glm::vec2 uv, float probability, const WeightOf& weightOf) const;
    Choice chooseFacing(uint32_t from, glm::vec2 uv, float probability,
                        const glm::vec3& normal) const;
    LightSample sampleOf(const Choice& choice, const glm::vec3& normal) const;
    glm::vec3 directionIn(const RegionLight& region, glm::vec2 uv) const;
    static bool isFlat(const Region& region);
    // Returns the mean cosine by which a plane receives the light of a region that its horizon
    // cuts.
    static float meanCosine(const Region& region, const glm::vec3& normal);
    glm::vec3 look(uint32_t index, Facing& facing) const;
    const Facing& facingOf(const glm::vec3& normal) const;
    // Returns the irradiance from a region, sum of the channels, W/m^2. Approximate if look() did
    // not visit the region.
    float weightOf(uint32_t region, const Facing& facing) const;
    static float weightOf(const Region& region, const glm::vec3& normal);
    bool isSeen(uint32_t region, const glm::vec3& normal) const;

    const WorldImage image;
    std::vector<double> height;  // z of the lower edge of each row, and of the top edge
    // Integral of the squared cosine of the elevation, up to the lower edge of each row and to the
    // top.
    std::vector<double> heightAngle;
    // Cosine and sine of the azimuth of each column's left edge, and of the last one's right edge.
    std::vector<double> cosine, sine;
    // Least variation of the light of a flat region with children, W/m^2.
    float leastVariation = 0;
    // Least light times reach, W/m^2, of a flat region whose children are visited at the horizon.
    float leastCut = 0;
    std::vector<Region> regions;
    std::vector<RegionLight> lights;  // indexed like `regions`
    // The regions that are parts of the source. Together they are all of it.
    std::vector<uint32_t> partRegions;
    PartNeighbours partNeighbours;

    // Per thread, for the normal of its last receiver.
    mutable tbb::enumerable_thread_specific<Facing> facing;
};

// Returns the source of an image, which must not be black. It takes some 0.2 microseconds per pixel
// to make one. Therefore the last source that was made is returned again for an equal image as long
// as somebody holds it. Thread-safe.
std::shared_ptr<const WorldSource> worldSource(const WorldImage& image);

}  // namespace raybundle
