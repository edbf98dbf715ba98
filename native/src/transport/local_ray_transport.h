// SPDX-License-Identifier: GPL-3.0-or-later
//
// A transport whose samples are local rays or paths of them: traced in batches, each with random
// numbers of its own, and added up in the order of the batches, so that the number of threads does
// not matter.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <random>
#include <vector>

#include "transport/local_rays.h"
#include "transport/transport.h"

namespace raybundle {

class LocalRayTransport : public Transport {
  public:
    void advance(uint32_t count, const Progress& progress) override;
    uint32_t bundleCount() const override { return bundles; }
    Irradiance irradiance(Half half, float tolerance) override;

    // By the rays from each side; from a side that none left, by those from other patches of the
    // same face, and else by the world's rays that reached it.
    std::vector<float> openShare() const override;

  protected:
    // samplesPerBundle: what counts as a bundle. mostPerBatch: samples with the same random
    // numbers.
    LocalRayTransport(const TransportInput& input, uint64_t samplesPerBundle,
                      uint32_t mostPerBatch);

    // Traces `count` independent or consecutive samples. Each score is an estimate of the power
    // that reaches its side. Called from several threads.
    virtual void sample(uint32_t count, std::mt19937_64& random, RayLog& log) const = 0;

    const TransportInput input;
    const LocalRays rays;

  private:
    // Sums over the samples of one half.
    struct Sums {
        std::vector<glm::dvec3> direct, indirect;  // per side: power that reached it, W
        std::vector<double> world;                 // per side: that of the world, all channels, W
        std::vector<uint32_t> rays, escapes;       // per side: that left it; and left the scene
        uint64_t samples = 0, batches = 0;
    };
    void add(const RayLog& log, Sums& to) const;

    const uint64_t samplesPerBundle;
    const uint32_t mostPerBatch;
    std::array<Sums, 2> halves;
    uint32_t bundles = 0;
};

}  // namespace raybundle
