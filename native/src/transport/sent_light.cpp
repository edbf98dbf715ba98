// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/sent_light.h"

#include "job/cancellation.h"
#include "patches/side.h"
#include "surfaces/translucence.h"
#include "transport/scattered_light.h"

namespace raybundle {

SentLight::SentLight(const LitSurfaces& surfaces, const FirstShot& shot,
                     const Irradiance& irradiance, Of of)
    : irradiance(irradiance),
      exposed(surfaces.exposed),
      mean(surfaces.patches.sideCount()),
      directed(surfaces.patches, shot, of) {
    const Patches& patches = surfaces.patches;
    const bool isBeyond = of == Of::BEYOND_FIRST_SHOT && !shot.unshot.empty();
    parallelFor(size_t(0), mean.size(), [&](size_t side) {
        glm::vec3 arriving =
            irradiance.direct[side] - irradiance.ofSources[side] + irradiance.indirect[side];
        glm::vec3 sent = shotReflectance(patches, shot, side) * irradiance.ofSources[side];
        if (isBeyond) {
            const float concentrated = exposed[side] > 0 ? 1 / exposed[side] : 0;
            arriving -= concentrated * shot.indirect[side];
            sent = concentrated * shot.unshot[side];
        }
        mean[side] = sent + patches.reflectance[side] * arriving +
                     passedOn(surfaces, side, irradiance.all(opposite(side)));
    });
    for (size_t side = 0; side < irradiance.byAngle.size(); ++side)
        mean[side] += irradiance.byAngle[side];
}

glm::vec3 SentLight::towards(uint32_t side, const glm::vec3& direction) const {
    glm::vec3 sent = mean[side];
    if (directed.hasLayers()) sent += directed.layer(side, direction) * mean[side];
    if (!directed.isNone(side) && exposed[side] > 0)
        sent += directed.towards(side, direction) / exposed[side];
    if (irradiance.scattered && !irradiance.scattered->isNone(side))
        sent += irradiance.scattered->towards(side, direction);
    return sent;
}

}  // namespace raybundle
