// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/local_rays.h"

#include <algorithm>
#include <cassert>
#include <glm/gtc/constants.hpp>

#include "bundles/directions.h"
#include "patches/side.h"
#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

// Largest number of points that are tried on a partly covered patch to find an uncovered one. If
// all are covered, the patch counts as wholly covered, and the ray leaves from the last of the
// points.
constexpr int kMostPoints = 64;
constexpr uint32_t kNoSide = UINT32_MAX;

glm::vec2 uniform2(std::mt19937_64& random) {
    const float u = float(uniform(random));
    return {u, float(uniform(random))};
}

}  // namespace

LocalRays::LocalRays(const TransportInput& input) : surfaces(input), visibility(input.visibility) {
    assert(surfaces.exposed.size() == surfaces.patches.sideCount() &&
           "bake knows what is covered before it traces");
    const HandOver first = handOver(input, input.shot);
    for (uint32_t side = 0; side < surfaces.patches.sideCount(); ++side) {
        addSource(side, RayLight::EMITTED, area(side) * input.shot.emission[side]);
        addSource(side, RayLight::REFLECTED, area(side) * first.unshot[side]);
    }
    // The radiance L enters through the scene's sphere: exitance pi L over the area 4 pi R^2.
    const float across = 2 * glm::pi<float>() * surfaces.patches.radius;
    addSource(kNoSide, RayLight::WORLD, across * across * input.worldRadiance);
}

void LocalRays::addSource(uint32_t side, RayLight light, const glm::vec3& power) {
    const double sum = double(power.x) + power.y + power.z;
    if (!(sum > 0)) return;
    sources.push_back({side, light, power / float(sum)});
    cumulative.push_back(this->power() + sum);
}

SourceRay LocalRays::fromSources(std::mt19937_64& random, RayLog& log) const {
    const auto chosen =
        std::upper_bound(cumulative.begin(), cumulative.end() - 1, uniform(random) * power());
    const Source& source = sources[size_t(chosen - cumulative.begin())];
    return {
        source.light == RayLight::WORLD ? fromWorld(random) : fromSide(source.side, random, log),
        source.light, float(power()) * source.colour};
}

std::optional<uint32_t> LocalRays::fromWorld(std::mt19937_64& random) const {
    // A uniformly random line through the sphere: any direction, any point of the disk across it.
    const glm::vec3 direction = uniformDirection(uniform2(random));
    const auto [x, y] = frame(direction);
    const glm::vec2 across = onDisk(uniform2(random));
    return visibility.firstHit(
        surfaces.patches.radius * (across.x * x + across.y * y - 1.01f * direction), direction);
}

bool LocalRays::isCovered(uint32_t side, const glm::vec3& point) const {
    return visibility.isBlocked(side, point, surfaces.patches.normal(side),
                                surfaces.patches.islandAt(side).touchDistance);
}

std::optional<uint32_t> LocalRays::fromSide(uint32_t side, std::mt19937_64& random,
                                            RayLog& log) const {
    glm::vec3 point = surfaces.patches.point(patchOf(side), uniform2(random));
    if (surfaces.exposed[side] < 1)
        for (int k = 1; k < kMostPoints && isCovered(side, point); ++k)
            point = surfaces.patches.point(patchOf(side), uniform2(random));
    const auto hit = visibility.firstHit(
        side, point, cosineDirection(surfaces.patches.normal(side), uniform2(random)));
    log.rays.push_back(side);
    if (!hit) log.escapes.push_back(side);
    return hit;
}

}  // namespace raybundle
