// SPDX-License-Identifier: GPL-3.0-or-later
//
// What outputs show of the light on patches, and on which: that of the front, and where a patch is
// translucent the mean of both sides, weighted by what the side sends of each; times its colour it
// is what the side sends without gloss. Of materials that reflect light by its angle it is what
// they send straight up: light of the sources by its angles, all else as if it came from
// everywhere.
//
// Source: measured against Cycles' Diffuse bake, which sees surfaces from straight above and counts
// Translucent BSDFs among the diffuse.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "patches/patches.h"
#include "scene/scene.h"
#include "transport/set_light.h"

namespace raybundle {

// Per side: whether its light shows, on itself or on the other side of its patch. gathersAtCorners:
// whether sparse results are gathered (corner_gather.h).
std::vector<bool> shownSides(const Scene& scene, const Patches& patches, bool gathersAtCorners);

class ShownLight {
  public:
    // gathersAtCorners: as in shownSides. Both others must outlive the object.
    ShownLight(const Scene& scene, const Patches& patches, bool gathersAtCorners);

    // Per side: the diffuse reflectance and the translucence of the whole patch, what lets light
    // straight through included.
    const std::vector<glm::vec3>& color() const { return colors; }

    // Whether a side has a result; all have where none is asked for.
    bool isResult(size_t side) const { return results[side]; }
    // Per side, m^2: the whole area of those that have a result, else 0.
    std::vector<float> resultArea() const;
    // See shownSides.
    const std::vector<bool>& sides() const { return shown; }
    // Whether a side has a result that is not its own light: what its corners gather.
    bool isGathered(size_t side) const { return results[side] && !shown[side]; }

    // Whether every side shows its own light alone.
    bool isOwnAlone() const { return patches.translucence.empty(); }
    bool isOwnAlone(size_t side) const { return patches.translucenceOf(side) == glm::vec3(0.0f); }

    // What a side shows of light that reaches it, by the means of its angleTerms.
    glm::vec3 byAngle(size_t side, const glm::vec4& angles) const;
    // The same of the light of the sources, by a first shot.
    glm::vec3 ofSources(size_t side, const FirstShot& shot) const {
        return byAngle(side, shot.angles.empty() ? kEverywhere : shot.angles[side]);
    }
    // The same of light from everywhere, per side; empty where all show all of it.
    const std::vector<glm::vec3>& everywhere() const { return fromEverywhere; }

    // Of light that arrives at a side, of which it shows all, and at the other side of its patch,
    // both W/m^2; exposed: per side, the share of it that nothing covers.
    glm::vec3 of(size_t side, const glm::vec3& own, const glm::vec3& others,
                 const std::vector<float>& exposed) const;
    // The same on all sides.
    Irradiance of(Irradiance light, const std::vector<float>& exposed) const;
    // What is shown, by angle too.
    Irradiance of(const SetLight& light, const std::vector<float>& exposed) const;
    Irradiance of(const SetLights& lights, const std::vector<float>& exposed) const;

  private:
    const Material& materialOf(size_t side) const;
    // own: what each side shows of the light that reaches it; arriving: the light itself.
    void mixSides(Irradiance& own, const Irradiance& arriving,
                  const std::vector<float>& exposed) const;

    const Scene& scene;
    const Patches& patches;
    std::vector<bool> results, shown;
    std::vector<glm::vec3> colors;
    std::vector<glm::vec3> othersShare;  // per side, of what it sends; empty where it is 0
    std::vector<glm::vec3> fromEverywhere;
};

}  // namespace raybundle
