// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/geometry_hash.h"

#include <algorithm>
#include <vector>

#include "patches/reflectance.h"
#include "sampling/hasher.h"

namespace raybundle {
namespace {

// Adds what determines which lines pass through surfaces and where light enters them. Adds nothing
// if all materials are opaque.
void addOpacity(const Scene& scene, Hasher& hasher) {
    if (std::all_of(scene.materials.begin(), scene.materials.end(), [](const Material& material) {
            return material.isOpaque() && !material.isTranslucent();
        }))
        return;
    for (const Material& material : scene.materials) {
        const bool isEmpty = isEmptySpace(material);
        hasher.add(material.opacity, isEmpty, material.isTranslucent());
        if (material.opacityImage >= 0)
            hasher.add(scene.images[size_t(material.opacityImage)].pixels);
    }
    for (const Mesh& mesh : scene.meshes) {
        hasher.add(mesh.faceMaterials);
        hasher.add(mesh.uvs);
    }
}

}  // namespace

uint64_t geometryHash(const Scene& scene, const Settings& settings) {
    Hasher hasher;
    for (const Mesh& mesh : scene.meshes) {
        hasher.add(mesh.vertices);
        hasher.add(mesh.cornerVertices);
        hasher.add(mesh.faceOffsets);
    }
    addOpacity(scene, hasher);
    for (const Instance& instance : scene.instances) {
        hasher.add(instance.mesh, instance.transform, instance.stopsDirect, instance.exchanges,
                   instance.patchFactor, instance.isAdapted);
    }
    hasher.add(settings.patchSize, settings.maxPatches, settings.refine, settings.contacts,
               settings.linesPerBundle, settings.seed, settings.planeCount, settings.planeCoherence,
               settings.hasLineWindows(), settings.solver, settings.directions, settings.projector,
               settings.smallPatches, settings.planePlacement);
    return hasher.value();
}

uint64_t likenessHash(const Scene& scene) {
    Hasher hasher;
    for (const Mesh& mesh : scene.meshes) hasher.add(mesh.faceMaterials);
    for (const Material& material : scene.materials)
        hasher.add(material.isOpaque(), material.emits());
    for (const Instance& instance : scene.instances) {
        hasher.add(instance.role, instance.side, instance.lightSet);
        hasher.add(instance.resultVertices);
    }
    return hasher.value();
}

}  // namespace raybundle
