// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/emission_split.h"

#include <algorithm>
#include <glm/gtc/constants.hpp>
#include <random>

#include "bundles/directions.h"
#include "transport/local_lines.h"
#include "transport/receiver.h"
#include "transport/sphere_sampling.h"

namespace raybundle {
namespace {

// Emission up to this many times the mean exitance that lines meet is left to the bundles.
constexpr double kBundledEmission = 1.5;
// Paths by which the light that leaves the scene is estimated: a share of one half to 2 % of all.
constexpr uint32_t kPaths = 512;

// The light of a set, as a mean over the scene's surfaces, W/m^2. Only orders of magnitude matter.
struct MeanLight {
    double emitted = 0;  // by surfaces
    double lamps = 0;
    double sky = 0;
    double reflectance = 0;

    // Exitance that lines meet, all bounces included; met: the share of lines from a surface that
    // meet another one, and not the sky.
    double exitance(double met) const {
        return (met * (emitted + lamps) + (1 - met) * sky) / std::max(0.05, 1 - met * reflectance);
    }
    double mostExitance() const { return exitance(1) + sky / std::max(0.05, 1 - reflectance); }
};

MeanLight meanLight(const Scene& scene, const Patches& patches,
                    const std::vector<glm::vec3>& emission, int32_t lightSet) {
    MeanLight mean;
    for (size_t side = 0; side < patches.sideCount(); ++side) {
        mean.emitted += patches.area[side / 2] * brightest(emission[side]);
        if (side % 2 == 0)
            mean.reflectance += patches.area[side / 2] *
                                brightest(patches.reflectance[side] + patches.translucenceOf(side));
    }
    const double area = patches.totalArea;
    for (const Light& light : scene.lights) {
        if (light.lightSet != lightSet) continue;
        const double strength = brightest(light.strength);
        switch (light.kind) {
            case Light::Kind::POINT:
                mean.lamps += 4 * glm::pi<double>() * strength;
                break;
            case Light::Kind::SUN:
                mean.lamps += 0.25 * area * strength;
                break;
            case Light::Kind::AREA:
                mean.lamps += 4 * glm::pi<double>() * strength *
                              glm::length(glm::cross(light.axisU, light.axisV));
                break;
        }
    }
    mean.emitted /= area;
    mean.lamps /= area;
    mean.reflectance /= area;
    glm::vec3 world = scene.worldRadianceOf(lightSet);
    if (scene.worldLightSet == lightSet) world += scene.worldImage.meanRadiance();
    mean.sky = glm::pi<double>() * brightest(world);
    return mean;
}

// Share of lines from the surfaces that emission lights which meet a surface.
double metShare(const Patches& patches, const Visibility& visibility,
                const std::vector<glm::vec3>& emission, double power, uint32_t seed) {
    // From the middle of a side: where it starts matters less than that there are few paths.
    auto nextHit = [&](uint32_t side, glm::vec2 u) {
        return visibility.firstHit(side, patches.point(side / 2, glm::vec2(1 / 3.0f)),
                                   cosineDirection(patches.normal(side), u));
    };
    // Sides are in an order, fronts and backs in turns, and so are the points of Sobol's sequence:
    // equal steps through either could meet fronts alone. A path starts anywhere in its step.
    std::mt19937_64 random(seed);
    uint32_t lit = 0, met = 0, path = 0;
    double sum = 0, start = uniform(random);  // of all, and of the next path: power / kPaths
    for (uint32_t side = 0; side < patches.sideCount(); ++side) {
        sum += patches.area[side / 2] * brightest(emission[side]) / power * kPaths;
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
                            const Visibility& visibility, int32_t lightSet, uint32_t seed) {
    const size_t sides = patches.sideCount();
    EmissionSplit split{patches.emission, std::vector<glm::vec3>(sides),
                        std::vector<glm::vec3>(sides), std::vector<bool>(sides, false)};
    for (size_t side = 0; side < sides; ++side) {
        const uint32_t instance = patches.parents[patches.parentOf[side / 2]].instance;
        if (scene.instances[instance].lightSet != lightSet) split.emitted[side] = glm::vec3(0.0f);
    }
    const MeanLight mean = meanLight(scene, patches, split.emitted, lightSet);
    double limit = kBundledEmission * mean.mostExitance();
    if (std::any_of(split.emitted.begin(), split.emitted.end(), [&](const glm::vec3& emission) {
            return brightest(emission) > 0 && brightest(emission) <= limit;
        }))
        limit = kBundledEmission * mean.exitance(metShare(patches, visibility, split.emitted,
                                                          mean.emitted * patches.totalArea, seed));
    for (uint32_t side = 0; side < sides; ++side) {
        if (!patches.parentAt(side).exchanges) continue;
        if (brightest(split.emitted[side]) > limit) {
            split.isSource[side] = true;
            split.gathered[side] = patches.opacityOf(side / 2) * split.emitted[side];
        } else {
            split.bundled[side] = split.emitted[side];
        }
    }
    return split;
}

}  // namespace raybundle
