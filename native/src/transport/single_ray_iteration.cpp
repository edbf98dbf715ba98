// SPDX-License-Identifier: GPL-3.0-or-later
//
// STOCHASTIC_ITERATION with the single-ray operator (lines_per_bundle 1). Each iterate is the light
// of one ray. The ray's origin and direction are chosen by the exitance of the iterate before,
// which consists of the sources and of the one side that the last ray hit. The ray carries the
// power of all of them:
//
//   power_n = power of sources + reflectance(hit_n-1) * power_n-1,   H = mean of the iterates
//
// Sources: thesis section 2.6; Szirmay-Kalos, "Stochastic Iteration for Non-diffuse Global
// Illumination" (1999).
// Differs:
// - There are independent chains of iterates, so that more than two threads have work.
// - The first iterates of a chain lack the later bounces. They are left out of the mean until the
//   missing light is below kMissing of all light (at most as many as a chain is long).
// - For colours, rays are chosen by the sum of the channels and have the colour of their origin.
// The power stays below the power of the sources / (1 - largest reflectance), so that the iteration
// always converges. A bundle counts one ray.
#include <algorithm>
#include <cmath>

#include "transport/local_ray_transport.h"
#include "transport/stochastic_iteration.h"

namespace raybundle {
namespace {

constexpr uint32_t kRaysPerChain = 8192;

class SingleRayIteration : public LocalRayTransport {
  public:
    explicit SingleRayIteration(const TransportInput& input)
        : LocalRayTransport(input, 1, kRaysPerChain),
          most(largestReflectance(input.patches)),
          warmUp(warmUpIterates(most, kMissing, kRaysPerChain)) {}

    // Returns an upper bound: in a closed scene where all reflectances are the largest one, iterate
    // k lacks this reflectance to the power of k.
    double bias() const override { return std::pow(most, warmUp + 1); }

  private:
    void sample(uint32_t count, std::mt19937_64& random, RayLog& log) const override {
        std::optional<uint32_t> lit;  // side that the last ray hit, if any
        glm::vec3 reflected(0.0f);    // power that leaves this side, W
        for (uint32_t k = 0; k < warmUp + count; ++k) {
            const double reflectedPower = double(reflected.x) + reflected.y + reflected.z;
            const double power = rays.power() + reflectedPower;
            SourceRay ray;
            if (lit && uniform(random) * power < reflectedPower) {
                const glm::vec3 all = float(power / reflectedPower) * reflected;
                ray = {rays.fromSide(*lit, random, log), RayLight::REFLECTED, all};
            } else {
                ray = rays.fromSources(random, log);
                ray.power *= float(power / rays.power());
            }
            lit = ray.hit && input.exposed[*ray.hit] > 0 ? ray.hit : std::nullopt;
            if (lit && k >= warmUp) log.scores.push_back({*lit, ray.light, ray.power});
            reflected = lit ? input.patches.reflectance[*lit] * ray.power : glm::vec3(0.0f);
        }
    }

    const double most;
    const uint32_t warmUp;
};

}  // namespace

std::unique_ptr<Transport> singleRayIteration(const TransportInput& input) {
    return std::make_unique<SingleRayIteration>(input);
}

}  // namespace raybundle
