// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/final_gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "patches/side.h"
#include "sampling/sobol.h"
#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

// The Sobol points are divided into parts, whose differences show the noise: kParts for all
// receivers that contribute to a mean, but at least kFewestParts for each receiver. Each part
// starts with kFirstRays rays and has at most kMostRays.
constexpr uint32_t kParts = 8, kFewestParts = 2, kFirstRays = 4, kMostRays = 1024;
// Minimum of the number of rays of all parts times the target error. Features that so few rays miss
// have a share of the surrounding light of about one over the number of rays. The rays are the same
// whatever the seed of the bake, so that their error looks like light: with half as many, corners
// of the pebble of instances had 4 % too much at a target of 2 %.
constexpr float kFewestTimesTarget = 5;
// Minimum number of patches in a parent for which the light of the patches shows whether the
// interpolation follows it.
constexpr uint32_t kTellingPatches = 4;
// Mean number of sources that are sampled at the end of a ray that meets a surface nearby.
constexpr float kSourcesOfRay = 4;
// Number of rays of a probe, and of standard deviations by which it contradicts.
constexpr uint32_t kProbeRays = 16;
constexpr double kContradiction = 2.5;
// Number of rays that look for surfaces nearer than patches are wide.
constexpr uint32_t kNearRays = 8;
// A surface nearer than this many times the length of the receiver's patch may light the ends of
// the patch differently.
constexpr float kNearLengths = 2;
// Minimum cosine between the shading normal and the normal of a face for which the face counts as
// flat.
constexpr float kNearlyFlat = 0.99f;
// The largest standard error of the gathered light, and the largest RMS difference between the
// interpolated light and the light of the patches at which it is kept. Both are relative to the
// allowed error.
constexpr float kNoiseShare = 0.6f, kInterpolationShare = 1;
// Ratio of the standard error that is estimated from the spread of the parts to the actual standard
// error of the mean. The estimate is too large because the parts are stratified together. With this
// ratio the actual error, measured against gathers with many more rays in open_court and instances,
// is equal to that of parts with independent random shifts and a ratio of 1.
constexpr float kSpreadOverError = 2;

// Returns the mean of the squares over the channels.
double square(const glm::vec3& v) { return double(glm::dot(v, v)) / 3; }

}  // namespace

double meanLight(const Scene& scene, const LitSurfaces& surfaces,
                 const std::vector<InstanceRange>& ranges, const Irradiance& light) {
    double squares = 0, area = 0;
    for (size_t i = 0; i < ranges.size(); ++i) {
        if (scene.instances[i].role != RB_ROLE_BAKE) continue;
        for (uint32_t p = ranges[i].firstParent; p < ranges[i].lastParent; ++p) {
            const Parent& parent = surfaces.patches.parents[p];
            for (uint32_t k = 0; k < parent.patchCount(); ++k) {
                const uint32_t side =
                    2 * (parent.firstPatch + k) + uint32_t(scene.instances[i].side);
                const glm::dvec3 h(light.direct[side] + light.indirect[side]);
                const double weight = surfaces.exposedArea(side);
                squares += weight * glm::dot(h, h) / 3;
                area += weight;
            }
        }
    }
    return area > 0 ? std::sqrt(squares / area) : 0;
}

FinalGather::FinalGather(const LitSurfaces& surfaces, const Visibility& visibility,
                         const Clusters& clusters, const SetLight& light,
                         const Irradiance& irradiance, float meanLight, float targetError)
    : surfaces(surfaces),
      visibility(visibility),
      clusters(clusters),
      light(light),
      irradiance(irradiance),
      emission(light.direct.bundledEmission()),
      sent(surfaces, light.shot, irradiance, SentLight::Of::ALL),
      nearShare(std::min(
          1.0f, kSourcesOfRay / float(std::max<size_t>(1, light.direct.lightSources().size())))),
      world(glm::pi<float>() * light.worldRadiance),
      mean(meanLight),
      targetError(targetError) {}

float FinalGather::allowedError(const Receiver& receiver, float brightness) const {
    return kNoiseShare * receiver.targetFactor * targetError * brightness;
}

