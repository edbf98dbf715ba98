// SPDX-License-Identifier: GPL-3.0-or-later
#include "direct_light/emission_split.h"

#include <algorithm>
#include <glm/gtc/constants.hpp>
#include <random>

#include "bundles/directions.h"
#include "job/cancellation.h"
#include "lights/enclosing.h"
#include "lights/receiver.h"
#include "patches/side.h"
#include "sampling/sphere_sampling.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

// Emission up to this many times the mean exitance that lines meet is left to the bundles.
constexpr double kBundledEmission = 1.5;
// Number of paths that estimate the light leaving the scene. The standard error of a share of one
// half is 2 % of all light.
constexpr uint32_t kPaths = 512;

// The light of a set, as a mean over the surfaces of an island, W/m^2. Only its order of magnitude
// matters.
struct MeanLight {
    double area = 0;     // m^2
    double emitted = 0;  // by surfaces
    double lamps = 0;
    double sky = 0;
    double reflectance = 0;

    // Returns the exitance that lines meet, all bounces included. `met` is the share of lines from
    // a surface that meet another surface and not the sky.
    double exitance(double met) const {
        return (met * (emitted + lamps) + (1 - met) * sky) / std::max(0.05, 1 - met * reflectance);
    }
    double mostExitance() const { return exitance(1) + sky / std::max(0.05, 1 - reflectance); }
};

// Returns the island that contains a lamp or is nearest to it.
size_t islandNear(const Patches& patches, const glm::dvec3& position) {
    auto distance = [&](const Island& island) {
        return glm::distance(glm::dvec3(island.centre), position - patches.centre) -
               double(island.radius);
    };
    const auto nearest = std::min_element(
        patches.islands.begin(), patches.islands.end(),
        [&](const Island& a, const Island& b) { return distance(a) < distance(b); });
    return size_t(nearest - patches.islands.begin());
}

// Returns the mean light of each island. It is computed per island so that bright distant light
// does not make nearby emission count as dim.
std::vector<MeanLight> meanLights(const Scene& scene, const Patches& patches,
                                  const std::vector<glm::vec3>& emission, int32_t lightSet) {
    std::vector<MeanLight> means(patches.islands.size());
    if (means.size() == 1)
        means.front().area = patches.totalArea;
    else
        for (const Parent& parent : patches.parents)
            means[parent.island].area += double(parent.area());
    for (uint32_t side = 0; side < patches.sideCount(); ++side) {
        throwIfCancelledAt(side);
        MeanLight& mean = means[patches.parentAt(side).island];
        mean.emitted += patches.area[patchOf(side)] * brightest(emission[side]);
        if (!isBack(side))
            mean.reflectance += patches.area[patchOf(side)] *
                                brightest(patches.reflectance[side] + patches.translucenceOf(side));
    }
    for (const Light& light : scene.lights) {
        if (light.lightSet != lightSet || means.empty()) continue;
        const double strength = brightest(light.strength);
        switch (light.kind) {
            case Light::Kind::POINT:
                means[islandNear(patches, light.position)].lamps +=
                    4 * glm::pi<double>() * strength;
                break;
            case Light::Kind::SUN:
                for (MeanLight& mean : means) mean.lamps += 0.25 * mean.area * strength;
                break;
            case Light::Kind::AREA:
                means[islandNear(patches, light.position)].lamps +=
                    4 * glm::pi<double>() * strength *
                    glm::length(glm::cross(light.axisU, light.axisV));
                break;
        }
    }
    glm::vec3 world = scene.worldRadianceOf(lightSet);
    if (scene.worldLightSet == lightSet) world += scene.worldImage.meanRadiance();
    for (MeanLight& mean : means) {
        mean.emitted /= mean.area;
        mean.lamps /= mean.area;
        mean.reflectance /= mean.area;
        mean.sky = glm::pi<double>() * brightest(world);
    }
    return means;
}

