// SPDX-License-Identifier: GPL-3.0-or-later
//
// The spread of an area light, as a softbox with a grid before it has it: which share of the
// radiance goes in which direction, and directions that are drawn by it. The power of the light
// does not depend on the spread.
//
// Source: Blender's area light, factor max(tan h - tan t, 0) / (tan h - h) at the angle t to the
// normal, h being half the spread. Multiplied by cot h here, so that 180 degrees are no exception.
#pragma once

#include <glm/glm.hpp>

namespace raybundle {

class AreaSpread {
  public:
    // spread: full opening, radians in [0, pi].
    explicit AreaSpread(double spread);

    // Whether the light is spread over the whole half space: the factor is 1.
    bool isWhole() const { return cotangent <= 0; }

    // The factor of the radiance at a cosine to the normal; its mean over the projected half space
    // is 1.
    float factor(float cosine) const;

    // Of half the spread; infinite if it is whole.
    float tangent() const { return float(1 / cotangent); }

    // A direction with the density of the factor times the cosine. uv uniform in [0, 1)^2.
    glm::vec3 emit(const glm::vec3& normal, glm::vec2 uv) const;

  private:
    double integral(double angle) const;

    double half;       // of the spread, radians
    double cotangent;  // of it; 0 if it is whole
    double total = 1;  // 1 - half * cotangent
};

}  // namespace raybundle
