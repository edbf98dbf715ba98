// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "api/border.h"

using namespace raybundle;

rb_error rb_new_scene(rb_scene* scene) {
    return guarded([&] {
        need(scene, "scene");
        *scene = Handles<rb_scene, Scene>::add(std::make_unique<Scene>());
    });
}

void rb_release_scene(rb_scene scene) { Handles<rb_scene, Scene>::release(scene); }

rb_error rb_add_image(rb_scene scene, const char* name, int32_t width, int32_t height,
                      const float* rgb, rb_image_extension extension, int32_t* image) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(image, "image");
        if (width <= 0 || height <= 0)
            throw invalidArgument("image \"" + nameOf(name) + "\" has no pixels");
        const size_t pixels = size_t(width) * size_t(height);
        needArray(rgb, pixels, "rgb");
        if (extension != RB_IMAGE_REPEAT && extension != RB_IMAGE_EXTEND &&
            extension != RB_IMAGE_CLIP)
            throw invalidArgument("there is no image extension " + std::to_string(int(extension)));
        *image = held->addImage(
            {nameOf(name), width, height, extension, vectors<glm::vec3>(rgb, pixels)});
    });
}

rb_error rb_add_material(rb_scene scene, const char* name, const float reflectance[6],
                         const float emission[6], int32_t* material) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(reflectance, "reflectance");
        need(emission, "emission");
        need(material, "material");
        Material made;
        made.name = nameOf(name);
        made.reflectance = {vec3(reflectance), vec3(reflectance + 3)};
        made.emission = {vec3(emission), vec3(emission + 3)};
        *material = held->addMaterial(std::move(made));
    });
}

rb_error rb_set_material_image(rb_scene scene, int32_t material, int32_t image,
                               const float weight[3]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(weight, "weight");
        needFinite(weight, 3, "weight");
        Material& target = held->material(material);
        held->checkImage(image);
        target.image = image;
        target.imageWeight = vec3(weight);
    });
}

rb_error rb_set_material_corner_colors(rb_scene scene, int32_t material, const float weight[3]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(weight, "weight");
        needFinite(weight, 3, "weight");
        Material& target = held->material(material);
        target.usesCornerColors = true;
        target.cornerColorWeight = vec3(weight);
    });
}

rb_error rb_set_material_emission_image(rb_scene scene, int32_t material, int32_t image,
                                        const float weight[6]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(weight, "weight");
        needFinite(weight, 6, "weight");
        Material& target = held->material(material);
        held->checkImage(image);
        target.emissionImage = image;
        target.emissionImageWeight = {vec3(weight), vec3(weight + 3)};
    });
}

rb_error rb_set_material_emission_corner_colors(rb_scene scene, int32_t material,
                                                const float weight[6]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(weight, "weight");
        needFinite(weight, 6, "weight");
        Material& target = held->material(material);
        target.emissionUsesCornerColors = true;
        target.emissionColorWeight = {vec3(weight), vec3(weight + 3)};
    });
}

rb_error rb_set_material_diffuse(rb_scene scene, int32_t material, const float scale[6],
                                 const float offset[6]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(scale, "scale");
        need(offset, "offset");
        needFinite(scale, 6, "scale");
        needFinite(offset, 6, "offset");
        Material& target = held->material(material);
        target.diffuseScale = {vec3(scale), vec3(scale + 3)};
        target.diffuseOffset = {vec3(offset), vec3(offset + 3)};
    });
}

namespace {

void needRoughness(const Material& material, const float roughness[2]) {
    need(roughness, "roughness");
    for (size_t side = 0; side < 2; ++side)
        if (!(roughness[side] >= 0 && roughness[side] <= 1))
            throw invalidArgument("material \"" + material.name + "\": roughness must be 0 to 1");
}

// An enumeration's value, 0 to last.
void needKind(const Material& material, const char* name, int value, int last) {
    if (value < 0 || value > last)
        throw invalidArgument("material \"" + material.name + "\": unknown " + name + " " +
                              std::to_string(value));
}

}  // namespace

