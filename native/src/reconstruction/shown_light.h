// SPDX-License-Identifier: GPL-3.0-or-later
//
// Shown light: the part of the light on patches that outputs show, and the sides whose light they
// show. A side shows the irradiance that arrives at it. A side of a translucent patch shows the
// mean of the irradiances of both sides, weighted by the share of what the side sends that comes
// from each. Multiplied by the shown reflectance, shown light is the exitance of the side without
// gloss. A material whose reflection depends on the angle of the light shows the light that it
// sends along the normal. The light of the sources then counts by its actual angles, and all other
// light as if it arrived equally from everywhere.
//
// Source: measured against Cycles' Diffuse bake, which sees surfaces from straight above and counts
// Translucent BSDFs among the diffuse.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "job/settings.h"
#include "patches/patches.h"
#include "scene/scene.h"
#include "transport/set_light.h"

namespace raybundle {

// Returns whether, with these settings, corners gather sparse results (Instance::hasSparseResults)
// instead of taking the light of patches (reconstruction/corner_gather.h).
bool gathersSparseResults(const Settings& settings);
// Returns whether, with these settings, the nodes of dense surfaces (Patches::isDense) gather
// (reconstruction/node_gather.h).
bool gathersDenseSurfaces(const Settings& settings);

// Returns for each patch side whether its light is shown, on the side itself or through a
// translucent patch on the other side. Opaque sides are not shown if the corners or nodes there
// gather their light.
std::vector<bool> shownSides(const Scene& scene, const Patches& patches, const Settings& settings);

// The shown light of all patch sides. If no instance is baked, all sides count as results.
class ShownLight {
  public:
    // Prepares the sides and their shown reflectances. `scene` and `patches` must outlive the
    // object.
    ShownLight(const Scene& scene, const Patches& patches, const Settings& settings);

    // Returns the shown reflectance per side: the sum of the diffuse reflectance and the
    // translucence, relative to the whole patch, including the share of the patch that lets light
    // straight through.
    const std::vector<glm::vec3>& color() const { return colors; }

    // Returns whether a side has a result. All sides have one if no instance is baked.
    bool isResult(size_t side) const { return results[side]; }
    // Returns per side the whole area of its patch if it has a result, otherwise 0, m^2.
    std::vector<float> resultArea() const;
    // Returns the result of shownSides().
    const std::vector<bool>& sides() const { return shown; }
    // Returns whether a side has a result that is not the light of the side itself, but the light
    // that its corners gather.
    bool isGathered(size_t side) const { return results[side] && !shown[side]; }

    // Returns whether isGathered() holds because the side lies on a dense surface, whose nodes
    // gather (reconstruction/node_gather.h).
    bool isGatheredAtNodes(size_t side) const;
    // Returns per instance whether all of its results are gathered, and it has any.
    std::vector<bool> instancesAllGathered() const;

    // Return whether every side, or the given side, shows only light that arrives at itself.
    bool isOwnAlone() const { return patches.translucence.empty(); }
    bool isOwnAlone(size_t side) const { return patches.translucenceOf(side) == glm::vec3(0.0f); }

    // Returns the ratio of the light that a side shows to the light that arrives at it, per
    // channel, 0 to 16. `angles` holds the means of the angleTerms() of the light.
    glm::vec3 byAngle(size_t side, const glm::vec4& angles) const;
    // Returns the result of byAngle() for the light of the sources of a first shot.
    glm::vec3 ofSources(size_t side, const FirstShot& shot) const {
        return byAngle(side, shot.angles.empty() ? kEverywhere : shot.angles[side]);
    }
    // Returns per side the result of byAngle() for light that arrives equally from everywhere.
    // Empty if every side shows all of its light.
    const std::vector<glm::vec3>& everywhere() const { return fromEverywhere; }

    // Returns the irradiance that a side shows, W/m^2. `own` arrives at the side, which shows all
    // of it, and `others` at the other side of the patch, both W/m^2. `exposed` is per side, the
    // share that nothing covers, 0 to 1.
    glm::vec3 of(size_t side, const glm::vec3& own, const glm::vec3& others,
                 const std::vector<float>& exposed) const;
    // Return the irradiance that all sides show, W/m^2, where `light` is the irradiance that
    // arrives. All light counts fully, whatever its angle.
    Irradiance of(Irradiance light, const std::vector<float>& exposed) const;
    std::vector<glm::vec3> of(std::vector<glm::vec3> light,
                              const std::vector<float>& exposed) const;
    // Return the irradiance that all sides show of the light of one set, or of several. The angle
    // of the light is taken into account.
    Irradiance of(const SetLight& light, const std::vector<float>& exposed) const;
    Irradiance of(const SetLights& lights, const std::vector<float>& exposed) const;

  private:
    const Material& materialOf(size_t side) const;
    // Mix the light of the two sides of each patch. `own` holds, per side, what the side shows of
    // the light that reaches it, and receives the result. `arriving` is the light that reaches the
    // sides.
    void mixSides(Irradiance& own, const Irradiance& arriving,
                  const std::vector<float>& exposed) const;
    void mixSides(std::vector<glm::vec3>& own, std::vector<glm::vec3> arriving,
                  const std::vector<float>& exposed) const;

    const Scene& scene;
    const Patches& patches;
    // Per side.
    std::vector<bool> results, shown;
    std::vector<glm::vec3> colors;
    // Per side and channel: the share of what the side sends that has arrived at the other side.
    // Empty if no patch is translucent.
    std::vector<glm::vec3> othersShare;
    // Per side, see everywhere().
    std::vector<glm::vec3> fromEverywhere;
};

}  // namespace raybundle
