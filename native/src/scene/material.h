// SPDX-License-Identifier: GPL-3.0-or-later
//
// What a material does with light, one side at a time: rb_surface and rb_add_material, checked.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "raybundle/raybundle.h"
#include "scene/angles.h"

namespace raybundle {

// A colour that may vary over a mesh, see rb_color.
struct SurfaceColor {
    glm::vec3 constant{0.0f};
    int image = RB_NO_IMAGE;  // an index of Scene::images
    glm::vec3 imageWeight{0.0f};
    glm::vec3 cornerColorWeight{0.0f};

    bool usesCornerColors() const { return cornerColorWeight != glm::vec3(0.0f); }
    // False where an image or corner colours may add to a black constant.
    bool isBlack() const {
        return constant == glm::vec3(0.0f) && image == RB_NO_IMAGE && !usesCornerColors();
    }
};

enum class LobeKind { MICROFIBERS, VELVET, BURLEY_SHEEN, SEVERAL_FACETS };

// A part of what a side reflects that has a lobe of its own, see rb_lobe.
struct LobeReflectance {
    LobeKind kind = LobeKind::MICROFIBERS;
    float roughness = 0;
    glm::vec3 reflectance{0.0f};
    AngleFactors byAngle{};
};

// Where a side that is not Lambert's sends light, see rb_gloss, rb_lobe and rb_diffuse.
struct Scattering {
    glm::vec3 glossScale{0.0f}, glossOffset{0.0f};
    AngleFactors glossByAngle{};
    rb_masking glossMasking = RB_MASKING_CORRELATED;
    float glossRoughness = 0;
    std::vector<LobeReflectance> lobes;  // of different kinds, none black
    rb_diffuse_model diffuseModel = RB_DIFFUSE_LAMBERT;
    float diffuseRoughness = 0;
    AngleFactors leaving{};  // by the angle at which diffuse light leaves

    bool hasGloss() const {
        return glossScale != glm::vec3(0.0f) || glossOffset != glm::vec3(0.0f) ||
               glossByAngle != AngleFactors{};
    }
    bool isRough() const { return diffuseModel != RB_DIFFUSE_LAMBERT; }
    bool hasLayer() const { return leaving != AngleFactors{}; }
    bool isLambert() const { return !hasGloss() && lobes.empty() && !isRough() && !hasLayer(); }
};

// What one side of a material does with light, see rb_surface.
struct MaterialSide {
    SurfaceColor reflectance{glm::vec3(0.8f)};  // albedo
    SurfaceColor emission;                      // exitance, W/m^2
    SurfaceColor translucence;  // share of the light at the other side that leaves this one
    AngleFactors reflectanceByAngle{};
    // What outputs show, see rb_shown: colorScale * reflectance + colorOffset is diffuse colour.
    glm::vec3 colorScale{1.0f}, colorOffset{0.0f};
    glm::vec3 shownFromAbove{1.0f};
    AngleFactors shownByAngle{};
    Scattering scattering;

    // All that may vary over a mesh.
    std::array<const SurfaceColor*, 3> colors() const {
        return {&reflectance, &emission, &translucence};
    }
    bool showsByAngle() const {
        return shownFromAbove != glm::vec3(1.0f) || shownByAngle != AngleFactors{};
    }
    // What outputs show of light, by the means of its angleTerms.
    glm::vec3 shown(const glm::vec4& angles) const {
        constexpr float kMostShown = 16;  // far above what any shader shows; keeps results finite
        return glm::clamp(shownFromAbove + sumOfTerms(shownByAngle, angles), 0.0f, kMostShown);
    }
};

struct Material {
    std::string name;
    std::array<MaterialSide, 2> sides;  // front and back, as rb_side
    // Share of the light that does not pass straight through, and an image whose mean channel
    // multiplies it. Colours are those of the whole surface, what passes through included.
    float opacity = 1;
    int opacityImage = RB_NO_IMAGE;

    bool isOpaque() const { return opacity >= 1 && opacityImage == RB_NO_IMAGE; }
    bool emits() const { return !sides[0].emission.isBlack() || !sides[1].emission.isBlack(); }
    bool isTranslucent() const {
        return !sides[0].translucence.isBlack() || !sides[1].translucence.isBlack();
    }
    // Whether outputs do not show all light alike.
    bool showsByAngle() const { return sides[0].showsByAngle() || sides[1].showsByAngle(); }
};

}  // namespace raybundle
