// SPDX-License-Identifier: GPL-3.0-or-later
//
// The cone of a spot lamp: the share of the lamp's intensity that leaves in each direction, and the
// sampling of directions by this share.
//
// Source: Blender's spot lamp, whose share is a smoothstep over the cosine of the angle to the
// axis.
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "scene/scene.h"

namespace raybundle {

// The angular distribution of a spot lamp's intensity.
class SpotCone {
  public:
    // `light` must have a cone (Light::hasCone).
    explicit SpotCone(const Light& light);

    // Returns the share of the lamp's intensity, 0 to 1, in a direction (unit vector) that points
    // away from the lamp.
    float share(const glm::vec3& direction) const;

    // Returns the mean of share() over all directions of the sphere.
    float meanOverSphere() const { return mean; }

    // Returns whether the share may rise from 0 to its full value within a small part of a patch
    // with these corners, relative to the lamp.
    bool isSteepBetween(const std::array<glm::dvec3, 4>& corners) const;

    // A direction sampled about in proportion to share(). The weight is share() divided by the
    // density of the sample, relative to the mean of this ratio, so that the mean weight is 1. All
    // weights are exactly 1 unless the lamp's scale deforms the cone.
    struct Ray {
        // Samples a direction. `uv` is uniform in [0, 1)^2.
        glm::vec3 direction;
        float weight;
    };
    Ray emit(glm::vec2 uv) const;

  private:
    double shareAt(double cosine) const;
    double integral(double cosine) const;
    glm::dvec3 local(glm::vec2 uv) const;
    double stretch(const glm::dvec3& local) const;

    const glm::dmat3 toLocal, fromLocal;
    const double edge;  // cosine of the angle between the axis and the rim
    const double soft;  // range of the cosine over which the light fades out
    const bool dims;
    double total = 0;        // integral of the share over the cosine
    double meanStretch = 1;  // mean of stretch() over directions sampled by the share
    bool isDeformed = false;
    float mean = 0;
};

}  // namespace raybundle
