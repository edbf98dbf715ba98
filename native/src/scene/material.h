// SPDX-License-Identifier: GPL-3.0-or-later
//
// Materials: the optical properties of surfaces, each side by itself. Validated forms of rb_surface
// and rb_add_material, whose comments in raybundle.h define the members.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "raybundle/raybundle.h"
#include "scene/angles.h"

namespace raybundle {

// A colour that may vary over a mesh: constant + imageWeight * image + cornerColorWeight * corner
// colours, linear RGB (rb_color).
struct SurfaceColor {
    glm::vec3 constant{0.0f};
    // Index in Scene::images, or RB_NO_IMAGE.
    int image = RB_NO_IMAGE;
    glm::vec3 imageWeight{0.0f};
    glm::vec3 cornerColorWeight{0.0f};

    bool usesCornerColors() const { return cornerColorWeight != glm::vec3(0.0f); }
    // Returns whether the colour is 0 everywhere. A colour with an image or corner colours counts
    // as not black.
    bool isBlack() const {
        return constant == glm::vec3(0.0f) && image == RB_NO_IMAGE && !usesCornerColors();
    }
};

// Lobes other than gloss: microfibre sheen (Blender 4.0 and later), Cycles' velvet, sheen as before
// Blender 4.0, and the light that gloss reflects after several facets.
enum class LobeKind { MICROFIBERS, VELVET, BURLEY_SHEEN, SEVERAL_FACETS };

// The part of a side's reflectance that a lobe sends (rb_lobe).
struct LobeReflectance {
    LobeKind kind = LobeKind::MICROFIBERS;
    float roughness = 0;
    // Reflectance by the lobe for light from all directions.
    glm::vec3 reflectance{0.0f};
    // The part of MaterialSide::reflectanceByAngle that belongs to the lobe.
    AngleFactors byAngle{};
};

// The directions into which a side reflects light (rb_gloss, rb_lobe and rb_diffuse). The default
// is Lambert's law.
struct Scattering {
    // The reflectance of gloss is glossScale * reflectance + glossOffset.
    glm::vec3 glossScale{0.0f}, glossOffset{0.0f};
    // The part of MaterialSide::reflectanceByAngle that belongs to gloss.
    AngleFactors glossByAngle{};
    rb_masking glossMasking = RB_MASKING_CORRELATED;
    // Roughness from 0 to 1; its square is the alpha of GGX.
    float glossRoughness = 0;
    std::vector<LobeReflectance> lobes;  // of different kinds, none black
    rb_diffuse_model diffuseModel = RB_DIFFUSE_LAMBERT;
    float diffuseRoughness = 0;
    // How diffuse light leaves, by its angle to the normal (rb_diffuse).
    AngleFactors leaving{};

    bool hasGloss() const {
        return glossScale != glm::vec3(0.0f) || glossOffset != glm::vec3(0.0f) ||
               glossByAngle != AngleFactors{};
    }
    // Returns whether the diffuse part follows another model than Lambert's.
    bool isRough() const { return diffuseModel != RB_DIFFUSE_LAMBERT; }
    // Returns whether a layer above the diffuse part keeps some of its light back.
    bool hasLayer() const { return leaving != AngleFactors{}; }
    // Returns whether the side reflects all light by Lambert's law.
    bool isLambert() const { return !hasGloss() && lobes.empty() && !isRough() && !hasLayer(); }
};

// The optical properties of one side of a material (rb_surface).
struct MaterialSide {
    SurfaceColor reflectance{glm::vec3(0.8f)};  // albedo, below 1
    SurfaceColor emission;                      // exitance, W/m^2
    SurfaceColor translucence;  // share of the light on the other side that leaves on this one
    // Change of the reflectance by the angle of the light, relative to that for light from all
    // directions.
    AngleFactors reflectanceByAngle{};
    // What outputs show of the side (rb_shown). The diffuse colour is colorScale * reflectance +
    // colorOffset. The shown share of light along the normal is shownFromAbove, to which
    // shownByAngle adds for other directions.
    glm::vec3 colorScale{1.0f}, colorOffset{0.0f};
    glm::vec3 shownFromAbove{1.0f};
    AngleFactors shownByAngle{};
    Scattering scattering;

    // Returns pointers to all colours of the side that may vary over a mesh.
    std::array<const SurfaceColor*, 3> colors() const {
        return {&reflectance, &emission, &translucence};
    }
    // Returns whether outputs show light from some directions more than from others.
    bool showsByAngle() const {
        return shownFromAbove != glm::vec3(1.0f) || shownByAngle != AngleFactors{};
    }
    // Returns the share of the light that outputs show, per channel, 0 to 16. `angles` holds the
    // means of the angleTerms() of the light.
    glm::vec3 shown(const glm::vec4& angles) const {
        constexpr float kMostShown = 16;  // more than any shader shows; keeps the result finite
        return glm::clamp(shownFromAbove + sumOfTerms(shownByAngle, angles), 0.0f, kMostShown);
    }
};

// A material with two sides. All members are as validated by Scene::addMaterial.
struct Material {
    std::string name;
    std::array<MaterialSide, 2> sides;  // front and back, indexed by rb_side
    // Share of the light that does not pass straight through, 0 to 1. The mean channel of
    // `opacityImage` multiplies it. The colours of the sides are those of the whole surface, the
    // parts that light passes through included.
    float opacity = 1;
    // Index in Scene::images, or RB_NO_IMAGE.
    int opacityImage = RB_NO_IMAGE;

    // Returns whether no light passes straight through.
    bool isOpaque() const { return opacity >= 1 && opacityImage == RB_NO_IMAGE; }
    // Returns whether either side may emit light.
    bool emits() const { return !sides[0].emission.isBlack() || !sides[1].emission.isBlack(); }
    // Returns whether light may pass diffusely to either side.
    bool isTranslucent() const {
        return !sides[0].translucence.isBlack() || !sides[1].translucence.isBlack();
    }
    // Returns whether outputs show light from some directions more than from others, on either
    // side.
    bool showsByAngle() const { return sides[0].showsByAngle() || sides[1].showsByAngle(); }
};

}  // namespace raybundle