FinalGather::Light FinalGather::gather(const std::vector<Share>& receivers, float brightness,
                                       float laxity, bool followsOn) const {
    // What is `laxity` times as noisy counts only together with laxity^2 others.
    const float factor = laxity * laxity * receivers[0].receiver->targetFactor;
    const double tolerance = std::pow(
        double(kSpreadOverError * laxity * allowedError(*receivers[0].receiver, brightness)), 2);
    const uint32_t parts = std::max(kFewestParts, kParts / uint32_t(receivers.size()));
    std::vector<Light> sums(receivers.size() * parts);
    const uint32_t count = uint32_t(sums.size());
    uint32_t wanted = kFirstRays;
    // The loop below compares two rounds, so that it casts at least twice this number of rays.
    while (wanted < kMostRays / 2 &&
           2 * float(wanted * count) * factor * targetError < kFewestTimesTarget)
        wanted *= 2;
    const SobolPoints points(hash(receivers[0].receiver->seed, 0));
    Light mean;
    for (uint32_t done = 0; done < kMostRays; wanted *= 2) {
        const Light before = mean;
        mean = {};
        // The rays cast so far used the first points of the sequence. The next points follow,
        // `each` per part.
        const uint32_t each = wanted - done;
        for (uint32_t k = 0; k < count; ++k) {
            const Share& one = receivers[k / parts];
            addRays(*one.receiver, points, done * count + k * each, each, followsOn, sums[k]);
            const float share = one.share / float(parts * wanted);
            mean.carried += share * sums[k].carried;
            mean.reflected += share * sums[k].reflected;
            mean.open += share * sums[k].open;
        }
        // The spread is taken about the mean of all receivers: one receiver has so few parts that
        // they may agree by chance.
        double variance = 0;
        for (uint32_t k = 0; k < count; ++k) {
            const double share = double(receivers[k / parts].share) / parts;
            variance += share * share * square(sums[k].total() / float(wanted) - mean.total());
        }
        variance *= double(count) / double(count - 1);
        // All parts alike may miss what only few rays meet. The change from half the number of rays
        // therefore counts too.
        mean.variance = variance / (kSpreadOverError * kSpreadOverError);
        const double step = done > 0 ? square(mean.total() - before.total()) : INFINITY;
        if (std::max(variance, step) <= tolerance) break;
        done = wanted;
    }
    return mean;
}

FinalGather::Probe FinalGather::probe(const Receiver* const* receivers, size_t count) const {
    const SobolPoints points(hash(receivers[0]->seed, kParts + 1));
    Probe probe;
    for (uint32_t i = 0; i < kProbeRays; ++i) {
        Light one;
        addRays(*receivers[i % count], points, i, 1, false, one);
        probe.light += one.total() / float(kProbeRays);
        probe.square += square(one.total()) / kProbeRays;
        probe.nearness += one.nearness / float(kProbeRays);
        probe.open += one.open / float(kProbeRays);
    }
    return probe;
}

bool FinalGather::Probe::contradicts(const glm::vec3& expected, float expectedOpen,
                                     double allowed) const {
    // The rays spread about what is expected, not about their mean: all of them may miss the light.
    const double spread =
        raybundle::square(expected) - 2 * double(glm::dot(expected, light)) / 3 + square;
    const float rare = expectedOpen * (1 - expectedOpen) + 0.5f / float(kProbeRays);
    return raybundle::square(light - expected) >
               kContradiction * kContradiction * (spread / kProbeRays + allowed) ||
           std::abs(open - expectedOpen) >
               float(kContradiction) * std::sqrt(rare / float(kProbeRays));
}

