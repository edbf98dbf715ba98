// SPDX-License-Identifier: GPL-3.0-or-later
//
// How much of the light from one direction a side that is not Lambert's reflects as gloss, by its
// other lobes, and diffusely (scene/material.h).
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>

#include "patches/patches.h"
#include "patches/side.h"
#include "scene/channels.h"
#include "surfaces/lobe.h"

namespace raybundle {

// The reflectance of a patch side, divided into gloss, lobes and the diffuse rest. All values are
// relative to the opaque share of the patch, per channel.
class SideReflectance {
  public:
    // `patches` must have scattering. Keeps references to it.
    SideReflectance(const Patches& patches, uint32_t side)
        : surface(patches.scattering[2 * patches.parentAt(side).scattering + isBack(side)]),
          all(patches.reflectance[side]),
          byAngle(patches.byAngle.empty() ? nullptr : &patches.byAngle[side]),
          // Factor from values relative to the whole patch to values relative to its opaque share.
          whole(1 / std::max(patches.opacityOf(patchOf(side)), 1e-6f)),
          mirrored(glm::clamp(surface.glossScale * all + whole * surface.glossOffset,
                              glm::vec3(0.0f), all)) {
        for (const LobeReflectance& lobe : surface.lobes)
            inLobes += glm::max(whole * lobe.reflectance, 0.0f);
        const glm::vec3 room = all - mirrored;
        fits = glm::min(room / glm::max(inLobes, 1e-6f), 1.0f);
        inLobes = glm::min(inLobes, room);
    }

    const Scattering& scattering() const { return surface; }

    // Return the reflectance of each part for light from all directions.
    const glm::vec3& mirroredMean() const { return mirrored; }
    glm::vec3 lobeMean(const LobeReflectance& lobe) const {
        return fits * glm::max(whole * lobe.reflectance, 0.0f);
    }
    glm::vec3 diffuseMean() const { return all - mirrored - inLobes; }
    // Return the reflectance of each part for light from one angle. `terms` holds its angleTerms()
    // (scene/angles.h).
    glm::vec3 mirroredAt(const glm::vec4& terms) const {
        return glm::clamp(mirrored + whole * sumOfTerms(surface.glossByAngle, terms - kEverywhere),
                          0.0f, 1.0f);
    }
    glm::vec3 lobeAt(const LobeReflectance& lobe, const glm::vec4& terms) const {
        const glm::vec3 byAngle = whole * sumOfTerms(lobe.byAngle, terms - kEverywhere);
        return glm::clamp(lobeMean(lobe) + fits * byAngle, 0.0f, 1.0f);
    }
    glm::vec3 diffuseAt(const glm::vec4& terms) const {
        glm::vec3 sum = byAngle ? all + sumOfTerms(*byAngle, terms - kEverywhere) : all;
        sum -= mirroredAt(terms);
        for (const LobeReflectance& lobe : surface.lobes) sum -= lobeAt(lobe, terms);
        return glm::clamp(sum, 0.0f, 1.0f);
    }
    // Returns the f0 of the gloss alone (Lobe::gloss), per channel, without the other parts.
    glm::vec3 f0() const {
        const glm::vec3 above = mirroredAt(glm::vec4(0.0f));
        glm::vec3 result(1.0f);
        for (int c = 0; c < 3; ++c)
            if (mirrored[c] > 0)
                result[c] = Lobe::f0Of(above[c] / mirrored[c], surface.glossMasking,
                                       surface.glossRoughness);
        return result;
    }

  private:
    const Scattering& surface;
    const glm::vec3& all;
    const AngleFactors* byAngle;
    float whole;
    glm::vec3 mirrored, inLobes{0.0f};
    // Factor that reduces the lobes to the reflectance that gloss leaves.
    glm::vec3 fits;
};

}  // namespace raybundle
