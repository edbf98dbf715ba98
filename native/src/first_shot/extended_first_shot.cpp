// SPDX-License-Identifier: GPL-3.0-or-later
//
// EXTENDED: after the sources have shot their light, the sides that are brighter than the expected
// mean of the scene shoot their excess, in several rounds, so that the bundles find light
// everywhere.
//
// Sources: thesis chapter 3, fig. 3.5, eq. 3.1 and 3.2.
// Differs:
// - The loops of fig. 3.5 run once too often (`0..numberOfLines`). Here lines are allotted
//   systematically and all carry about the same power. A side that gets no line keeps its light.
// - A line carries the three channels of its side, which one scalar `powerPerLine` cannot.
// - All sides that shoot in a round read the unshot power of the start of the round.
// - Lines that miss the scene take their power from the shooting side. This power is not counted as
//   escaped here: the energy balance counts all reflected light by the share of the lines that
//   leave each side.
// - Unshot light is passed to the transport separately from the light that has arrived, so that
//   nothing counts twice.
// - Sources send all their light in the first step.
// - Eq. 3.2 grows without bound for white scenes, where nothing would exceed it. The mean
//   reflectance is therefore capped in it.
// - In eq. 3.1, f is a share of the scene's area, which gives the results of the thesis' examples.
//   The thesis defines it as an area. The number of lines that the equation gives is for the light
//   of the sources. The lines of the rounds have the same power each and are added to them.
#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "bundles/directions.h"
#include "first_shot/first_shot.h"
#include "first_shot/shoot.h"
#include "patches/side.h"
#include "sampling/sphere_sampling.h"
#include "scene/channels.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

constexpr int kMaxRounds = 8;
// With this cap the threshold is at most 19 times the mean light that the sources alone distribute
// over the scene.
constexpr double kMostReflectance = 0.95;
// Number of random points tried on a side that is partly covered.
constexpr int kTries = 8;

// Returns the mean over both sides of all patches, weighted by area.
glm::dvec3 meanReflectance(const Patches& patches) {
    glm::dvec3 reflected(0.0);
    for (size_t side = 0; side < patches.sideCount(); ++side)
        reflected += double(patches.area[patchOf(side)]) * glm::dvec3(patches.reflectance[side]);
    return patches.totalArea > 0 ? reflected / (2 * patches.totalArea) : glm::dvec3(0.0);
}

// Returns the number of lines from the sources, or 0 if they are to continue until the target error
// is reached.
uint64_t sourceLines(const FirstShotInput& input) {
    const Settings& settings = input.settings;
    if (settings.localRays > 0) return uint64_t(settings.localRays);
    if (settings.minBundles != settings.maxBundles || !(input.linesPerBundle > 0)) return 0;
    const Patches& patches = input.patches;
    const double radius = double(patches.radius);
    // Crofton: a line through the bounding sphere of radius R meets a surface of area A on average
    // A / (2 pi R^2) times.
    const double intersections = patches.totalArea / (2 * glm::pi<double>() * radius * radius);
    const double reflectance = sumOfChannels(meanReflectance(patches)) / 3;
    const double lines = localToGlobalRatio(intersections, reflectance, reflectance, 1) *
                         settings.maxBundles * input.linesPerBundle;
    return uint64_t(std::clamp(lines, 1.0, double(kMostShotLines)));
}

LineEnd castFrom(uint32_t side, const FirstShotInput& input, std::mt19937_64& random) {
    const Patches& patches = input.patches;
    const glm::vec3 normal = patches.normal(side);
    for (int k = 0; k < kTries; ++k) {
        const glm::vec4 u = uniformPoint(random);
        const glm::vec3 direction = cosineDirection(normal, {u.z, u.w});
        float distance = 0;
        const Visibility& visibility = input.exchange ? *input.exchange : input.visibility;
        const auto met = visibility.firstHit(side, patches.point(patchOf(side), {u.x, u.y}),
                                             direction, &distance);
        if (!met) return {LineEnd::kSky};
        if (!isCovered(patches, side, *met, direction, distance)) return {*met};
    }
    return {};
}

}  // namespace

