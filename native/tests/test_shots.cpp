// SPDX-License-Identifier: GPL-3.0-or-later
#include "test_shots.h"

#include <cmath>

#include "test_scenes.h"

namespace raybundle::test {

ShotScene::ShotScene(const Scene& scene, float patchSize)
    : scene(scene), patches(subdivide(this->scene, patchSize, 10000000)), visibility(patches) {}

FirstShot ShotScene::shoot(FirstShotKind kind, int lines, int seed, float targetError,
                           double linesPerBundle, int bundles) const {
    Settings settings;
    settings.localRays = lines;
    settings.seed = seed;
    settings.targetError = targetError;
    if (bundles > 0) settings.minBundles = settings.maxBundles = bundles;
    const DirectLight light(scene, patches, visibility, uint32_t(seed));
    return firstShot(kind, {light, patches, visibility, settings, Progress(), linesPerBundle});
}

float GatheredShot::at(uint32_t instance, uint32_t side) const {
    for (const Parent& parent : patches.parents)
        if (parent.instance == instance) return light.irradiance[2 * parent.firstPatch + side].x;
    return NAN;
}

GatheredShot gatherFinely(const Scene& scene, float patchSize) {
    GatheredShot shot{subdivide(scene, patchSize, kMany), {}};
    const Visibility visibility(shot.patches);
    Settings settings;
    settings.targetError = 0.002f;
    shot.light = gather({DirectLight(scene, shot.patches, visibility, 0), shot.patches, visibility,
                         settings, Progress()});
    return shot;
}

void placeReceiver(Scene& scene, const glm::vec3& at, const glm::vec3& u, const glm::vec3& v) {
    place(scene, rectangle("receiver", at - 0.001f * (u + v), 0.002f * u, 0.002f * v),
          grey("", 0.5f));
}

Mean meanLight(const Patches& patches, const FirstShot& shot, uint32_t instance, uint32_t side) {
    double area = 0, power = 0, variance = 0;
    for (uint32_t p = 0; p < patches.count(); ++p) {
        if (patches.parents[patches.parentOf[p]].instance != instance) continue;
        const double a = double(patches.area[p]), e = a * double(shot.error[2 * p + side]);
        area += a;
        power += a * double(shot.irradiance[2 * p + side].x);
        variance += e * e;
    }
    return {power / area, std::sqrt(variance) / area};
}

glm::dvec3 arriving(const Patches& patches, const FirstShot& shot) {
    glm::dvec3 power(0.0);
    for (size_t side = 0; side < patches.sideCount(); ++side)
        power += double(patches.area[side / 2]) * glm::dvec3(shot.irradiance[side]);
    return power;
}

}  // namespace raybundle::test
