// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/scene.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "job/error.h"
#include "scene/channels.h"

namespace raybundle {
namespace {

// Results are sparse if at most one in kSparse corners of the mesh has a result, and at most one in
// kSparseOnFaces corners of the faces that have any. The second condition excludes meshes with many
// copies of a part, as the modifier Array makes them.
constexpr size_t kSparse = 4, kSparseOnFaces = 2;

// Returns the item of an id. Throws Error(INVALID_ARGUMENT) if there is none; `what` names the kind
// in the message.
template <class T>
T& checked(std::vector<T>& items, int32_t id, const char* what) {
    if (id < 0 || size_t(id) >= items.size())
        throw invalidArgument(std::string("there is no ") + what + " " + std::to_string(id));
    return items[id];
}

template <class V>
bool isFinite(const V& v) {
    for (int i = 0; i < v.length(); ++i)
        if (!std::isfinite(v[i])) return false;
    return true;
}

template <class V>
bool isFiniteAndPositive(const V& v) {
    for (int i = 0; i < v.length(); ++i)
        if (!std::isfinite(v[i]) || v[i] < 0) return false;
    return true;
}

// Largest strength of a light, in W/m^2, W/sr or W/(m^2 sr); sunlight is 1e3 W/m^2. Above it,
// squares of the light times areas would exceed the range of float and the result would be NaN.
constexpr float kMostLight = 1e15f;
constexpr const char* kTooBright =
    " is too bright; reduce it to at most 1e15 (W/m^2, W/sr or W/(m^2 sr))";

std::string quoted(const char* kind, const std::string& name) {
    return std::string(kind) + " \"" + name + "\"";
}

// Throws Error(INVALID_ARGUMENT) if a vector is not finite.
template <class V>
void checkAllFinite(const std::vector<V>& values, const std::string& object, const char* what) {
    for (size_t i = 0; i < values.size(); ++i)
        if (!isFinite(values[i]))
            throw invalidArgument(object + ": " + what + " " + std::to_string(i) +
                                  " is not a finite number");
}

}  // namespace

std::vector<float> cornerAngles(const Mesh& mesh) {
    std::vector<float> angles(mesh.cornerCount());
    for (size_t f = 0; f < mesh.faceCount(); ++f) {
        const int32_t begin = mesh.faceOffsets[f], end = mesh.faceOffsets[f + 1];
        for (int32_t c = begin; c < end; ++c) {
            auto at = [&](int32_t corner) {
                return glm::dvec3(mesh.vertices[size_t(mesh.cornerVertices[size_t(corner)])]);
            };
            const glm::dvec3 a = at(c == begin ? end - 1 : c - 1) - at(c);
            const glm::dvec3 b = at(c + 1 == end ? begin : c + 1) - at(c);
            angles[size_t(c)] = float(std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)));
        }
    }
    return angles;
}

int32_t Scene::addImage(Image image) {
    const std::string object = quoted("image", image.name);
    if (image.width <= 0 || image.height <= 0) throw invalidArgument(object + " has no pixels");
    size_t black = 0;
    for (glm::vec3& pixel : image.pixels) {
        if (isFiniteAndPositive(pixel)) continue;
        pixel = glm::vec3(0.0f);
        ++black;
    }
    if (black > 0)
        warnings.push_back({WarningId::BLACK_PIXELS,
                            object + ": pixels that are negative or not finite count as black (" +
                                std::to_string(black) + " of " +
                                std::to_string(image.pixels.size()) +
                                " pixels); correct them in the image"});
    images.push_back(std::move(image));
    return int32_t(images.size()) - 1;
}

