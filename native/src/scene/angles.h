// SPDX-License-Identifier: GPL-3.0-or-later
//
// How reflection depends on the angle of the light, by the cosine c between it and the normal: on
// 1 - c, (1 - c)^2, (1 - c)^5 and c (1 - c)^5.
//
// Source: the diffuse shaders of Cycles are such sums, or close to one (Schlick's approximation of
// Fresnel's law; Burley's and Oren and Nayar's models, seen from straight above).
#pragma once

#include <algorithm>
#include <array>
#include <glm/glm.hpp>

namespace raybundle {

// The terms at a cosine.
inline glm::vec4 angleTerms(float cosine) {
    const float c = std::min(std::max(cosine, 0.0f), 1.0f), rest = 1 - c, square = rest * rest;
    const float fifth = square * square * rest;
    return {rest, square, fifth, c * fifth};
}
// Their means over light from everywhere.
const glm::vec4 kEverywhere{1.0f / 3, 1.0f / 6, 1.0f / 21, 1.0f / 84};

// Of each term, by channel.
using AngleFactors = std::array<glm::vec3, 4>;

inline glm::vec3 sumOfTerms(const AngleFactors& factors, const glm::vec4& terms) {
    return terms.x * factors[0] + terms.y * factors[1] + terms.z * factors[2] +
           terms.w * factors[3];
}

}  // namespace raybundle
