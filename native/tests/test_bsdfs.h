// SPDX-License-Identifier: GPL-3.0-or-later
//
// Models of surfaces as they are published, to compare with, and means over directions.
#pragma once

#include <functional>
#include <glm/glm.hpp>

#include "raybundle/raybundle.h"

namespace raybundle::test {

// A BSDF over a surface that looks along z: of unit vectors to the light and to the eye, 1/sr.
using Bsdf = std::function<double(const glm::dvec3& in, const glm::dvec3& out)>;

// Walter et al. (2007), with height-correlated masking (Heitz 2014) or not.
Bsdf ggx(double roughness, double f0, rb_masking masking = RB_MASKING_CORRELATED);
// Turquin (2019): what one white facet of GGX mirrors, by what it keeps back towards the eye.
Bsdf severalFacets(double roughness);
// Burley (2012): diffuse.
Bsdf burley(double roughness);
// Burley's sheen (2012).
Bsdf burleySheen();
// Fujii (2012).
Bsdf orenNayar(double sigma);
// Ashikhmin, Premoze and Shirley (2000).
Bsdf velvet(double sigma);
// Zeltner et al. (2022): a cosine, transformed so that where light comes from that goes towards an
// angle has the mass 1.
Bsdf transformedCosine(double roughness);

// Calls visit(direction, share) for n^2 directions that stand for shares of Lambert's light along
// z: many of them grazing, where models are steep.
void forCosine(int n, const std::function<void(const glm::dvec3&, double)>& visit);
// Mean and mean square of the exitance by a BSDF.
glm::dvec2 moments(const Bsdf& bsdf, const glm::dvec3& in, int steps = 400);
// A unit vector at an angle to z.
glm::dvec3 inclined(double cosine);

}  // namespace raybundle::test