int32_t Scene::addMaterial(Material material) {
    // A closed scene with reflectance 1 or more has no finite solution: light grows without bound.
    constexpr float kMaxReflectance = 0.999f;
    const std::string object = quoted("material", material.name);
    auto checkImage = [&](int id) {
        if (id != RB_NO_IMAGE && (id < 0 || size_t(id) >= images.size()))
            throw invalidArgument(object + ": there is no image " + std::to_string(id));
    };
    checkImage(material.opacityImage);
    bool clamped = false;
    for (MaterialSide& side : material.sides) {
        for (const SurfaceColor* color : side.colors()) checkImage(color->image);
        glm::vec3& reflectance = side.reflectance.constant;
        const glm::vec3& emission = side.emission.constant;
        if (!isFiniteAndPositive(reflectance) || !isFiniteAndPositive(emission))
            throw invalidArgument(object +
                                  ": reflectance and emission must be finite and not negative");
        if (brightest(emission) > kMostLight)
            throw invalidArgument(object + ": its emission" + kTooBright);
        const glm::vec3 limited = glm::min(reflectance, glm::vec3(kMaxReflectance));
        clamped = clamped || limited != reflectance;
        reflectance = limited;
    }
    if (clamped)
        warnings.push_back({WarningId::CLAMPED_REFLECTANCE,
                            object +
                                ": its reflectance was clamped to 0.999, because every surface "
                                "must absorb some light; choose a darker base colour"});
    materials.push_back(std::move(material));
    return int32_t(materials.size()) - 1;
}

int32_t Scene::addMesh(Mesh mesh) {
    const std::string object = quoted("mesh", mesh.name);
    checkAllFinite(mesh.vertices, object, "vertex");
    if (mesh.faceOffsets.empty() || mesh.faceOffsets.front() != 0 ||
        size_t(mesh.faceOffsets.back()) != mesh.cornerVertices.size())
        throw invalidArgument(object +
                              ": face offsets must start at 0 and end at the number of corners");
    for (size_t f = 0; f < mesh.faceCount(); ++f)
        if (mesh.faceOffsets[f + 1] - mesh.faceOffsets[f] < 3)
            throw invalidArgument(object + ": face " + std::to_string(f) +
                                  " has fewer than 3 corners");
    for (size_t c = 0; c < mesh.cornerVertices.size(); ++c)
        if (mesh.cornerVertices[c] < 0 || size_t(mesh.cornerVertices[c]) >= mesh.vertices.size())
            throw invalidArgument(object + ": corner " + std::to_string(c) + " uses vertex " +
                                  std::to_string(mesh.cornerVertices[c]) + ", but the mesh has " +
                                  std::to_string(mesh.vertices.size()) + " vertices");
    for (int32_t id : mesh.faceMaterials)
        if (id != -1) checked(materials, id, "material");
    mesh.faceMaterials.resize(mesh.faceCount(), -1);
    meshes.push_back(std::move(mesh));
    return int32_t(meshes.size()) - 1;
}

int32_t Scene::addInstance(Instance instance) {
    const std::string object = quoted("object", instance.name);
    checked(meshes, instance.mesh, "mesh");
    for (int column = 0; column < 4; ++column)
        if (!isFinite(instance.transform[column]))
            throw invalidArgument(object + ": its transform is not finite");
    instances.push_back(std::move(instance));
    return int32_t(instances.size()) - 1;
}

int32_t Scene::addLight(Light light) {
    const std::string object = quoted("light", light.name);
    if (!isFiniteAndPositive(light.strength))
        throw invalidArgument(object + ": its strength must be finite and not negative");
    if (!isFinite(light.position) || !isFinite(light.direction) || !isFinite(light.axisU) ||
        !isFinite(light.axisV) || !std::isfinite(light.radius) || light.radius < 0 ||
        !std::isfinite(light.angle) || light.angle < 0)
        throw invalidArgument(
            object +
            ": its position, direction and size must be finite, and its size not negative");
    const float reach = light.radius + glm::length(light.axisU) + glm::length(light.axisV);
    if (!(glm::length(light.position) + reach <= kFarthest))
        throw invalidArgument(object + " reaches further than 1e12 m from the origin");
    // The strength of an area light is limited by radiance times area, because a small panel may
    // have any radiance.
    const float area =
        light.kind == Light::Kind::AREA ? glm::length(glm::cross(light.axisU, light.axisV)) : 1.0f;
    if (brightest(light.strength) * area > kMostLight) throw invalidArgument(object + kTooBright);
    if (light.kind == Light::Kind::SUN) {
        if (glm::length(light.direction) == 0)
            throw invalidArgument(object + ": its direction must not be zero");
        light.direction = glm::normalize(light.direction);
    }
    lights.push_back(std::move(light));
    return int32_t(lights.size()) - 1;
}

