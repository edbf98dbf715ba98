// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/shown_light.h"

#include <algorithm>

#include "patches/reflectance.h"
#include "patches/side.h"

namespace raybundle {
namespace {

std::vector<bool> resultSides(const Scene& scene, const Patches& patches) {
    bool anyBaked = false;
    for (const Instance& instance : scene.instances) anyBaked |= instance.role == RB_ROLE_BAKE;
    std::vector<bool> isResult(patches.sideCount());
    for (size_t side = 0; side < isResult.size(); ++side) {
        const Parent& parent = patches.parentAt(uint32_t(side));
        const Instance& instance = scene.instances[parent.instance];
        isResult[side] = !anyBaked || (instance.hasResultOnFace(size_t(parent.face)) &&
                                       isBack(side) == size_t(instance.side));
    }
    return isResult;
}

}  // namespace

bool gathersSparseResults(const Settings& settings) {
    return settings.reconstruction != Reconstruction::AREA_AVERAGE && settings.finalGather &&
           settings.countsLines() && settings.gathersFirstShot();
}

bool gathersDenseSurfaces(const Settings& settings) {
    return gathersSparseResults(settings) && settings.skipClusters &&
           settings.reconstruction == Reconstruction::LEAST_SQUARES;
}

std::vector<bool> shownSides(const Scene& scene, const Patches& patches, const Settings& settings) {
    const std::vector<bool> results = resultSides(scene, patches);
    std::vector<bool> shown = results;
    auto isOwnAlone = [&](size_t side) { return patches.translucenceOf(side) == glm::vec3(0.0f); };
    const bool sparse = gathersSparseResults(settings), dense = gathersDenseSurfaces(settings);
    for (size_t side = 0; (sparse || dense) && side < shown.size(); ++side) {
        const bool isSparse =
            sparse && scene.instances[patches.parentAt(uint32_t(side)).instance].hasSparseResults;
        const bool isDense = dense && patches.isDense[patchOf(side)];
        if (isOwnAlone(side) && (isSparse || isDense)) shown[side] = false;
    }
    for (size_t side = 0; !patches.translucence.empty() && side < shown.size(); ++side)
        if (results[opposite(side)] && !isOwnAlone(opposite(side))) shown[side] = true;
    return shown;
}

ShownLight::ShownLight(const Scene& scene, const Patches& patches, const Settings& settings)
    : scene(scene),
      patches(patches),
      results(resultSides(scene, patches)),
      shown(shownSides(scene, patches, settings)),
      colors(diffuseReflectances(scene, patches)) {
    if (std::any_of(scene.materials.begin(), scene.materials.end(),
                    [](const Material& material) { return material.showsByAngle(); }))
        for (size_t side = 0; side < shown.size(); ++side)
            fromEverywhere.push_back(materialOf(side).sides[isBack(side)].shown(kEverywhere));
    if (isOwnAlone()) return;
    othersShare.resize(colors.size());
    for (size_t side = 0; side < colors.size(); ++side) {
        const glm::vec3 through =
            patches.opacityOf(uint32_t(patchOf(side))) * patches.translucenceOf(side);
        colors[side] += through;
        for (int c = 0; c < 3; ++c)
            if (through[c] > 0) othersShare[side][c] = through[c] / colors[side][c];
    }
}

const Material& ShownLight::materialOf(size_t side) const {
    const Parent& parent = patches.parentAt(uint32_t(side));
    return scene.materialOf(parent.instance, size_t(parent.face));
}

std::vector<float> ShownLight::resultArea() const {
    std::vector<float> area = patches.sideAreas();
    for (size_t side = 0; side < area.size(); ++side)
        if (!isResult(side)) area[side] = 0;
    return area;
}

bool ShownLight::isGatheredAtNodes(size_t side) const {
    return isGathered(side) && patches.isDense[patchOf(side)] &&
           !scene.instances[patches.parentAt(uint32_t(side)).instance].hasSparseResults;
}

std::vector<bool> ShownLight::instancesAllGathered() const {
    std::vector<bool> any(scene.instances.size(), false), all(any.size(), true);
    for (size_t side = 0; side < results.size(); ++side) {
        if (!results[side]) continue;
        const uint32_t instance = patches.parentAt(uint32_t(side)).instance;
        any[instance] = true;
        if (shown[side]) all[instance] = false;
    }
    for (size_t i = 0; i < all.size(); ++i) all[i] = all[i] && any[i];
    return all;
}

glm::vec3 ShownLight::byAngle(size_t side, const glm::vec4& angles) const {
    if (fromEverywhere.empty()) return glm::vec3(1.0f);
    return materialOf(side).sides[isBack(side)].shown(angles);
}

glm::vec3 ShownLight::of(size_t side, const glm::vec3& own, const glm::vec3& others,
                         const std::vector<float>& exposed) const {
    if (isOwnAlone()) return own;
    return glm::mix(own, exposed[opposite(side)] * others, othersShare[side]);
}

Irradiance ShownLight::of(Irradiance light, const std::vector<float>& exposed) const {
    if (!isOwnAlone()) mixSides(light, light, exposed);
    return light;
}

std::vector<glm::vec3> ShownLight::of(std::vector<glm::vec3> light,
                                      const std::vector<float>& exposed) const {
    if (!isOwnAlone()) mixSides(light, light, exposed);
    return light;
}

Irradiance ShownLight::of(const SetLight& light, const std::vector<float>& exposed) const {
    Irradiance own = light.irradiance;
    for (size_t side = 0; side < fromEverywhere.size(); ++side) {
        const glm::vec3 factor = fromEverywhere[side], fromSources = ofSources(side, light.shot);
        own.direct[side] =
            fromSources * own.ofSources[side] + factor * (own.direct[side] - own.ofSources[side]);
        own.ofSources[side] *= fromSources;
        own.indirect[side] *= factor;
    }
    if (!isOwnAlone()) mixSides(own, light.irradiance, exposed);
    return own;
}

Irradiance ShownLight::of(const SetLights& lights, const std::vector<float>& exposed) const {
    Irradiance sum = of(lights.front(), exposed);
    for (size_t k = 1; k < lights.size(); ++k) sum.add(of(lights[k], exposed));
    return sum;
}

void ShownLight::mixSides(Irradiance& own, const Irradiance& arriving,
                          const std::vector<float>& exposed) const {
    mixSides(own.direct, arriving.direct, exposed);
    mixSides(own.ofSources, arriving.ofSources, exposed);
    mixSides(own.indirect, arriving.indirect, exposed);
}

void ShownLight::mixSides(std::vector<glm::vec3>& own, std::vector<glm::vec3> arriving,
                          const std::vector<float>& exposed) const {
    for (size_t side = 0; side < own.size(); ++side)
        own[side] = of(side, own[side], arriving[opposite(side)], exposed);
}

}  // namespace raybundle
