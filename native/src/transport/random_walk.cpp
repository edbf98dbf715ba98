// SPDX-License-Identifier: GPL-3.0-or-later
//
// RANDOM_WALK: walks carry light from the sources along local rays, from hit to hit, until a
// surface absorbs the walk or it leaves the scene. There are three estimators of the power that
// reaches a side (settings.estimator). A walk has the power Phi of all sources and survives a hit
// with probability R. The estimators add:
//   COLLISION   Phi            at every hit
//   SURVIVAL    Phi / R        at every hit that the walk survives
//   ABSORPTION  Phi / (1 - R)  at the hit where the walk is absorbed
//
// Sources: thesis section 2.5, fig. 2.12 (Sbert's Phi_T, Phi_T / R_i and Phi_T / (1 - R_i)).
// Differs:
// - For colours, R is the largest channel of the reflectance, and the power of the walk is
//   multiplied by reflectance / R, which is 1 on grey surfaces.
// - No walk survives a hit on a black side, so that SURVIVAL would find no light there. On black
//   sides it adds Phi at the hit.
// - Walks continue from a new random point of the patch that they hit, because light is constant
//   within a patch. They start with the light that the first shot left over.
// A bundle counts as many walks as a bundle has lines.
#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "transport/local_ray_transport.h"

namespace raybundle {
namespace {

constexpr uint32_t kWalksPerBatch = 4096;

// Returns the number of lines of a bundle through the scene's sphere, at least 1.
uint64_t linesPerBundle(const TransportInput& input) {
    const double across =
        glm::pi<double>() * double(input.patches.radius) * double(input.patches.radius);
    return std::max<uint64_t>(1, uint64_t(std::llround(across / input.tracer.pixelArea)));
}

class RandomWalk : public LocalRayTransport {
  public:
    explicit RandomWalk(const TransportInput& input)
        : LocalRayTransport(input, linesPerBundle(input), kWalksPerBatch),
          estimator(input.settings.estimator) {}

  private:
    void sample(uint32_t count, std::mt19937_64& random, RayLog& log) const override {
        for (uint32_t k = 0; k < count; ++k) walk(random, log);
    }

    void walk(std::mt19937_64& random, RayLog& log) const {
        SourceRay ray = rays.fromSources(random, log);
        while (ray.hit && input.exposed[*ray.hit] > 0) {
            const uint32_t side = *ray.hit;
            const float survival = LocalRays::reflectance(input.patches, side);
            const bool survives = float(uniform(random)) < survival;
            if (const float s = score(survival, survives); s > 0)
                log.scores.push_back({side, ray.light, s * ray.power});
            if (!survives) return;
            ray.power *= input.patches.reflectance[side] / survival;
            ray.light = RayLight::REFLECTED;
            ray.hit = rays.fromSide(side, random, log);
        }
    }

    // Returns the power that the estimator adds at a hit, relative to the power of the walk.
    float score(float survival, bool survives) const {
        switch (estimator) {
            case Estimator::SURVIVAL:
                if (survival > 0) return survives ? 1 / survival : 0;
                return 1;
            case Estimator::ABSORPTION:
                return survives ? 0 : 1 / (1 - survival);
            case Estimator::COLLISION:
                break;
        }
        return 1;
    }

    const Estimator estimator;
};

}  // namespace

std::unique_ptr<Transport> randomWalk(const TransportInput& input) {
    return std::make_unique<RandomWalk>(input);
}

}  // namespace raybundle