rb_error rb_set_material_gloss(rb_scene scene, int32_t material, const float scale[6],
                               const float offset[6], const float by_angle[24], rb_masking masking,
                               const float roughness[2]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(scale, "scale");
        need(offset, "offset");
        need(by_angle, "by_angle");
        needFinite(scale, 6, "scale");
        needFinite(offset, 6, "offset");
        needFinite(by_angle, 24, "by_angle");
        Material& target = held->material(material);
        needRoughness(target, roughness);
        needKind(target, "masking", int(masking), RB_MASKING_SEPARATE);
        for (size_t side = 0; side < 2; ++side) {
            Scattering& scattering = target.scattering[side];
            scattering.glossScale = vec3(scale + 3 * side);
            scattering.glossOffset = vec3(offset + 3 * side);
            for (size_t term = 0; term < scattering.glossByAngle.size(); ++term)
                scattering.glossByAngle[term] = vec3(by_angle + 6 * term + 3 * side);
            scattering.glossMasking = masking;
            scattering.glossRoughness = roughness[side];
        }
    });
}

rb_error rb_set_material_lobe(rb_scene scene, int32_t material, rb_lobe lobe,
                              const float reflectance[6], const float by_angle[24],
                              const float roughness[2]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(reflectance, "reflectance");
        need(by_angle, "by_angle");
        needFinite(reflectance, 6, "reflectance");
        needFinite(by_angle, 24, "by_angle");
        Material& target = held->material(material);
        needRoughness(target, roughness);
        needKind(target, "lobe", int(lobe), RB_LOBE_SEVERAL_FACETS);
        for (size_t side = 0; side < 2; ++side) {
            LobeReflectance part{lobe, roughness[side], vec3(reflectance + 3 * side)};
            for (size_t term = 0; term < part.byAngle.size(); ++term)
                part.byAngle[term] = vec3(by_angle + 6 * term + 3 * side);
            std::vector<LobeReflectance>& lobes = target.scattering[side].lobes;
            lobes.erase(std::remove_if(lobes.begin(), lobes.end(),
                                       [&](const auto& other) { return other.lobe == lobe; }),
                        lobes.end());
            if (part.reflectance != glm::vec3(0.0f) || part.byAngle != AngleFactors{})
                lobes.push_back(part);
        }
    });
}

rb_error rb_set_material_diffuse_model(rb_scene scene, int32_t material, rb_diffuse_model model,
                                       const float roughness[2]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        Material& target = held->material(material);
        needRoughness(target, roughness);
        needKind(target, "diffuse model", int(model), RB_DIFFUSE_OREN_NAYAR);
        for (size_t side = 0; side < 2; ++side) {
            target.scattering[side].diffuseModel = model;
            target.scattering[side].diffuseRoughness = roughness[side];
        }
    });
}

rb_error rb_set_material_leaving(rb_scene scene, int32_t material, const float factors[24]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(factors, "factors");
        needFinite(factors, 24, "factors");
        Material& target = held->material(material);
        for (size_t side = 0; side < 2; ++side) {
            AngleFactors& leaving = target.scattering[side].leaving;
            for (size_t term = 0; term < leaving.size(); ++term)
                leaving[term] = vec3(factors + 6 * term + 3 * side);
        }
    });
}

rb_error rb_set_material_angles(rb_scene scene, int32_t material, const float reflected[24],
                                const float shown[30]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(reflected, "reflected");
        need(shown, "shown");
        needFinite(reflected, 24, "reflected");
        needFinite(shown, 30, "shown");
        Material& target = held->material(material);
        for (size_t side = 0; side < 2; ++side) {
            target.shownFromAbove[side] = vec3(shown + 3 * side);
            for (size_t term = 0; term < target.shownByAngle[side].size(); ++term) {
                target.reflectanceByAngle[side][term] = vec3(reflected + 6 * term + 3 * side);
                target.shownByAngle[side][term] = vec3(shown + 6 * (term + 1) + 3 * side);
            }
        }
    });
}

rb_error rb_set_material_opacity(rb_scene scene, int32_t material, float opacity) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        Material& target = held->material(material);
        if (!(opacity >= 0 && opacity <= 1))
            throw invalidArgument("material \"" + target.name + "\": opacity must be 0 to 1");
        target.opacity = opacity;
    });
}

rb_error rb_set_material_opacity_image(rb_scene scene, int32_t material, int32_t image) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        Material& target = held->material(material);
        held->checkImage(image);
        target.opacityImage = image;
    });
}

rb_error rb_set_material_translucence(rb_scene scene, int32_t material, const float translucence[6],
                                      int32_t image, const float image_weight[6]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(translucence, "translucence");
        needFinite(translucence, 6, "translucence");
        Material& target = held->material(material);
        if (image != -1) {
            held->checkImage(image);
            need(image_weight, "image_weight");
            needFinite(image_weight, 6, "image_weight");
            target.translucenceImageWeight = {vec3(image_weight), vec3(image_weight + 3)};
        }
        target.translucence = {vec3(translucence), vec3(translucence + 3)};
        target.translucenceImage = image;
    });
}

