// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/shown_light.h"

#include "patches/reflectance.h"

namespace raybundle {
namespace {

std::vector<bool> resultSides(const Scene& scene, const Patches& patches) {
    bool anyBaked = false;
    for (const Instance& instance : scene.instances) anyBaked |= instance.role == RB_ROLE_BAKE;
    std::vector<bool> isResult(patches.sideCount());
    for (size_t side = 0; side < isResult.size(); ++side) {
        const Instance& instance = scene.instances[patches.parentAt(uint32_t(side)).instance];
        isResult[side] =
            !anyBaked || (instance.role == RB_ROLE_BAKE && side % 2 == size_t(instance.side));
    }
    return isResult;
}

}  // namespace

ShownLight::ShownLight(const Scene& scene, const Patches& patches)
    : patches(patches),
      results(resultSides(scene, patches)),
      shown(results),
      colors(diffuseReflectances(scene, patches)) {
    if (isOwnAlone()) return;
    for (size_t side = 0; side < shown.size(); ++side)
        if (results[side ^ 1] && !isOwnAlone(side ^ 1)) shown[side] = true;
    othersShare.resize(colors.size());
    for (size_t side = 0; side < colors.size(); ++side) {
        const glm::vec3 through =
            patches.opacityOf(uint32_t(side / 2)) * patches.translucenceOf(side);
        colors[side] += through;
        for (int c = 0; c < 3; ++c)
            if (through[c] > 0) othersShare[side][c] = through[c] / colors[side][c];
    }
}

glm::vec3 ShownLight::of(size_t side, const glm::vec3& own, const glm::vec3& others,
                         const std::vector<float>& exposed) const {
    if (isOwnAlone()) return own;
    return glm::mix(own, exposed[side ^ 1] * others, othersShare[side]);
}

Irradiance ShownLight::of(Irradiance light, const std::vector<float>& exposed) const {
    if (isOwnAlone()) return light;
    for (std::vector<glm::vec3>* field : {&light.direct, &light.gathered, &light.indirect})
        for (size_t front = 0; front < field->size(); front += 2) {
            const glm::vec3 lit[2] = {(*field)[front], (*field)[front + 1]};
            for (size_t back = 0; back < 2; ++back)
                (*field)[front + back] = of(front + back, lit[back], lit[1 - back], exposed);
        }
    return light;
}

}  // namespace raybundle
