// SPDX-License-Identifier: GPL-3.0-or-later
//
// SHOOT: the first shot as in the thesis. Lines of equal power go from the sources to the sides
// that they meet first.
//
// Sources: thesis section 2.4.2, fig. 2.11; section 4.3.3 (the number of lines by the variance).
// Differs:
// - The assignment `received[j] = ...` of fig. 2.11 must be an addition.
// - Lines are allotted systematically (visibility/local_lines.h), all with the same power. A source
//   that is certain to get lines divides its whole power among the lines that it got, so that power
//   is conserved exactly, in each channel.
// - The number of lines is doubled until the relative error, weighted by area, meets the target.
//   The thesis leaves this decision to the user.
// - Light that passes surfaces without being stopped is gathered (direct_light/direct_light.h),
//   because the lines end at the first surface.
// - The thesis has emissive patches only. Suns shoot parallel lines from a disk that covers the
//   scene; most of these lines may miss it. The disk of a lamp that faces each receiver shoots
//   along the lines on which each receiver would see it (lights/light_source.cpp).
#include "first_shot/shoot.h"

#include <algorithm>
#include <cmath>

#include "bundles/directions.h"
#include "patches/side.h"
#include "scene/channels.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

constexpr uint64_t kFirstLines = uint64_t(1) << 14;

LineEnd castFrom(const LightSource& source, const FirstShotInput& input, std::mt19937_64& random) {
    const Visibility& visibility = input.visibility;
    const EmittedRay ray = source.emit(uniformPoint(random), input.patches.radius);
    float distance = 0;
    const auto met =
        ray.side ? visibility.firstHit(*ray.side, ray.origin, ray.direction, &distance)
                 : visibility.firstHit(ray.start(visibility.offset()), ray.direction, &distance);
    if (!met) return {LineEnd::kSky, ray.weight};
    if (distance < ray.from) return {};
    if (ray.side && isCovered(input.patches, *ray.side, *met, ray.direction, distance)) return {};
    return {*met, ray.weight};
}

// Returns the relative RMS error of the irradiance, weighted by area; infinite if there is only
// noise.
double relativeError(const Patches& patches, const LocalLines& sums, double lines) {
    double noise = 0, signal = 0;
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        const double area = double(patches.area[patchOf(side)]);
        const double variance = sumOfChannels(sums.variance[side]) / (lines * lines);
        const glm::dvec3 power = sums.received[side] / lines;
        noise += variance / area;
        signal += (glm::dot(power, power) - variance) / area;
    }
    return signal > 0 ? std::sqrt(noise / signal) : INFINITY;
}

// Gathers the light that lines ending at the first surface cannot carry.
void addPassingLight(const FirstShotInput& input, SourceShot& shot) {
    std::vector<uint32_t> sides;
    for (uint32_t side = 0; side < input.patches.sideCount(); ++side)
        if (input.light.hasPassingLight(side)) sides.push_back(side);
    if (sides.empty()) return;
    const std::vector<Gathered> results = input.light.gather(
        sides.size(),
        [&](size_t k) {
            Receiver receiver{sides[k], input.patches.normal(sides[k]), std::nullopt, sides[k]};
            receiver.passingOnly = true;
            return receiver;
        },
        input.settings.targetError, [&](double) { input.progress.report(RB_STAGE_FIRST_SHOT, 0); });
    for (size_t k = 0; k < sides.size(); ++k) {
        const double area = double(input.patches.area[patchOf(sides[k])]);
        shot.received[sides[k]] += area * glm::dvec3(results[k].irradiance);
        shot.variance[sides[k]] += glm::dvec3(area * area * double(results[k].variance));
        shot.emitted += area * glm::dvec3(results[k].irradiance);
        shot.lines += results[k].rays;
    }
}

}  // namespace

