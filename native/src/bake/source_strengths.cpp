// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/source_strengths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <variant>

#include "bake/geometry_hash.h"
#include "job/setting_table.h"
#include "sampling/hasher.h"

namespace raybundle {
namespace {

// Strengths of a material: two sides of three terms.
constexpr size_t kPerSide = 3, kPerMaterial = 2 * kPerSide;
// Factors that differ by less than this share are equal: strengths are stored in single precision.
constexpr double kSameFactor = 1e-5;

std::array<glm::vec3, kPerSide> termsOf(const SurfaceColor& color) {
    return {color.constant, color.imageWeight, color.cornerColorWeight};
}

void addSettings(const Settings& settings, Hasher& hasher) {
    for (const Setting& setting : kSettings)
        std::visit([&](auto member) { hasher.add(settings.*member); }, setting.member);
}

void addImage(int width, int height, const std::vector<glm::vec3>& pixels, Hasher& hasher) {
    hasher.add(width, height);
    hasher.add(pixels);
}

// Adds a colour, but none of its terms if it is the emission.
void addColor(const SurfaceColor& color, bool isEmission, Hasher& hasher) {
    hasher.add(color.image);
    if (!isEmission)
        for (const glm::vec3& term : termsOf(color)) hasher.add(term);
}

void addScattering(const Scattering& surface, Hasher& hasher) {
    hasher.add(surface.glossScale, surface.glossOffset, surface.glossByAngle, surface.glossMasking,
               surface.glossRoughness, surface.diffuseModel, surface.diffuseRoughness,
               surface.leaving);
    hasher.add(surface.lobes.size());
    for (const LobeReflectance& lobe : surface.lobes)
        hasher.add(lobe.kind, lobe.roughness, lobe.reflectance, lobe.byAngle);
}

void addMaterial(const Material& material, Hasher& hasher) {
    hasher.add(material.name);
    hasher.add(material.opacity, material.opacityImage);
    for (const MaterialSide& side : material.sides) {
        for (const SurfaceColor* color : side.colors())
            addColor(*color, color == &side.emission, hasher);
        hasher.add(side.reflectanceByAngle, side.colorScale, side.colorOffset, side.shownFromAbove,
                   side.shownByAngle);
        addScattering(side.scattering, hasher);
    }
}

// Adds what a lamp's light depends on, but not its strength.
void addLamp(const Light& lamp, Hasher& hasher) {
    hasher.add(lamp.name);
    hasher.add(lamp.kind, lamp.position, lamp.radius, lamp.pointShape, lamp.direction, lamp.angle,
               lamp.axisU, lamp.axisV, lamp.areaShape, lamp.spread, lamp.castsShadows, lamp.hasCone,
               lamp.worldToCone, lamp.coneAngle, lamp.coneBlend, lamp.coneDims, lamp.lightSet);
}

// Adds what geometryHash and likenessHash leave out of meshes and instances.
void addObjects(const Scene& scene, Hasher& hasher) {
    for (const Mesh& mesh : scene.meshes) {
        hasher.add(mesh.name);
        hasher.add(mesh.cornerNormals);
        hasher.add(mesh.sharpEdges);
        hasher.add(mesh.uvs);
        hasher.add(mesh.cornerColors);
    }
    for (const Instance& instance : scene.instances) {
        hasher.add(instance.name);
        hasher.add(instance.noiseFactor, instance.hasSparseResults);
    }
}

// The sources of a scene that are to be put apart.
class Apart {
  public:
    Apart(const Scene& scene, const std::vector<size_t>& these)
        : scene(scene),
          these(these),
          firstOfWorld(scene.lights.size() + kPerMaterial * scene.materials.size()) {}

