// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/light_hash.h"

#include "sampling/hasher.h"

namespace raybundle {

uint64_t shotHash(const Scene& scene, const Settings& settings, const std::vector<bool>& isShown,
                  bool hasDirections) {
    Hasher hasher;
    for (const Material& material : scene.materials)
        for (const MaterialSide& side : material.sides)
            hasher.add(side.shownFromAbove, side.shownByAngle);
    hasher.add(hasDirections, settings.skipClusters);
    // If directions are kept, a cluster consists of one material.
    for (const Mesh& mesh : scene.meshes)
        if (hasDirections) hasher.add(mesh.faceMaterials);
    hasher.add(std::vector<uint8_t>(isShown.begin(), isShown.end()));
    for (const Instance& instance : scene.instances) hasher.add(instance.noiseFactor);
    hasher.add(settings.targetError, settings.seed, settings.skipFacing, settings.skipLit,
               settings.skipWeak, settings.skipInside);
    return hasher.value();
}

uint64_t lightHash(const DirectLight& light, uint64_t aims) {
    Hasher hasher;
    for (const auto& source : light.lightSources()) hasher.add(source->shape, source->magnitude);
    // The split of the emission into sources and the rest depends on the reflectances too.
    hasher.add(light.emission());
    hasher.add(light.bundledEmission());
    hasher.add(aims);
    return hasher.value();
}

}  // namespace raybundle
