// SPDX-License-Identifier: GPL-3.0-or-later
//
// A transport whose samples are local rays or paths of local rays. Samples are traced in batches,
// each of which has its own random numbers. The results are added in the order of the batches, so
// that they do not depend on the number of threads.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <random>
#include <vector>

#include "transport/local_rays.h"
#include "transport/transport.h"

namespace raybundle {

// Base class of transports by local rays.
class LocalRayTransport : public Transport {
  public:
    void advance(uint32_t count, const Progress& progress) override;
    uint32_t bundleCount() const override { return bundles; }
    Irradiance irradiance(Half half, float tolerance) override;

    // Returns the share by the rays that left each side. If no ray left a side, the rays from other
    // patches of the same parent are used, and if there are none, the power from the world that
    // reached the side.
    std::vector<float> openShare() const override;

  protected:
    // `samplesPerBundle` is the number of samples that count as one bundle. `mostPerBatch` is the
    // largest number of samples in a batch.
    LocalRayTransport(const TransportInput& input, uint64_t samplesPerBundle,
                      uint32_t mostPerBatch);

    // Traces `count` samples, which may be independent or depend on the samples before. Adds them
    // to `log`; each score estimates the power that reaches its side. Called from several threads.
    virtual void sample(uint32_t count, std::mt19937_64& random, RayLog& log) const = 0;

    const TransportInput input;
    const LocalRays rays;

  private:
    // Sums over all samples of one half.
    struct Sums {
        std::vector<glm::dvec3> direct, indirect;  // per side: power that reached it, W
        // Per side: power from the world that reached it, summed over the channels, W.
        std::vector<double> world;
        // Per side: number of rays that left it, and number of these rays that left the scene.
        std::vector<uint32_t> rays, escapes;
        uint64_t samples = 0, batches = 0;
    };
    void add(const RayLog& log, Sums& to) const;

    const uint64_t samplesPerBundle;
    const uint32_t mostPerBatch;
    std::array<Sums, 2> halves;
    uint32_t bundles = 0;
};

}  // namespace raybundle
