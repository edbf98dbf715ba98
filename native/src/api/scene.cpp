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

// Copies one value per corner to a mesh. In messages `argument` names the array and `what` one of
// its numbers.
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
                                          std::to_string(vertices[end]) + ", but the mesh has " +
                                          std::to_string(target.vertices.size()) + " vertices");
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

rb_error rb_set_instance_quality(rb_scene scene, int32_t instance, float noise, float patch_size) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        Instance& target = held->instance(instance);
        for (const float factor : {noise, patch_size})
            if (!(factor >= 0.01f && factor <= 100))
                throw invalidArgument("instance \"" + target.name +
                                      "\": the factors of its quality must be from 0.01 to 100");
        target.noiseFactor = noise;
        target.patchFactor = patch_size;
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
            throw invalidArgument("light \"" + target.name +
                                  "\": the angle must be finite and not negative, and the "
                                  "blend must be 0 to 1");
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
        // The caller's float value of pi may be rounded up.
        if (!(spread >= 0 && spread <= glm::pi<float>() * 1.000001f))
            throw invalidArgument("light \"" + target.name + "\": the spread must be 0 to pi");
        target.spread = double(spread);
    });
}

rb_error rb_set_light_shadows(rb_scene scene, int32_t light, bool casts_shadows) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        held->light(light).castsShadows = casts_shadows;
    });
}

rb_error rb_remove_lights(rb_scene scene) {
    return guarded([&] {
        const HeldScene held(scene, "scene");
        held->lights.clear();
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
        if (width <= 0 || height <= 0) throw invalidArgument("the world image has no pixels");
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
