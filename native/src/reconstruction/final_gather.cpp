// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/final_gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "sampling/sobol.h"
#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

// Parts of the Sobol points of all receivers that share in a mean, and of those of each of them at
// least. Rays of a part: at first and at most.
constexpr uint32_t kParts = 8, kFewestParts = 2, kFirstRays = 4, kMostRays = 1024;
// The fewest rays of all parts times the target: what so few miss is a share of the light around of
// about one over their number.
constexpr float kFewestTimesTarget = 2.5f;
// So many patches on a face tell whether interpolation follows them.
constexpr uint32_t kTellingPatches = 4;
// Rays that look for surfaces nearer than patches are wide.
constexpr uint32_t kNearRays = 8;
// What is so many lengths of the receiver's patch away may light its ends differently.
constexpr float kNearLengths = 2;
// Cosine between shading normal and face up to which a face is nearly flat.
constexpr float kNearlyFlat = 0.99f;
// The standard error of what is gathered, and how far interpolation may be off the light around,
// as shares of the error.
constexpr float kNoiseShare = 0.6f, kInterpolationShare = 1;
// The spread of parts that are stratified together over the standard error of their mean, which it
// overstates: against gathers by many more rays it keeps the error that parts with shifts of their
// own have at 1 (open_court, instances).
constexpr float kSpreadOverError = 2;

double square(const glm::vec3& v) { return double(glm::dot(v, v)) / 3; }

}  // namespace

FinalGather::FinalGather(const LitSurfaces& surfaces, const Visibility& visibility,
                         const SetLight& light, float meanLight, float targetError)
    : surfaces(surfaces),
      patches(surfaces.patches),
      visibility(visibility),
      light(light),
      emission(light.direct.bundledEmission()),
      sent(surfaces, light.shot, light.irradiance, SentLight::Of::ALL),
      world(glm::pi<float>() * light.worldRadiance),
      targetError(targetError),
      error(targetError * meanLight) {}

FinalGather::Light FinalGather::gather(const std::vector<Share>& receivers,
                                       float brightness) const {
    const double tolerance = std::pow(
        double(kSpreadOverError * kNoiseShare * std::max(error, targetError * brightness)), 2);
    const uint32_t parts = std::max(kFewestParts, kParts / uint32_t(receivers.size()));
    std::vector<Light> sums(receivers.size() * parts);
    const uint32_t count = uint32_t(sums.size());
    uint32_t wanted = kFirstRays;
    // Twice as many are taken before the first look at how they differ.
    while (wanted < kMostRays / 2 && 2 * float(wanted * count) * targetError < kFewestTimesTarget)
        wanted *= 2;
    const SobolPoints points(hash(receivers[0].receiver->seed, 0));
    Light mean;
    for (uint32_t done = 0; done < kMostRays; wanted *= 2) {
        const Light before = mean;
        mean = {};
        // Those that are done are the first of the sequence, and these come next.
        const uint32_t each = wanted - done;
        for (uint32_t k = 0; k < count; ++k) {
            const Share& one = receivers[k / parts];
            addRays(*one.receiver, points, done * count + k * each, each, sums[k]);
            const float share = one.share / float(parts * wanted);
            mean.carried += share * sums[k].carried;
            mean.reflected += share * sums[k].reflected;
        }
        // From the mean of all: parts of one receiver are so few that they are alike by chance.
        double variance = 0;
        for (uint32_t k = 0; k < count; ++k) {
            const double share = double(receivers[k / parts].share) / parts;
            variance += share * share * square(sums[k].total() / float(wanted) - mean.total());
        }
        variance *= double(count) / double(count - 1);
        // What few rays meet can be missed by all parts alike: the step from half as many counts
        // too.
        mean.variance = variance / (kSpreadOverError * kSpreadOverError);
        const double step = done > 0 ? square(mean.total() - before.total()) : INFINITY;
        if (std::max(variance, step) <= tolerance) break;
        done = wanted;
    }
    return mean;
}

// Adds what the rays by `count` points from the `first` one on bring to a receiver.
void FinalGather::addRays(const Receiver& receiver, const SobolPoints& points, uint32_t first,
                          uint32_t count, Light& sum) const {
    const glm::vec3 side = patches.normal(receiver.side);
    for (uint32_t i = first; i < first + count; ++i) {
        const glm::vec4 u = points[i];
        glm::vec3 direction = cosineDirection(receiver.normal, {u.x, u.y});
        if (const float up = glm::dot(direction, side); up <= 0) {
            // Lost on a face that is shaded as if it were bent, as in Cycles; not where a quad is
            // only a little off its plane.
            if (glm::dot(receiver.normal, side) < kNearlyFlat) continue;
            direction -= 2 * up * side;
        }
        float distance = 0;
        const auto hit = visibility.firstHit(receiver.side, *receiver.point, direction, &distance);
        sum.carried += hit ? emission[*hit] : world;
        if (!hit) continue;
        sum.reflected += sent.towards(*hit, -direction);
        if (distance >= width(*hit)) continue;
        const Receiver met{*hit, patches.normal(*hit), *receiver.point + distance * direction,
                           hash(receiver.seed, kParts)};
        sum.reflected += shotReflectance(patches, light.shot, *hit) *
                         (light.direct.sample(met, i) - light.irradiance.gathered[*hit]);
    }
}

bool FinalGather::isNear(const Receiver& receiver) const {
    const Parent& parent = patches.parentAt(receiver.side);
    if (parent.patchCount() >= kTellingPatches) return false;
    const float longest = std::ldexp(
        std::max(glm::length(parent.a) / parent.countA, glm::length(parent.b) / parent.countB),
        -patches.level(receiver.side / 2));
    const SobolPoints points(hash(receiver.seed, 0));
    for (uint32_t i = 0; i < kNearRays; ++i) {
        const glm::vec4 u = points[i];
        const glm::vec3 direction = cosineDirection(patches.normal(receiver.side), {u.x, u.y});
        float distance = 0;
        const auto hit = visibility.firstHit(receiver.side, *receiver.point, direction, &distance);
        if (hit && distance < std::max(width(*hit), kNearLengths * longest)) return true;
    }
    return false;
}

float FinalGather::width(uint32_t side) const { return std::sqrt(patches.area[side / 2]); }

std::vector<bool> FinalGather::isWanted(const InstanceRange& range, const SmoothRegions& regions,
                                        rb_side side, const std::vector<glm::vec3>& carriedAt,
                                        const std::vector<glm::vec3>& reflectedAt) const {
    std::vector<double> squares(regions.nodeCount, 0.0), weights(regions.nodeCount, 0.0);
    const CornerWeights cornerWeights(surfaces, range, side);
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        const Parent& parent = patches.parents[p];
        const Cell& cell = patches.cells[parent.cell];
        // What comes from behind is not gathered.
        if (patches.translucenceOf(2 * parent.firstPatch + uint32_t(side)) != glm::vec3(0.0f))
            continue;
        for (uint32_t k = 0; k < parent.patchCount(); ++k) {
            const uint32_t at = 2 * (parent.firstPatch + k) + uint32_t(side);
            const std::array<float, 4> shares = cornerWeights.of(p, k).corner;
            const Irradiance& h = light.irradiance;
            glm::vec3 difference = -(h.direct[at] - h.gathered[at] + h.indirect[at]);
            for (size_t a = 0; a < 4; ++a) {
                if (cell.corner[a] < 0) continue;
                const uint32_t node = regions.nodeOf[size_t(cell.corner[a])];
                difference += shares[a] * (carriedAt[node] + reflectedAt[node]);
            }
            const double area = surfaces.exposedArea(at);
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