// Adds to `sum` the light that rays bring to a receiver. The rays use `count` points of the
// sequence, starting with the one at index `first`.
void FinalGather::addRays(const Receiver& receiver, const SobolPoints& points, uint32_t first,
                          uint32_t count, bool followsOn, Light& sum) const {
    const glm::vec3 side = surfaces.patches.normal(receiver.side);
    for (uint32_t i = first; i < first + count; ++i) {
        const glm::vec4 u = points[i];
        glm::vec3 direction = cosineDirection(receiver.normal, {u.x, u.y});
        if (const float up = glm::dot(direction, side); up <= 0) {
            // On a face whose shading normals make it look curved, light from below the face is
            // lost, as in Cycles. On a nearly flat quad, which is only slightly off its plane, the
            // direction is mirrored to above the face.
            if (glm::dot(receiver.normal, side) < kNearlyFlat) continue;
            direction -= 2 * up * side;
        }
        float distance = 0;
        const auto hit = visibility.firstHit(receiver.side, *receiver.point, direction, &distance);
        sum.carried += hit ? emission[*hit] : world;
        if (!hit) {
            ++sum.open;
            continue;
        }
        sum.nearness += 1 / std::max(distance, surfaces.patches.touchDistance);
        sum.reflected += sent.towards(*hit, -direction);
        if (distance >= width(*hit)) continue;
        const Receiver met{*hit, surfaces.patches.normal(*hit),
                           *receiver.point + distance * direction, hash(receiver.seed, kParts)};
        if (followsOn || world != glm::vec3(0.0f)) {
            glm::vec3 known = irradiance.direct[*hit] - irradiance.ofSources[*hit];
            if (followsOn) known += irradiance.indirect[*hit];
            sum.reflected += surfaces.patches.reflectance[*hit] *
                             (sampleOne(met, {u.z, u.w}, followsOn) - known);
        }
        // With many sources, few of the rays sample them, and count for the others.
        if (nearShare < 1 && float(hash(receiver.seed, i) >> 8) * 0x1p-24f >= nearShare) continue;
        sum.reflected += shotReflectance(surfaces.patches, light.shot, *hit) / nearShare *
                         (light.direct.sample(met, i) - irradiance.ofSources[*hit]);
    }
}

glm::vec3 FinalGather::sampleOne(const Receiver& at, const glm::vec2& u, bool withReflected) const {
    const glm::vec3 direction = cosineDirection(at.normal, u);
    const auto hit = visibility.firstHit(at.side, *at.point, direction);
    if (!hit) return world;
    return emission[*hit] + (withReflected ? sent.towards(*hit, -direction) : glm::vec3(0.0f));
}

bool FinalGather::isNear(const Receiver& receiver) const {
    const Parent& parent = surfaces.patches.parentAt(receiver.side);
    if (parent.patchCount() >= kTellingPatches) return false;
    const float longest = std::ldexp(
        std::max(glm::length(parent.a) / parent.countA, glm::length(parent.b) / parent.countB),
        -surfaces.patches.level(patchOf(receiver.side)));
    const SobolPoints points(hash(receiver.seed, 0));
    for (uint32_t i = 0; i < kNearRays; ++i) {
        const glm::vec4 u = points[i];
        const glm::vec3 direction =
            cosineDirection(surfaces.patches.normal(receiver.side), {u.x, u.y});
        float distance = 0;
        const auto hit = visibility.firstHit(receiver.side, *receiver.point, direction, &distance);
        if (hit && distance < std::max(width(*hit), kNearLengths * longest)) return true;
    }
    return false;
}

float FinalGather::width(uint32_t side) const {
    return std::sqrt(clusters.patches().area[patchOf(clusters.sideOf(side))]);
}

std::vector<bool> FinalGather::isWanted(const InstanceRange& range, const SmoothRegions& regions,
                                        rb_side side, const std::vector<glm::vec3>& carriedAt,
                                        const std::vector<glm::vec3>& reflectedAt) const {
    std::vector<double> squares(regions.nodeCount, 0.0), weights(regions.nodeCount, 0.0);
    const CornerWeights cornerWeights(surfaces, range, side);
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        const Parent& parent = surfaces.patches.parents[p];
        const Cell& cell = surfaces.patches.cells[parent.cell];
        // The final gather does not collect light from behind, which translucent patches show too.
        if (surfaces.patches.translucenceOf(2 * parent.firstPatch + uint32_t(side)) !=
            glm::vec3(0.0f))
            continue;
        for (uint32_t k = 0; k < parent.patchCount(); ++k) {
            const uint32_t at = 2 * (parent.firstPatch + k) + uint32_t(side);
            const std::array<float, 4> shares = cornerWeights.of(p, k).corner;
            const Irradiance& h = irradiance;
            glm::vec3 difference = -(h.direct[at] - h.ofSources[at] + h.indirect[at]);
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
    const double most = std::pow(double(kInterpolationShare * targetError * mean), 2);
    for (size_t node = 0; node < result.size(); ++node)
        result[node] = squares[node] > most * weights[node];
    return result;
}

}  // namespace raybundle
