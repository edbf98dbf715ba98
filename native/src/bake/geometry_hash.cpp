// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/geometry_hash.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "patches/reflectance.h"

namespace raybundle {
namespace {

// 64-bit words mixed one after the other, after MurmurHash2 (Appleby, public domain).
class Hasher {
  public:
    void add(const void* data, size_t bytes) {
        const unsigned char* at = static_cast<const unsigned char*>(data);
        mix(bytes);
        for (; bytes >= 8; bytes -= 8, at += 8) {
            uint64_t word;
            std::memcpy(&word, at, 8);
            mix(word);
        }
        uint64_t rest = 0;
        std::memcpy(&rest, at, bytes);
        mix(rest);
    }
    template <class T>
    void add(const std::vector<T>& values) {
        add(values.data(), values.size() * sizeof(T));
    }
    uint64_t value() const { return state; }

  private:
    void mix(uint64_t word) {
        constexpr uint64_t kMultiplier = 0xc6a4a7935bd1e995ull;
        word *= kMultiplier;
        word ^= word >> 47;
        word *= kMultiplier;
        state = (state ^ word) * kMultiplier;
    }

    uint64_t state = 0x9e3779b97f4a7c15ull;
};

// What decides which lines pass through surfaces; nothing where all are opaque.
void addOpacity(const Scene& scene, Hasher& hasher) {
    if (std::all_of(scene.materials.begin(), scene.materials.end(),
                    [](const Material& material) { return material.isOpaque(); }))
        return;
    for (const Material& material : scene.materials) {
        const bool isEmpty = isEmptySpace(material);
        hasher.add(&material.opacity, sizeof(float));
        hasher.add(&isEmpty, sizeof(bool));
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
        hasher.add(&instance.mesh, sizeof(instance.mesh));
        hasher.add(&instance.transform, sizeof(instance.transform));
        const uint8_t visibility = uint8_t(instance.stopsDirect | instance.exchanges << 1);
        hasher.add(&visibility, sizeof(visibility));
    }
    hasher.add(&settings.patchSize, sizeof(float));
    for (int value : {settings.maxPatches, settings.refine, settings.contacts,
                      settings.linesPerBundle, settings.seed, settings.planeCount,
                      settings.planeCoherence, int(settings.hasLineWindows())})
        hasher.add(&value, sizeof(value));
    for (const std::string* name : {&settings.solver, &settings.directions, &settings.projector,
                                    &settings.smallPatches, &settings.planePlacement})
        hasher.add(name->data(), name->size());
    return hasher.value();
}

}  // namespace raybundle