rb_error rb_add_mesh(rb_scene scene, const char* name, const float* vertices, size_t vertex_count,
                     const int32_t* corner_vertices, size_t corner_count,
                     const int32_t* face_offsets, size_t face_count, const int32_t* face_materials,
                     int32_t* mesh) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(mesh, "mesh");
        Mesh made = makeMesh(name, vertices, vertex_count, corner_vertices, corner_count,
                             face_offsets, face_count);
        if (face_materials) made.faceMaterials.assign(face_materials, face_materials + face_count);
        *mesh = held->addMesh(std::move(made));
    });
}

namespace {

// Copies a value per corner to a mesh. argument, what: the array and a number of it in messages.
template <class V>
rb_error setCornerValues(rb_scene scene, int32_t mesh, const float* values, size_t count,
                         const char* argument, const char* what, std::vector<V> Mesh::*target) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        Mesh& owner = held->mesh(mesh);
        needCount(count, owner.cornerCount(), "corner_count");
        needArray(values, count, argument);
        needFinite(values, size_t(V::length()) * count, what);
        owner.*target = vectors<V>(values, count);
    });
}

}  // namespace

rb_error rb_set_mesh_corner_normals(rb_scene scene, int32_t mesh, const float* normals,
                                    size_t corner_count) {
    return setCornerValues(scene, mesh, normals, corner_count, "normals", "normal component",
                           &Mesh::cornerNormals);
}

rb_error rb_set_mesh_uvs(rb_scene scene, int32_t mesh, const float* uvs, size_t corner_count) {
    return setCornerValues(scene, mesh, uvs, corner_count, "uvs", "UV component", &Mesh::uvs);
}

rb_error rb_set_mesh_corner_colors(rb_scene scene, int32_t mesh, const float* rgb,
                                   size_t corner_count) {
    return setCornerValues(scene, mesh, rgb, corner_count, "rgb", "colour component",
                           &Mesh::cornerColors);
}

rb_error rb_set_mesh_sharp_edges(rb_scene scene, int32_t mesh, const int32_t* vertices,
                                 size_t edge_count) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        Mesh& target = held->mesh(mesh);
        needArray(vertices, edge_count, "vertices");
        std::vector<uint64_t> edges;
        for (size_t e = 0; e < edge_count; ++e) {
            for (size_t end = 2 * e; end < 2 * e + 2; ++end)
                if (vertices[end] < 0 || size_t(vertices[end]) >= target.vertices.size())
                    throw invalidArgument("mesh \"" + target.name + "\": sharp edge " +
                                          std::to_string(e) + " uses vertex " +
                                          std::to_string(vertices[end]));
            edges.push_back(edgeKey(vertices[2 * e], vertices[2 * e + 1]));
        }
        std::sort(edges.begin(), edges.end());
        target.sharpEdges = std::move(edges);
    });
}

rb_error rb_add_instance(rb_scene scene, int32_t mesh, const char* name, const float transform[12],
                         rb_role role, rb_side side, int32_t* instance) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(transform, "transform");
        need(instance, "instance");
        if (role != RB_ROLE_BAKE && role != RB_ROLE_OCCLUDE)
            throw invalidArgument("there is no role " + std::to_string(int(role)));
        if (side != RB_SIDE_FRONT && side != RB_SIDE_BACK)
            throw invalidArgument("there is no side " + std::to_string(int(side)));
        Instance made{nameOf(name), mesh, glm::dmat4(1.0), role, side};
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column)
                made.transform[column][row] = double(transform[4 * row + column]);
        *instance = held->addInstance(std::move(made));
    });
}

rb_error rb_set_instance_visibility(rb_scene scene, int32_t instance, bool stops_direct,
                                    bool exchanges) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        Instance& target = held->instance(instance);
        target.stopsDirect = stops_direct;
        target.exchanges = exchanges;
    });
}

rb_error rb_set_result_corners(rb_scene scene, int32_t instance, const int32_t* corners,
                               size_t corner_count) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        needArray(corners, corner_count, "corners");
        held->setResultCorners(instance, corners, corner_count);
    });
}

