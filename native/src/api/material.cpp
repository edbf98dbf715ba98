// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstddef>

#include "api/border.h"

using namespace raybundle;

namespace {

// Size of the oldest part of rb_surface: size, reflectance and emission, which every caller's
// header has.
constexpr size_t kLeastSize = offsetof(rb_surface, translucence);

rb_surface defaultSurface() {
    constexpr rb_color kBlack{{0, 0, 0}, RB_NO_IMAGE, {0, 0, 0}, {0, 0, 0}};
    rb_surface surface{};
    surface.size = sizeof(rb_surface);
    surface.reflectance = {{0.8f, 0.8f, 0.8f}, RB_NO_IMAGE, {0, 0, 0}, {0, 0, 0}};
    surface.emission = surface.translucence = kBlack;
    surface.shown.color = {{1, 1, 1}, {0, 0, 0}};
    for (float& channel : surface.shown.from_above) channel = 1;
    return surface;
}

// Throws Error(INVALID_ARGUMENT) if the struct size is smaller than kLeastSize or larger than this
// library's struct. `object` names the surface in the message.
void needSurfaceSize(size_t size, const std::string& object) {
    const std::string given = object + " has a size of " + std::to_string(size) + " bytes";
    if (size < kLeastSize)
        throw invalidArgument(given + ", which is too small; call rb_init_surface first");
    if (size > sizeof(rb_surface))
        throw invalidArgument(given + ", but this library supports at most " +
                              std::to_string(sizeof(rb_surface)) +
                              " bytes; use a newer version of the library");
}

// Reads one side of a material from the caller's struct. Checks everything that Scene::addMaterial
// does not check.
class SideReader {
  public:
    // `object` names the material in messages; `side` is "front" or "back".
    SideReader(const std::string& object, const std::string& side, const rb_surface* given)
        : object(object), side(side), surface(defaultSurface()) {
        need(given, side.c_str());
        needSurfaceSize(given->size, object + ": its " + side);
        std::memcpy(&surface, given, given->size);
    }

    MaterialSide read() const {
        MaterialSide made;
        made.reflectance = color(surface.reflectance, "reflectance");
        made.emission = color(surface.emission, "emission");
        made.translucence = color(surface.translucence, "translucence");
        finite(surface.translucence.constant, "translucence.constant");
        made.reflectanceByAngle = angles(surface.reflectance_by_angle, "reflectance_by_angle");
        made.colorScale = finite(surface.shown.color.scale, "shown.color.scale");
        made.colorOffset = finite(surface.shown.color.offset, "shown.color.offset");
        made.shownFromAbove = finite(surface.shown.from_above, "shown.from_above");
        made.shownByAngle = angles(surface.shown.by_angle, "shown.by_angle");
        readGloss(made.scattering);
        addLobe(surface.microfibers, LobeKind::MICROFIBERS, "microfibers", made.scattering);
        addLobe(surface.velvet, LobeKind::VELVET, "velvet", made.scattering);
        addLobe(surface.burley_sheen, LobeKind::BURLEY_SHEEN, "burley_sheen", made.scattering);
        addLobe(surface.several_facets, LobeKind::SEVERAL_FACETS, "several_facets",
                made.scattering);
        readDiffuse(made.scattering);
        return made;
    }

  private:
    std::string memberName(const std::string& member) const {
        return object + ": " + side + " " + member;
    }

    glm::vec3 finite(const float values[3], const std::string& member) const {
        needFinite(values, 3, memberName(member).c_str());
        return vec3(values);
    }

    AngleFactors angles(const rb_angle_factors& factors, const std::string& member) const {
        return {finite(factors.linear, member + ".linear"),
                finite(factors.square, member + ".square"),
                finite(factors.fifth, member + ".fifth"),
                finite(factors.cosine_fifth, member + ".cosine_fifth")};
    }

    SurfaceColor color(const rb_color& given, const std::string& member) const {
        return {vec3(given.constant), given.image,
                finite(given.image_weight, member + ".image_weight"),
                finite(given.corner_color_weight, member + ".corner_color_weight")};
    }

    float roughness(float value, const char* member) const {
        if (!(value >= 0 && value <= 1))
            throw invalidArgument(memberName(member) + ".roughness must be 0 to 1");
        return value;
    }

    // Returns `value` if it lies between 0 and `last`; throws Error(INVALID_ARGUMENT) if not.
    template <class Enum>
    Enum kind(Enum value, Enum last, const char* what) const {
        if (int(value) < 0 || int(value) > int(last))
            throw invalidArgument(object + ": unknown " + what + " " + std::to_string(int(value)));
        return value;
    }

    void readGloss(Scattering& scattering) const {
        const rb_gloss& gloss = surface.gloss;
        scattering.glossScale = finite(gloss.part.scale, "gloss.part.scale");
        scattering.glossOffset = finite(gloss.part.offset, "gloss.part.offset");
        scattering.glossByAngle = angles(gloss.by_angle, "gloss.by_angle");
        scattering.glossRoughness = roughness(gloss.roughness, "gloss");
        scattering.glossMasking = kind(gloss.masking, RB_MASKING_SEPARATE, "masking");
    }

    void addLobe(const rb_lobe& given, LobeKind kind, const std::string& member,
                 Scattering& scattering) const {
        const LobeReflectance lobe{kind, roughness(given.roughness, member.c_str()),
                                   finite(given.reflectance, member + ".reflectance"),
                                   angles(given.by_angle, member + ".by_angle")};
        if (lobe.reflectance != glm::vec3(0.0f) || lobe.byAngle != AngleFactors{})
            scattering.lobes.push_back(lobe);
    }

    void readDiffuse(Scattering& scattering) const {
        const rb_diffuse& diffuse = surface.diffuse;
        scattering.diffuseModel = kind(diffuse.model, RB_DIFFUSE_OREN_NAYAR, "diffuse model");
        scattering.diffuseRoughness = roughness(diffuse.roughness, "diffuse");
        scattering.leaving = angles(diffuse.leaving, "diffuse.leaving");
    }

    const std::string object, side;
    rb_surface surface;
};

}  // namespace

rb_error rb_init_surface(rb_surface* surface, size_t size) {
    return guarded([&] {
        need(surface, "surface");
        needSurfaceSize(size, "surface");
        const rb_surface defaults = defaultSurface();
        std::memcpy(surface, &defaults, size);
        surface->size = size;
    });
}

rb_error rb_add_material(rb_scene scene, const char* name, const rb_surface* front,
                         const rb_surface* back, float opacity, int32_t opacity_image,
                         int32_t* material) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(material, "material");
        Material made;
        made.name = nameOf(name);
        const std::string object = "material \"" + made.name + "\"";
        made.sides[0] = SideReader(object, "front", front).read();
        made.sides[1] = back ? SideReader(object, "back", back).read() : made.sides[0];
        if (!(opacity >= 0 && opacity <= 1))
            throw invalidArgument(object + ": opacity must be 0 to 1");
        made.opacity = opacity;
        made.opacityImage = opacity_image;
        *material = held->addMaterial(std::move(made));
    });
}
