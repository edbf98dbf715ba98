// SPDX-License-Identifier: GPL-3.0-or-later
//
// The cone of a spot: which share of the lamp's intensity goes in which direction, and directions
// that are drawn by it. Source: Blender's spot (a smoothstep over the cosine to the axis).
#pragma once

#include <glm/glm.hpp>

#include "scene/scene.h"

namespace raybundle {

class SpotCone {
  public:
    // A light with a cone.
    explicit SpotCone(const Light& light);

    // Share of the intensity in a direction away from the lamp (unit vector).
    float share(const glm::vec3& direction) const;

    // Mean of it over all directions.
    float meanOverSphere() const { return mean; }

    // A direction with about the density of the share; weight: what is missing in it, 1 in the
    // mean. Exactly 1 unless the light's scale deforms the cone. uv uniform in [0, 1)^2.
    struct Ray {
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
    const double edge;  // cosine at the rim
    const double soft;  // range of the cosine over which the light fades
    const bool dims;
    double total = 0;        // integral of the share over the cosine
    double meanStretch = 1;  // of directions drawn by the share
    bool isDeformed = false;
    float mean = 0;
};

}  // namespace raybundle