rb_error rb_add_point_light(rb_scene scene, const char* name, const float position[3],
                            const float intensity[3], float radius, rb_point_shape shape,
                            int32_t* light) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(position, "position");
        need(intensity, "intensity");
        need(light, "light");
        if (shape != RB_POINT_DISK && shape != RB_POINT_SPHERE)
            throw invalidArgument("there is no point shape " + std::to_string(int(shape)));
        Light made;
        made.name = nameOf(name);
        made.position = vec3(position);
        made.strength = vec3(intensity);
        made.radius = double(radius);
        made.pointShape = shape;
        *light = held->addLight(std::move(made));
    });
}

rb_error rb_set_light_cone(rb_scene scene, int32_t light, const float world_to_light[9],
                           float angle, float blend, bool dims_by_cosine) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(world_to_light, "world_to_light");
        needFinite(world_to_light, 9, "matrix element");
        Light& target = held->light(light);
        if (target.kind != Light::Kind::POINT)
            throw invalidArgument("light \"" + target.name + "\" is not a point light");
        if (!(angle >= 0 && std::isfinite(angle)) || !(blend >= 0 && blend <= 1))
            throw invalidArgument("light \"" + target.name + "\": angle or blend out of range");
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column)
                target.worldToCone[column][row] = double(world_to_light[3 * row + column]);
        target.hasCone = true;
        target.coneAngle = double(angle);
        target.coneBlend = double(blend);
        target.coneDims = dims_by_cosine;
    });
}

rb_error rb_add_sun_light(rb_scene scene, const char* name, const float direction[3],
                          const float irradiance[3], float angle, int32_t* light) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(direction, "direction");
        need(irradiance, "irradiance");
        need(light, "light");
        Light made;
        made.name = nameOf(name);
        made.kind = Light::Kind::SUN;
        made.direction = vec3(direction);
        made.strength = vec3(irradiance);
        made.angle = double(angle);
        *light = held->addLight(std::move(made));
    });
}

rb_error rb_add_area_light(rb_scene scene, const char* name, const float centre[3],
                           const float axis_u[3], const float axis_v[3], const float radiance[3],
                           rb_area_shape shape, int32_t* light) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(centre, "centre");
        need(axis_u, "axis_u");
        need(axis_v, "axis_v");
        need(radiance, "radiance");
        need(light, "light");
        if (shape != RB_AREA_RECTANGLE && shape != RB_AREA_ELLIPSE)
            throw invalidArgument("there is no area shape " + std::to_string(int(shape)));
        Light made;
        made.name = nameOf(name);
        made.kind = Light::Kind::AREA;
        made.position = vec3(centre);
        made.axisU = vec3(axis_u);
        made.axisV = vec3(axis_v);
        made.strength = vec3(radiance);
        made.areaShape = shape;
        *light = held->addLight(std::move(made));
    });
}

rb_error rb_set_light_spread(rb_scene scene, int32_t light, float spread) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        Light& target = held->light(light);
        if (target.kind != Light::Kind::AREA)
            throw invalidArgument("light \"" + target.name + "\" is not an area light");
        // In float pi may come out a little larger.
        if (!(spread >= 0 && spread <= glm::pi<float>() * 1.000001f))
            throw invalidArgument("light \"" + target.name + "\": spread out of range");
        target.spread = double(spread);
    });
}

rb_error rb_set_light_shadows(rb_scene scene, int32_t light, bool casts_shadows) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        held->light(light).castsShadows = casts_shadows;
    });
}

rb_error rb_set_world(rb_scene scene, const float radiance[3]) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(radiance, "radiance");
        held->setWorld(vec3(radiance));
    });
}

rb_error rb_set_world_image(rb_scene scene, int32_t width, int32_t height, const float* rgb) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        if (width <= 0 || height <= 0) throw invalidArgument("world image has no pixels");
        const size_t pixels = size_t(width) * size_t(height);
        needArray(rgb, pixels, "rgb");
        held->setWorldImage({width, height, vectors<glm::vec3>(rgb, pixels)});
    });
}

rb_error rb_add_light_set(rb_scene scene, const char* name, int32_t* set) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        need(set, "set");
        *set = held->addLightSet(nameOf(name));
    });
}

rb_error rb_set_light_set(rb_scene scene, int32_t light, int32_t set) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        held->checkLightSet(set);
        held->light(light).lightSet = set;
    });
}

rb_error rb_set_instance_light_set(rb_scene scene, int32_t instance, int32_t set) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        held->checkLightSet(set);
        held->instance(instance).lightSet = set;
    });
}

rb_error rb_set_world_light_set(rb_scene scene, int32_t set) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        held->checkLightSet(set);
        held->worldLightSet = set;
    });
}