double localToGlobalRatio(double intersections, double meanReflectance, double sourceReflectance,
                          double share) {
    const double rs = sourceReflectance;
    return std::sqrt(intersections * (1 - meanReflectance * meanReflectance) *
                     (1 - meanReflectance) /
                     (rs * rs * (1 - meanReflectance) / share + 2 * rs * rs * rs));
}

FirstShot extendedFirstShot(const FirstShotInput& input) {
    const Patches& patches = input.patches;
    const size_t n = patches.sideCount();
    SourceShot sources = shootSources(input, sourceLines(input));
    FirstShot shot;
    shot.emission = input.light.bundledEmission();
    shot.emitted = sources.emitted;
    shot.escaped = sources.escaped;
    shot.rays = sources.lines;
    shot.irradiance.resize(n);
    shot.indirect.resize(n);
    shot.unshot.resize(n);

    glm::dvec3 arrived(0.0);
    // W, per side: reflected but not yet shot, and received
    std::vector<glm::dvec3> unshot(n), indirect(n);
    for (size_t side = 0; side < n; ++side) {
        const glm::dvec3& received = sources.received[side];
        shot.irradiance[side] = glm::vec3(received / double(patches.area[patchOf(side)]));
        if (patches.parentAt(uint32_t(side)).exchanges)
            unshot[side] = glm::dvec3(patches.reflectance[side]) * received;
        arrived += received;
    }
    const glm::dvec3 reflectance = glm::min(meanReflectance(patches), glm::dvec3(kMostReflectance));
    const glm::dvec3 threshold =  // W/m^2
        patches.totalArea > 0 ? reflectance * arrived / (patches.totalArea * (1.0 - reflectance))
                              : glm::dvec3(0.0);

    const uint32_t seed = uint32_t(input.settings.seed);
    for (uint32_t round = 0; round < kMaxRounds && sources.powerPerLine > 0; ++round) {
        input.progress.report(RB_STAGE_FIRST_SHOT, double(round + 1) / (kMaxRounds + 1));
        std::vector<uint32_t> shooters;
        std::vector<glm::dvec3> excess;
        std::vector<double> expected;
        for (uint32_t side = 0; side < n; ++side) {
            const glm::dvec3 above = glm::max(
                unshot[side] - double(patches.area[patchOf(side)]) * threshold, glm::dvec3(0.0));
            if (!(sumOfChannels(above) > 0)) continue;
            shooters.push_back(side);
            excess.push_back(above);
            expected.push_back(sumOfChannels(above) / sources.powerPerLine);
        }
        std::seed_seq seeds{seed, kAllotReflected, round};
        std::mt19937_64 random(seeds);
        const std::vector<uint64_t> counts = allotLines(expected, uniform(random));
        std::vector<glm::dvec3> perLine(shooters.size(), glm::dvec3(0.0));
        for (size_t k = 0; k < shooters.size(); ++k)
            if (counts[k] > 0) perLine[k] = excess[k] / double(counts[k]);
        LocalLines sums(n, shooters.size());
        sums.cast(
            counts, perLine,
            [&](size_t k, std::mt19937_64& r) { return castFrom(shooters[k], input, r); },
            {seed, kShootReflected, round}, 1,
            [&] {
                input.progress.report(RB_STAGE_FIRST_SHOT, double(round + 1) / (kMaxRounds + 1));
            });
        if (sums.lines == 0) break;
        shot.rays += sums.lines;
        for (size_t k = 0; k < shooters.size(); ++k)
            unshot[shooters[k]] -= sums.arrived[k] + sums.missed[k];
        for (size_t side = 0; side < n; ++side) {
            unshot[side] += glm::dvec3(patches.reflectance[side]) * sums.received[side];
            indirect[side] += sums.received[side];
            sources.variance[side] += sums.variance[side];
        }
    }

    for (size_t side = 0; side < n; ++side) {
        const double area = double(patches.area[patchOf(side)]);
        shot.indirect[side] = glm::vec3(indirect[side] / area);
        shot.unshot[side] = glm::vec3(glm::max(unshot[side], glm::dvec3(0.0)) / area);
    }
    shot.error = standardErrors(patches, sources.variance);
    input.progress.report(RB_STAGE_FIRST_SHOT, 1);
    return shot;
}

}  // namespace raybundle