glm::vec3 WorldImage::meanRadiance() const {
    glm::dvec3 sum(0.0);
    for (int y = 0; y < height; ++y) {
        glm::dvec3 row(0.0);
        for (int x = 0; x < width; ++x) row += pixels[size_t(y) * size_t(width) + size_t(x)];
        const double low = glm::pi<double>() * y / height,
                     up = glm::pi<double>() * (y + 1) / height;
        sum += 0.5 * (std::cos(low) - std::cos(up)) * row;
    }
    return width > 0 ? glm::vec3(sum / double(width)) : glm::vec3(0.0f);
}

void Scene::setWorld(const glm::vec3& radiance) {
    if (!isFinite(radiance)) throw invalidArgument("the world radiance must be finite");
    if (brightest(radiance) > kMostLight)
        throw invalidArgument(std::string("the world radiance") + kTooBright);
    worldRadiance = glm::max(radiance, glm::vec3(0.0f));
}

void Scene::setWorldImage(WorldImage image) {
    if (image.width <= 0 || image.height <= 0)
        throw invalidArgument("the world image has no pixels");
    for (const glm::vec3& pixel : image.pixels) {
        if (!isFiniteAndPositive(pixel))
            throw invalidArgument("the pixels of the world image must be finite and not negative");
        if (brightest(pixel) > kMostLight)
            throw invalidArgument(std::string("a pixel of the world image") + kTooBright);
    }
    worldImage = std::move(image);
}

int32_t Scene::addLightSet(std::string name) {
    if (std::find(lightSets.begin(), lightSets.end(), name) != lightSets.end())
        throw invalidArgument("there is already a " + quoted("light set", name));
    lightSets.push_back(std::move(name));
    return int32_t(lightSets.size()) - 1;
}

Mesh& Scene::mesh(int32_t id) { return checked(meshes, id, "mesh"); }
Light& Scene::light(int32_t id) { return checked(lights, id, "light"); }
Instance& Scene::instance(int32_t id) { return checked(instances, id, "instance"); }

void Scene::setResultCorners(int32_t id, const int32_t* corners, size_t count) {
    Instance& target = instance(id);
    if (target.role != RB_ROLE_BAKE)
        throw invalidArgument(quoted("object", target.name) +
                              " has the role OCCLUDE, so that it has no result corners");
    const Mesh& own = meshes[size_t(target.mesh)];
    std::vector<uint8_t> vertices(own.vertices.size()), faces(own.faceCount());
    for (size_t k = 0; k < count; ++k) {
        if (corners[k] < 0 || size_t(corners[k]) >= own.cornerCount())
            throw invalidArgument(quoted("object", target.name) + " has no corner " +
                                  std::to_string(corners[k]));
        vertices[size_t(own.cornerVertices[size_t(corners[k])])] = true;
    }
    for (size_t face = 0; face < faces.size(); ++face)
        for (int32_t c = own.faceOffsets[face]; c < own.faceOffsets[face + 1]; ++c)
            faces[face] |= vertices[size_t(own.cornerVertices[size_t(c)])];
    target.resultVertices = std::move(vertices);
    target.resultFaces = std::move(faces);
    size_t results = 0, onTheirFaces = 0;
    for (size_t face = 0; face < own.faceCount(); ++face) {
        if (!target.resultFaces[face]) continue;
        onTheirFaces += size_t(own.faceOffsets[face + 1] - own.faceOffsets[face]);
        for (int32_t c = own.faceOffsets[face]; c < own.faceOffsets[face + 1]; ++c)
            results += target.resultVertices[size_t(own.cornerVertices[size_t(c)])];
    }
    target.hasSparseResults =
        kSparse * results <= own.cornerCount() && kSparseOnFaces * results <= onTheirFaces;
}

size_t Scene::cornersWithoutResult() const {
    size_t count = 0;
    for (const Instance& instance : instances) {
        if (instance.role != RB_ROLE_BAKE || instance.resultVertices.empty()) continue;
        for (int32_t vertex : meshes[size_t(instance.mesh)].cornerVertices)
            count += !instance.hasResultAtVertex(size_t(vertex));
    }
    return count;
}

void Scene::checkLightSet(int32_t id) const {
    if (id != kNoLightSet && (id < 0 || size_t(id) >= lightSets.size()))
        throw invalidArgument("there is no light set " + std::to_string(id));
}

const Material& Scene::materialOf(const Mesh& mesh, size_t face) const {
    static const Material kDefault;
    const int32_t id = mesh.faceMaterials[face];
    return id < 0 ? kDefault : materials[id];
}

}  // namespace raybundle
