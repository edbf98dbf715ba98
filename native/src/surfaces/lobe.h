// SPDX-License-Identifier: GPL-3.0-or-later
//
// Where a surface that is not Lambert's sends the light that arrives from one direction: exitance
// towards a direction, so that the radiance is 1 / pi of it, over its mean by Lambert's cosine.
//
// Sources: Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (2007), GGX
// with Smith's masking, height-correlated (Heitz 2014) or not, sampled as in Heitz, "Sampling the
// GGX Distribution of Visible Normals" (2018), with Fresnel's reflectance from f0 to 1 as Cycles
// has it. Light that meets several facets: Turquin, "Practical multiple scattering compensation for
// microfacet models" (2019), what one facet mirrors times 1 / E - 1, E the albedo by the angle of
// view. Burley, "Physically-Based Shading at Disney" (2012). Fujii, "A tiny improvement of
// Oren-Nayar reflectance model" (2012). Cloth: surfaces/microfibers.h; Ashikhmin, Premoze and
// Shirley, "A Microfacet-Based BRDF Generator" (2000), velvet; Burley's sheen, Schlick's fifth
// power of the angle between the light and the half vector.
// Differs: each is brought to a mean of 1, by channel. How much a surface reflects is known
// (scene/scene.h); here is only where to. Fresnel's reflectance always rises as that of an index of
// 1.5, and several facets are white.
#pragma once

#include <glm/glm.hpp>
#include <utility>

#include "scene/material.h"

namespace raybundle {

class Lobe {
  public:
    static constexpr float kLeastRoughness = 0.45f;

    // normal, incoming: unit vectors, incoming towards the source and above the surface.
    // roughness: 0 to 1, GGX alpha is its square, but what is smoother than kLeastRoughness is that
    // rough: patches do not tell narrower lobes apart. f0: reflectance at right angles, 0 to 1, by
    // channel.
    static Lobe gloss(const glm::vec3& normal, const glm::vec3& incoming, rb_masking masking,
                      float roughness, const glm::vec3& f0);
    static Lobe diffuse(const glm::vec3& normal, const glm::vec3& incoming, rb_diffuse_model model,
                        float roughness);
    // Several facets are as rough as gloss.
    static Lobe of(LobeKind lobe, const glm::vec3& normal, const glm::vec3& incoming,
                   float roughness);

    // f0 of gloss that reflects so many times as much of light at right angles as of light from
    // everywhere.
    static float f0Of(float ratio, rb_masking masking, float roughness);

    // Of a unit vector away from the surface: 0 or more, 0 below the surface.
    glm::vec3 towards(const glm::vec3& direction) const;

    // Its mean before it was brought to 1: lobes of gloss times theirs are linear in f0.
    glm::vec3 mean() const;
    // RMS of what it is off its mean, by Lambert's cosine, of the channel with most.
    float contrast() const { return rms; }

  private:
    enum class Kind {
        GLOSS,
        SEPARATE_GLOSS,
        SEVERAL_FACETS,
        BURLEY,
        OREN_NAYAR,
        MICROFIBERS,
        VELVET,
        BURLEY_SHEEN
    };
    struct Moments;
    class GlossTable;
    Lobe(Kind kind, const glm::vec3& normal, const glm::vec3& incoming, float roughness);
    static Kind glossOf(rb_masking masking);
    // G / (4 times both cosines), of light that leaves at the cosine `out`.
    float visibility(float out) const;
    // Towards a direction at a cosine `no` from the normal and `io` from the incoming one: before
    // it is brought to a mean of 1, without Fresnel's reflectance, and the latter's rise, which
    // only gloss has.
    std::pair<float, float> shape(float no, float io) const;
    void normalise(float mean, float meanSquare);
    void normalise();

    Kind kind;
    glm::vec3 normal, incoming;
    float cosine;     // of the two
    float shadowing;  // of facets: 2 / G1 - 1, times the cosine
    float roughness;  // of facets: alpha squared
    // What of the shape is sent, and what of it times the rise.
    glm::vec3 facing{1.0f}, rising{0.0f};
    float rms = 0;
};

}  // namespace raybundle
