// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene_file.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "job/error.h"

namespace raybundle::bench {
namespace {

using Json = nlohmann::json;

// Returns a vector of the GLM type V from consecutive components that start at index `first`.
template <class V>
V vectorAt(const Json& values, size_t first = 0) {
    V v;
    for (int k = 0; k < V::length(); ++k)
        v[k] = values.at(first + size_t(k)).get<typename V::value_type>();
    return v;
}

template <class V>
std::vector<V> vectors(const Json& values) {
    std::vector<V> result(values.size() / size_t(V::length()));
    for (size_t i = 0; i < result.size(); ++i)
        result[i] = vectorAt<V>(values, i * size_t(V::length()));
    return result;
}

std::vector<int32_t> integers(const Json& values) { return values.get<std::vector<int32_t>>(); }

std::string name(const Json& item) { return item.at("name").get<std::string>(); }

Image image(const Json& item) {
    const std::string extension = item.at("extension");
    return {name(item), item.at("width"), item.at("height"),
            extension == "EXTEND" ? RB_IMAGE_EXTEND
            : extension == "CLIP" ? RB_IMAGE_CLIP
                                  : RB_IMAGE_REPEAT,
            vectors<glm::vec3>(item.at("pixels"))};
}

SurfaceColor color(const Json& item) {
    return {vectorAt<glm::vec3>(item.at("constant")), item.value("image", RB_NO_IMAGE),
            vectorAt<glm::vec3>(item.at("image_weight")),
            vectorAt<glm::vec3>(item.at("corner_color_weight"))};
}

// Reads a matt side. Gloss and all other members of the side are ignored.
MaterialSide side(const Json& item) {
    MaterialSide made;
    made.reflectance = color(item.at("reflectance"));
    made.emission = color(item.at("emission"));
    return made;
}

Material material(const Json& item) {
    return {name(item), {side(item.at("front")), side(item.at("back"))}};
}

Mesh mesh(const Json& item) {
    Mesh made;
    made.name = name(item);
    made.vertices = vectors<glm::vec3>(item.at("vertices"));
    made.cornerVertices = integers(item.at("corner_vertices"));
    made.faceOffsets = integers(item.at("face_offsets"));
    made.faceMaterials = integers(item.at("face_materials"));
    made.cornerNormals = vectors<glm::vec3>(item.at("corner_normals"));
    for (const glm::ivec2& edge : vectors<glm::ivec2>(item.at("sharp_edges")))
        made.sharpEdges.push_back(edgeKey(edge.x, edge.y));
    std::sort(made.sharpEdges.begin(), made.sharpEdges.end());
    if (item.contains("uvs")) made.uvs = vectors<glm::vec2>(item.at("uvs"));
    if (item.contains("corner_colors"))
        made.cornerColors = vectors<glm::vec3>(item.at("corner_colors"));
    return made;
}

Instance instance(const Json& item) {
    Instance made;
    made.name = name(item);
    made.mesh = item.at("mesh");
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
            made.transform[column][row] =
                item.at("transform").at(size_t(4 * row + column)).get<double>();
    made.role = item.at("role") == "OCCLUDE" ? RB_ROLE_OCCLUDE : RB_ROLE_BAKE;
    made.side = item.at("side") == "BACK" ? RB_SIDE_BACK : RB_SIDE_FRONT;
    return made;
}

Light light(const Json& item) {
    Light made;
    made.name = name(item);
    const std::string kind = item.at("kind");
    if (kind == "POINT") {
        made.kind = Light::Kind::POINT;
        made.position = vectorAt<glm::dvec3>(item.at("position"));
        made.strength = vectorAt<glm::dvec3>(item.at("intensity"));
        made.radius = item.at("radius");
        made.pointShape = item.at("shape") == "SPHERE" ? RB_POINT_SPHERE : RB_POINT_DISK;
        if (item.contains("world_to_light")) {
            made.hasCone = true;
            for (int row = 0; row < 3; ++row)
                for (int column = 0; column < 3; ++column)
                    made.worldToCone[column][row] =
                        item.at("world_to_light").at(size_t(3 * row + column)).get<double>();
            made.coneAngle = item.at("cone_angle");
            made.coneBlend = item.at("cone_blend");
            made.coneDims = item.at("cone_dims");
        }
    } else if (kind == "SUN") {
        made.kind = Light::Kind::SUN;
        made.direction = vectorAt<glm::dvec3>(item.at("direction"));
        made.strength = vectorAt<glm::dvec3>(item.at("irradiance"));
        made.angle = item.at("angle");
    } else {
        made.kind = Light::Kind::AREA;
        made.position = vectorAt<glm::dvec3>(item.at("centre"));
        made.axisU = vectorAt<glm::dvec3>(item.at("axis_u"));
        made.axisV = vectorAt<glm::dvec3>(item.at("axis_v"));
        made.strength = vectorAt<glm::dvec3>(item.at("radiance"));
        made.areaShape = item.at("shape") == "ELLIPSE" ? RB_AREA_ELLIPSE : RB_AREA_RECTANGLE;
    }
    return made;
}

}  // namespace

Scene readScene(const std::string& path) {
    std::ifstream file(path);
    if (!file) throw invalidArgument("cannot read " + path);
    const Json data = Json::parse(file);
    Scene scene;
    for (const Json& item : data.at("images")) scene.addImage(image(item));
    for (const Json& item : data.at("materials")) scene.addMaterial(material(item));
    for (const Json& item : data.at("meshes")) scene.addMesh(mesh(item));
    for (const Json& item : data.at("instances")) scene.addInstance(instance(item));
    for (const Json& item : data.at("lights")) scene.addLight(light(item));
    scene.worldRadiance = vectorAt<glm::vec3>(data.at("world"));
    return scene;
}

}  // namespace raybundle::bench
