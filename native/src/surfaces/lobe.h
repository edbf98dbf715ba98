// SPDX-License-Identifier: GPL-3.0-or-later
//
// Lobes: the directions into which a surface that is not Lambert's reflects light from one
// direction. A lobe is the exitance towards a direction (pi times the radiance there), relative to
// its mean over all directions weighted by the cosine.
//
// Sources:
// - Gloss: Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (2007), GGX
//   with Smith's masking, height-correlated (Heitz 2014) or not. Sampled as in Heitz, "Sampling the
//   GGX Distribution of Visible Normals" (2018). Fresnel's reflectance from f0 to 1, as in Cycles.
// - Light that meets several facets: Turquin, "Practical multiple scattering compensation for
//   microfacet models" (2019): the light that one facet mirrors times 1 / E - 1, where E is the
//   albedo by the angle of view.
// - Diffuse: Burley, "Physically-Based Shading at Disney" (2012); Fujii, "A tiny improvement of
//   Oren-Nayar reflectance model" (2012).
// - Cloth: surfaces/microfibers.h; velvet of Ashikhmin, Premoze and Shirley, "A Microfacet-Based
//   BRDF Generator" (2000); Burley's sheen, which is Schlick's fifth power, by the angle between
//   the light and the half vector.
// Differs:
// - Each lobe is scaled to a mean of 1, per channel. Materials state how much a surface reflects
//   (scene/material.h); a lobe only states the directions.
// - Fresnel's reflectance always rises as that of an index of refraction of 1.5.
// - Light that meets several facets is white.
#pragma once

#include <glm/glm.hpp>
#include <utility>

#include "scene/material.h"

namespace raybundle {

// The lobe of a surface for light from one direction. The functions gloss(), diffuse() and of()
// make it; it is immutable.
class Lobe {
  public:
    // Least roughness of gloss and of several facets. Smoother surfaces get lobes of this
    // roughness, because patches are too large to separate narrower lobes.
    static constexpr float kLeastRoughness = 0.45f;

    // Makes the lobe of gloss. `normal` and `incoming` are unit vectors; `incoming` points to the
    // source and lies above the surface. `roughness` is 0 to 1, its square is the alpha of GGX, and
    // values below kLeastRoughness count as kLeastRoughness. `f0` is the reflectance at normal
    // incidence, 0 to 1, per channel.
    static Lobe gloss(const glm::vec3& normal, const glm::vec3& incoming, rb_masking masking,
                      float roughness, const glm::vec3& f0);
    // Makes the lobe of a diffuse model other than Lambert's. Arguments as for gloss(), without a
    // least roughness.
    static Lobe diffuse(const glm::vec3& normal, const glm::vec3& incoming, rb_diffuse_model model,
                        float roughness);
    // Makes a lobe of another kind. Several facets have the roughness of gloss, with the same least
    // value; cloth has a least roughness of 0.2.
    static Lobe of(LobeKind lobe, const glm::vec3& normal, const glm::vec3& incoming,
                   float roughness);

    // Returns the f0 of gloss for which the reflectance for light along the normal is `ratio` times
    // that for light from all directions. The result is clamped to 0 to 1.
    static float f0Of(float ratio, rb_masking masking, float roughness);

    // Returns the value of the lobe towards a unit vector that points away from the surface, per
    // channel. It is 0 or more, and 0 below the surface.
    glm::vec3 towards(const glm::vec3& direction) const;

    // Returns the mean of the lobe before it was scaled to 1. For gloss, the lobe times this mean
    // is linear in f0.
    glm::vec3 mean() const;
    // Returns the RMS deviation of the lobe from its mean, weighted by the cosine, in the channel
    // with the largest deviation.
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
    // Returns G / (4 cos_in cos_out) for light that leaves at the cosine `out`.
    float visibility(float out) const;
    // Returns the unscaled lobe towards a direction at the cosines `no` to the normal and `io` to
    // the incoming direction, without Fresnel's reflectance. The second value is the rise of
    // Fresnel's reflectance: 0 where it is f0 and 1 where it is 1. Only gloss has one.
    std::pair<float, float> shape(float no, float io) const;
    // Scale the lobe to a mean of 1, by its known moments or by quadrature of shape().
    void normalise(float mean, float meanSquare);
    void normalise();

    Kind kind;
    glm::vec3 normal, incoming;
    float cosine;  // of the angle between `normal` and `incoming`
    // For facets: (2 / G1 - 1) times the cosine.
    float shadowing;
    // For facets: the square of alpha. For other kinds: the roughness itself.
    float roughness;
    // The value of the lobe is shape * (facing + rise * rising), per channel.
    glm::vec3 facing{1.0f}, rising{0.0f};
    // See contrast().
    float rms = 0;
};

}  // namespace raybundle
