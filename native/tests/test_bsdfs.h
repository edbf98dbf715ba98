// SPDX-License-Identifier: GPL-3.0-or-later
//
// Published models of reflection, to compare with the lobes of the library, and means over
// directions.
#pragma once

#include <functional>
#include <glm/glm.hpp>

#include "raybundle/raybundle.h"

namespace raybundle::test {

// A BSDF over a surface with the normal +z, as a function of the unit vectors to the light and to
// the eye, 1/sr.
using Bsdf = std::function<double(const glm::dvec3& in, const glm::dvec3& out)>;

// GGX: Walter et al. (2007), with height-correlated masking (Heitz 2014) or separate masking.
Bsdf ggx(double roughness, double f0, rb_masking masking = RB_MASKING_CORRELATED);
// Turquin (2019): what one white facet of GGX mirrors, times what GGX loses towards the eye.
Bsdf severalFacets(double roughness);
// Burley (2012): diffuse reflection.
Bsdf burley(double roughness);
// Burley (2012): sheen.
Bsdf burleySheen();
// Fujii (2012): Oren and Nayar's diffuse reflection.
Bsdf orenNayar(double sigma);
// Ashikhmin, Premoze and Shirley (2000): velvet.
Bsdf velvet(double sigma);
// Zeltner et al. (2022): a linearly transformed cosine. It is normalised over the directions of the
// light for a given direction of the eye.
Bsdf transformedCosine(double roughness);

// Calls visit(direction, share) for n^2 directions with their shares of the light of a Lambert
// surface. Many of the directions are grazing, where the models are steep.
void forCosine(int n, const std::function<void(const glm::dvec3&, double)>& visit);
// Returns the mean and the mean square of the relative exitance by a BSDF.
glm::dvec2 moments(const Bsdf& bsdf, const glm::dvec3& in, int steps = 400);
// Returns a unit vector at an angle to z with the given cosine.
glm::dvec3 inclined(double cosine);

}  // namespace raybundle::test