SourceShot shootSources(const FirstShotInput& input, uint64_t lines) {
    const auto& sources = input.light.lightSources();
    const Patches& patches = input.patches;
    std::vector<glm::dvec3> power;
    double total = 0;
    for (const auto& source : sources) {
        power.emplace_back(source->castsShadows ? source->shootingPower(patches.radius)
                                                : glm::vec3(0.0f));
        total += sumOfChannels(power.back());
    }
    SourceShot shot;
    shot.received.resize(patches.sideCount());
    shot.variance.resize(patches.sideCount());
    addPassingLight(input, shot);
    if (!(total > 0)) return shot;

    const uint32_t seed = uint32_t(input.settings.seed);
    const double target = double(kDirectShare * input.settings.targetError);
    LocalLines sums(patches.sideCount(), sources.size());
    const uint64_t most = lines > 0 ? lines : kMostShotLines;
    uint64_t batch = lines > 0 ? lines : kFirstLines, done = 0;
    for (uint32_t round = 0; done < most; ++round) {
        // Each batch is an estimate by itself, weighted by its number of lines.
        std::vector<double> expected(sources.size());
        for (size_t k = 0; k < sources.size(); ++k)
            expected[k] = double(batch) * (sumOfChannels(power[k]) / total);
        std::seed_seq seeds{seed, kAllotSources, round};
        std::mt19937_64 random(seeds);
        const std::vector<uint64_t> counts = allotLines(expected, uniform(random));
        std::vector<glm::dvec3> perLine(sources.size(), glm::dvec3(0.0));
        for (size_t k = 0; k < sources.size(); ++k)
            if (counts[k] > 0)
                perLine[k] = power[k] / (expected[k] >= 1 ? double(counts[k]) : expected[k]);
        sums.cast(
            counts, perLine,
            [&](size_t k, std::mt19937_64& r) { return castFrom(*sources[k], input, r); },
            {seed, kShootSources, round}, double(batch),
            [&] { input.progress.report(RB_STAGE_FIRST_SHOT, double(done) / double(most)); });
        done += batch;
        // Double the number of lines at most, or take fewer if the error shows that fewer suffice.
        const double error = relativeError(patches, sums, double(done));
        if (lines > 0 || error <= target) break;
        const double missing = double(done) * (1.05 * std::pow(error / target, 2) - 1);
        batch = uint64_t(std::clamp(missing, 0.125 * double(done), double(done)));
        batch = std::min(batch, most - done);
    }

    const double n = double(done);
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        shot.received[side] += sums.received[side] / n;
        shot.variance[side] += sums.variance[side] / (n * n);
    }
    for (size_t k = 0; k < sources.size(); ++k) {
        shot.emitted += sums.arrived[k] / n;
        if (sources[k]->power() == glm::vec3(0.0f)) continue;
        shot.emitted += sums.missed[k] / n;
        shot.escaped += sums.missed[k] / n;
    }
    shot.powerPerLine = total / n;
    shot.lines += sums.lines;
    return shot;
}

std::vector<float> standardErrors(const Patches& patches, const std::vector<glm::dvec3>& variance) {
    std::vector<float> errors(variance.size());
    for (size_t side = 0; side < errors.size(); ++side) {
        const glm::dvec3& v = variance[side];
        errors[side] =
            float(std::sqrt(std::max({v.x, v.y, v.z})) / double(patches.area[patchOf(side)]));
    }
    return errors;
}

FirstShot shoot(const FirstShotInput& input) {
    const SourceShot sources = shootSources(input, uint64_t(input.settings.localRays));
    FirstShot shot;
    shot.emission = input.light.bundledEmission();
    shot.irradiance.resize(sources.received.size());
    for (size_t side = 0; side < shot.irradiance.size(); ++side)
        shot.irradiance[side] =
            glm::vec3(sources.received[side] / double(input.patches.area[patchOf(side)]));
    shot.error = standardErrors(input.patches, sources.variance);
    shot.emitted = sources.emitted;
    shot.escaped = sources.escaped;
    shot.rays = sources.lines;
    input.progress.report(RB_STAGE_FIRST_SHOT, 1);
    return shot;
}

}  // namespace raybundle