// Returns the share of lines that meet a surface, among lines from the surfaces that the island's
// emission lights.
double metShare(const Patches& patches, const Visibility& visibility,
                const std::vector<glm::vec3>& emission, uint32_t island, double power,
                uint32_t seed) {
    // The path starts at the centroid of the side. With few paths the start point on the side
    // matters little.
    auto nextHit = [&](uint32_t side, glm::vec2 u) {
        return visibility.firstHit(side, patches.point(patchOf(side), glm::vec2(1 / 3.0f)),
                                   cosineDirection(patches.normal(side), u));
    };
    // Front and back sides alternate, and Sobol points have a similar regularity: equal steps
    // through either could select fronts alone. Therefore a path starts at a random position within
    // its step.
    std::mt19937_64 random(seed);
    uint32_t lit = 0, met = 0, path = 0;
    // Running sum over the sides, and start of the next path, in units of power / kPaths.
    double sum = 0, start = uniform(random);
    for (uint32_t side = 0; side < patches.sideCount(); ++side) {
        throwIfCancelledAt(side);
        if (patches.parentAt(side).island != island) continue;
        sum += patches.area[patchOf(side)] * brightest(emission[side]) / power * kPaths;
        for (; path < kPaths && start < sum; start = ++path + uniform(random)) {
            const glm::vec4 u = uniformPoint(random);
            const auto receiver = nextHit(side, {u.x, u.y});
            if (!receiver) continue;
            ++lit;
            met += nextHit(*receiver, {u.z, u.w}).has_value();
        }
    }
    return lit ? double(met) / lit : 0;
}

}  // namespace

EmissionSplit splitEmission(const Scene& scene, const Patches& patches,
                            const Visibility& visibility, int32_t lightSet, uint32_t seed,
                            const Skips& skips) {
    const size_t sides = patches.sideCount();
    EmissionSplit split{patches.emission, std::vector<glm::vec3>(sides),
                        std::vector<glm::vec3>(sides), std::vector<bool>(sides, false)};
    if (!scene.emits()) return split;
    for (size_t side = 0; side < sides; ++side) {
        throwIfCancelledAt(side);
        const uint32_t instance = patches.parentAt(side).instance;
        if (scene.instances[instance].lightSet != lightSet) split.emitted[side] = glm::vec3(0.0f);
    }
    if (skips.skipLampInsides) {
        const std::vector<bool> isEmpty = emptyInsides(scene, patches, split.emitted);
        for (uint32_t side = 1; side < sides && !isEmpty.empty(); side += 2) {
            throwIfCancelledAt(side);
            glm::vec3& emitted = split.emitted[side];
            if (!isEmpty[patches.parentAt(side).surface] || emitted == glm::vec3(0.0f)) continue;
            ++split.unseen;
            split.unseenPower += double(patches.area[patchOf(side)]) * glm::dvec3(emitted);
            emitted = glm::vec3(0.0f);
        }
    }
    const std::vector<MeanLight> means = meanLights(scene, patches, split.emitted, lightSet);
    std::vector<double> limits;  // largest emission left to the bundles, per island
    for (const MeanLight& mean : means) limits.push_back(kBundledEmission * mean.mostExitance());
    std::vector<bool> isNear(limits.size(), false);  // whether the share of the sky may decide
    for (uint32_t side = 0; side < sides; ++side) {
        throwIfCancelledAt(side);
        const uint32_t island = patches.parentAt(side).island;
        const double emission = brightest(split.emitted[side]);
        if (emission > 0 && emission <= limits[island]) isNear[island] = true;
    }
    for (uint32_t k = 0; k < limits.size(); ++k)
        if (isNear[k])
            limits[k] = kBundledEmission *
                        means[k].exitance(metShare(patches, visibility, split.emitted, k,
                                                   means[k].emitted * means[k].area, seed));
    for (uint32_t side = 0; side < sides; ++side) {
        throwIfCancelledAt(side);
        if (!patches.parentAt(side).exchanges) continue;
        if (brightest(split.emitted[side]) > limits[patches.parentAt(side).island]) {
            split.isSource[side] = true;
            split.ofSources[side] = patches.opacityOf(patchOf(side)) * split.emitted[side];
        } else {
            split.bundled[side] = split.emitted[side];
        }
    }
    return split;
}

}  // namespace raybundle
