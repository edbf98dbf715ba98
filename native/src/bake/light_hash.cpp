// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/light_hash.h"

#include "bake/hasher.h"

namespace raybundle {

uint64_t lightHash(const Scene& scene, const DirectLight& light, int32_t lightSet,
                   const Settings& settings) {
    Hasher hasher;
    for (const Light& l : scene.lights)
        if (l.lightSet == lightSet)
            hasher.add(l.kind, l.strength, l.position, l.radius, l.pointShape, l.direction, l.angle,
                       l.axisU, l.axisV, l.areaShape, l.spread, l.castsShadows, l.hasCone,
                       l.worldToCone, l.coneAngle, l.coneBlend, l.coneDims);
    // What is a source and what is not depends on reflectances too.
    hasher.add(light.emission());
    hasher.add(light.bundledEmission());
    if (scene.worldLightSet == lightSet) {
        hasher.add(scene.worldRadiance, scene.worldImage.width, scene.worldImage.height);
        hasher.add(scene.worldImage.pixels);
    }
    hasher.add(settings.targetError, settings.seed, settings.skipFacing, settings.skipLit,
               settings.skipWeak, settings.skipInside);
    return hasher.value();
}

}  // namespace raybundle
