// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/final_gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "transport/sobol.h"
#include "transport/sphere_sampling.h"

namespace raybundle {
namespace {

// Sobol sets, each with its own shift, and rays of each: at first, of all receivers whose mean
// counts and of one at least; and at most.
constexpr uint32_t kSets = 8, kFirstRays = 16, kFewestRays = 4, kMostRays = 256;
// So many patches on a face tell whether interpolation follows them.
constexpr uint32_t kTellingPatches = 4;
// Rays that look for surfaces nearer than patches are wide.
constexpr uint32_t kNearRays = 8;
// What is so many lengths of the receiver's patch away may light its ends differently.
constexpr float kNearLengths = 2;
// The standard error of what is gathered, and how far interpolation may be off the light around,
// as shares of the error.
constexpr float kNoiseShare = 0.75f, kInterpolationShare = 1;

double square(const glm::vec3& v) { return double(glm::dot(v, v)) / 3; }

}  // namespace

FinalGather::FinalGather(const Patches& patches, const Visibility& visibility,
                         const SetLight& light, float meanLight, float targetError)
    : patches(patches),
      visibility(visibility),
      light(light),
      emission(light.direct.bundledEmission()),
      reflected(patches.sideCount()),
      world(glm::pi<float>() * light.worldRadiance),
      targetError(targetError),
      error(targetError * meanLight) {
    for (size_t side = 0; side < reflected.size(); ++side)
        reflected[side] = patches.reflectance[side] *
                          (light.irradiance.direct[side] + light.irradiance.indirect[side]);
}

FinalGather::Light FinalGather::gather(const Receiver& receiver, float brightness,
                                       size_t receivers) const {
    const glm::vec3 side = patches.normal(receiver.side);
    const double tolerance =
        double(receivers) *
        std::pow(double(kNoiseShare * std::max(error, targetError * brightness)), 2);
    std::array<Light, kSets> sums{};
    Light mean;
    uint32_t wanted = kFirstRays;
    for (size_t sharing = receivers; sharing > 1 && wanted > kFewestRays; sharing /= 2) wanted /= 2;
    for (uint32_t done = 0; done < kMostRays; wanted *= 2) {
        for (uint32_t set = 0; set < kSets; ++set)
            for (uint32_t i = done; i < wanted; ++i) {
                const glm::vec4 u = sobolPoint(i, hash(receiver.seed, set));
                const glm::vec3 direction = cosineDirection(receiver.normal, {u.x, u.y});
                // Below a face that is shaded as if it were bent.
                if (glm::dot(direction, side) <= 0) continue;
                float distance = 0;
                const auto hit =
                    visibility.firstHit(receiver.side, *receiver.point, direction, &distance);
                sums[set].carried += hit ? emission[*hit] : world;
                if (!hit) continue;
                sums[set].reflected += reflected[*hit];
                if (distance >= width(*hit)) continue;
                const Receiver met{*hit, patches.normal(*hit),
                                   *receiver.point + distance * direction,
                                   hash(receiver.seed, kSets + set)};
                sums[set].reflected +=
                    patches.reflectance[*hit] *
                    (light.direct.sample(met, i) - light.irradiance.gathered[*hit]);
            }
        const Light before = mean;
        mean = {};
        for (const Light& sum : sums) {
            mean.carried += sum.carried / float(kSets * wanted);
            mean.reflected += sum.reflected / float(kSets * wanted);
        }
        double variance = 0;
        for (const Light& sum : sums)
            variance += square(sum.total() / float(wanted) - mean.total()) / (kSets * (kSets - 1));
        // What few rays meet can be missed by all sets alike: the step from half as many counts
        // too.
        const double step = done > 0 ? square(mean.total() - before.total()) : INFINITY;
        if (std::max(variance, step) <= tolerance) break;
        done = wanted;
    }
    return mean;
}

bool FinalGather::isNear(const Receiver& receiver) const {
    const Parent& parent = patches.parentAt(receiver.side);
    if (parent.patchCount() >= kTellingPatches) return false;
    const float longest = std::ldexp(
        std::max(glm::length(parent.a) / parent.countA, glm::length(parent.b) / parent.countB),
        -patches.level(receiver.side / 2));
    for (uint32_t i = 0; i < kNearRays; ++i) {
        const glm::vec4 u = sobolPoint(i, hash(receiver.seed, 0));
        const glm::vec3 direction = cosineDirection(patches.normal(receiver.side), {u.x, u.y});
        float distance = 0;
        const auto hit = visibility.firstHit(receiver.side, *receiver.point, direction, &distance);
        if (hit && distance < std::max(width(*hit), kNearLengths * longest)) return true;
    }
    return false;
}

float FinalGather::width(uint32_t side) const { return std::sqrt(patches.area[side / 2]); }

std::vector<bool> FinalGather::isWanted(const InstanceRange& range, const SmoothRegions& regions,
                                        rb_side side, const std::vector<float>& exposed,
                                        const std::vector<glm::vec3>& carriedAt,
                                        const std::vector<glm::vec3>& reflectedAt) const {
    std::vector<double> squares(regions.nodeCount, 0.0), weights(regions.nodeCount, 0.0);
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        const Parent& parent = patches.parents[p];
        const Cell& cell = patches.cells[parent.cell];
        const glm::vec2 centroid = parent.isTriangle ? glm::vec2(1.0f / 3) : glm::vec2(0.5f);
        for (uint32_t k = 0; k < parent.patchCount(); ++k) {
            const uint32_t at = 2 * (parent.firstPatch + k) + uint32_t(side);
            const std::array<float, 4> shares =
                cell.weights(parent.position(parent.pointOn(k, centroid)));
            const Irradiance& h = light.irradiance;
            glm::vec3 difference = -(h.direct[at] - h.gathered[at] + h.indirect[at]);
            for (size_t a = 0; a < 4; ++a) {
                if (cell.corner[a] < 0) continue;
                const uint32_t node = regions.nodeOf[size_t(cell.corner[a])];
                difference += shares[a] * (carriedAt[node] + reflectedAt[node]);
            }
            const double area = double(patches.area[at / 2]) * double(exposed[at]);
            for (size_t a = 0; a < 4; ++a) {
                if (cell.corner[a] < 0 || shares[a] <= 0) continue;
                const uint32_t node = regions.nodeOf[size_t(cell.corner[a])];
                squares[node] += area * double(shares[a]) * square(difference);
                weights[node] += area * double(shares[a]);
            }
        }
    }
    std::vector<bool> result(regions.nodeCount);
    const double most = std::pow(double(kInterpolationShare * error), 2);
    for (size_t node = 0; node < result.size(); ++node)
        result[node] = squares[node] > most * weights[node];
    return result;
}

}  // namespace raybundle