    bool hasLamp(size_t lamp) const { return has(lamp); }
    bool hasWorld() const { return has(firstOfWorld); }
    // Returns which of the lights of an object are apart: none, all, or some of them.
    enum class Share { NONE, ALL, SOME };
    Share ofInstance(const Instance& instance) const {
        const Mesh& mesh = scene.meshes[size_t(instance.mesh)];
        std::vector<int32_t> materials = mesh.faceMaterials;
        std::sort(materials.begin(), materials.end());
        materials.erase(std::unique(materials.begin(), materials.end()), materials.end());
        bool hasAny = false, hasOthers = false;
        for (const int32_t material : materials)
            for (size_t term = 0; material >= 0 && term < kPerMaterial; ++term) {
                const MaterialSide& side = scene.materials[size_t(material)].sides[term / kPerSide];
                if (termsOf(side.emission)[term % kPerSide] == glm::vec3(0.0f)) continue;
                const bool is = has(scene.lights.size() + kPerMaterial * size_t(material) + term);
                hasAny = hasAny || is;
                hasOthers = hasOthers || !is;
            }
        return !hasAny ? Share::NONE : hasOthers ? Share::SOME : Share::ALL;
    }

  private:
    bool has(size_t number) const { return std::binary_search(these.begin(), these.end(), number); }

    const Scene& scene;
    const std::vector<size_t>& these;
    const size_t firstOfWorld;
};

}  // namespace

SourceStrengths::SourceStrengths(const Scene& scene, const Settings& settings) {
    Hasher hasher;
    hasher.add(geometryHash(scene, settings), likenessHash(scene));
    addSettings(settings, hasher);
    addObjects(scene, hasher);
    for (const Image& image : scene.images) {
        hasher.add(image.extension);
        addImage(image.width, image.height, image.pixels, hasher);
    }
    addImage(scene.worldImage.width, scene.worldImage.height, scene.worldImage.pixels, hasher);
    for (const std::string& name : scene.lightSets) hasher.add(name);
    hasher.add(scene.worldLightSet, scene.lights.size(), scene.materials.size());
    for (const Light& lamp : scene.lights) {
        addLamp(lamp, hasher);
        values.push_back(lamp.strength);
    }
    for (const Material& material : scene.materials) {
        addMaterial(material, hasher);
        for (const MaterialSide& side : material.sides)
            for (const glm::vec3& term : termsOf(side.emission)) values.emplace_back(term);
    }
    values.emplace_back(scene.worldRadiance);
    others = hasher.value();
}

std::vector<size_t> SourceStrengths::changedSince(const SourceStrengths& before) const {
    std::vector<size_t> changed;
    for (size_t k = 0; k < values.size(); ++k)
        if (values[k] != before.values[k]) changed.push_back(k);
    return changed;
}

std::optional<glm::dvec3> SourceStrengths::growthSince(const SourceStrengths& before,
                                                       const std::vector<size_t>& these) const {
    glm::dvec3 growth(1.0);
    for (int c = 0; c < 3; ++c) {
        std::optional<double> common;
        for (const size_t k : these) {
            const double was = before.values[k][c], is = values[k][c];
            if (was == 0 && is == 0) continue;
            if (was == 0) return std::nullopt;
            if (!common) common = is / was;
            if (std::abs(is / was - *common) > kSameFactor * std::abs(*common)) return std::nullopt;
        }
        growth[c] = common.value_or(1.0);
    }
    return growth;
}

std::optional<Scene> partedScene(const Scene& scene, const std::vector<size_t>& these) {
    if (!scene.lightSets.empty()) return std::nullopt;
    const Apart apart(scene, these);
    if (apart.hasWorld() && !scene.worldImage.pixels.empty()) return std::nullopt;
    Scene parted = scene;
    const int32_t own = parted.addLightSet("");
    for (size_t k = 0; k < parted.lights.size(); ++k)
        if (apart.hasLamp(k)) parted.lights[k].lightSet = own;
    for (Instance& instance : parted.instances) {
        const Apart::Share share = apart.ofInstance(instance);
        if (share == Apart::Share::SOME) return std::nullopt;
        if (share == Apart::Share::ALL) instance.lightSet = own;
    }
    if (apart.hasWorld()) parted.worldLightSet = own;
    return parted;
}

}  // namespace raybundle
