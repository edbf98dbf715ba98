// SPDX-License-Identifier: GPL-3.0-or-later
//
// The spread of an area light, which narrows its emission like a grid in front of a softbox. Gives
// the radiance per direction and samples directions in proportion to it. The power of the light
// does not depend on the spread.
//
// Source: Blender's area light, whose radiance at the angle t to the normal has the factor max(tan
// h - tan t, 0) / (tan h - h), where h is half the spread.
// Differs: numerator and denominator are multiplied by cot h, so that a spread of 180 degrees,
// where tan h is infinite, needs no special case.
#pragma once

#include <glm/glm.hpp>

namespace raybundle {

// The angular distribution of the radiance of an area light for a given spread. Immutable.
class AreaSpread {
  public:
    // Constructs the distribution for `spread`, the full opening angle in radians, in [0, pi].
    // Spreads below 0.002 radians are raised to 0.002.
    explicit AreaSpread(double spread);

    // Returns whether the spread is 180 degrees. The light then emits as a Lambertian surface does,
    // and factor() is 1 for all directions.
    bool isWhole() const { return cotangent <= 0; }

    // Returns the radiance in a direction relative to that of a Lambertian light of equal power.
    // `cosine` is the cosine of the angle between the direction and the light's normal. The factor
    // is 0 for `cosine` <= 0, except if isWhole(). The mean of the factor over the hemisphere,
    // weighted by the cosine, is 1.
    float factor(float cosine) const;

    // Returns the tangent of half the spread, the largest angle to the normal at which light
    // leaves. Infinite if isWhole().
    float tangent() const { return float(1 / cotangent); }

    // Returns a unit direction in the hemisphere of the unit vector `normal`. Its density per solid
    // angle is proportional to factor(cosine) * cosine if `uv` is uniform in [0, 1)^2.
    glm::vec3 emit(const glm::vec3& normal, glm::vec2 uv) const;

  private:
    double integral(double angle) const;

    double half;       // half the spread, radians in (0, pi/2]
    double cotangent;  // cotangent of `half`; 0 if the spread is 180 degrees
    double total = 1;  // normalises factor(): 1 - half * cotangent
};

}  // namespace raybundle
