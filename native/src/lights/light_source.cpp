// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/light_source.h"

#include <utility>

#include "lights/emissive_meshes.h"
#include "lights/lamps.h"
#include "lights/receiver_place.h"
#include "lights/world_source.h"
#include "sampling/hasher.h"

namespace raybundle {
namespace {

std::unique_ptr<LightSource> lampSource(const Light& light, const glm::dvec3& centre) {
    switch (light.kind) {
        case Light::Kind::POINT:
            return pointSource(light, centre);
        case Light::Kind::SUN:
            return sunSource(light, centre);
        case Light::Kind::AREA:
            return areaSource(light, centre);
    }
    return nullptr;
}

// Returns LightSource::shape of a lamp.
uint64_t shapeOf(const Light& l) {
    Hasher hasher;
    hasher.add(l.kind, l.position, l.radius, l.pointShape, l.direction, l.angle, l.axisU, l.axisV,
               l.areaShape, l.spread, l.castsShadows, l.hasCone, l.worldToCone, l.coneAngle,
               l.coneBlend, l.coneDims);
    return hasher.value();
}

}  // namespace

PatchPoint LightSource::placeOn(const ReceiverPlace& patch, glm::vec2 uv) const {
    return {patch.at(uv)};
}

LightSources lightSources(const Scene& scene, const Patches& patches,
                          const std::vector<bool>& sourceSides,
                          const std::vector<glm::vec3>& emission, int32_t lightSet) {
    LightSources sources;
    for (const Light& light : scene.lights) {
        if (light.strength == glm::dvec3(0.0) || light.lightSet != lightSet) continue;
        std::unique_ptr<LightSource> source = lampSource(light, patches.centre);
        if (!source) continue;
        source->castsShadows = light.castsShadows;
        source->name = "lamp \"" + light.name + "\"";
        source->magnitude = light.strength;
        source->shape = shapeOf(light);
        sources.push_back(std::move(source));
    }

    if (scene.worldLightSet == lightSet && scene.worldImage.meanRadiance() != glm::vec3(0.0f))
        sources.push_back(worldSource(scene.worldImage));

    for (auto& source : meshSources(scene, patches, sourceSides, emission, nullptr))
        sources.push_back(std::move(source));
    return sources;
}

}  // namespace raybundle
