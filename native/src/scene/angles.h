// SPDX-License-Identifier: GPL-3.0-or-later
//
// Dependence of reflection on the angle of the light. With c the cosine between the light's
// direction and the normal, it is a weighted sum of four terms: 1 - c, (1 - c)^2, (1 - c)^5 and c
// (1 - c)^5.
//
// Source: the diffuse shaders of Cycles are sums of these terms, exactly or nearly (Schlick's
// approximation of Fresnel's law; the models of Burley and of Oren and Nayar, seen along the
// normal).
#pragma once

#include <algorithm>
#include <array>
#include <glm/glm.hpp>

namespace raybundle {

// Returns the four terms at a cosine, which is clamped to [0, 1].
inline glm::vec4 angleTerms(float cosine) {
    const float c = std::min(std::max(cosine, 0.0f), 1.0f), rest = 1 - c, square = rest * rest;
    const float fifth = square * square * rest;
    return {rest, square, fifth, c * fifth};
}
// The means of the four terms over light that arrives equally from all directions (weighted by the
// cosine).
const glm::vec4 kEverywhere{1.0f / 3, 1.0f / 6, 1.0f / 21, 1.0f / 84};

// Factors of the four terms, each linear RGB.
using AngleFactors = std::array<glm::vec3, 4>;

// Returns the sum of the factors times the terms, linear RGB.
inline glm::vec3 sumOfTerms(const AngleFactors& factors, const glm::vec4& terms) {
    return terms.x * factors[0] + terms.y * factors[1] + terms.z * factors[2] +
           terms.w * factors[3];
}

}  // namespace raybundle
