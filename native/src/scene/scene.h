// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/constants.hpp>
#include <string>
#include <vector>

#include "job/warning.h"
#include "raybundle/raybundle.h"
#include "scene/material.h"

namespace raybundle {

// Linear RGB pixels, bottom row first.
struct Image {
    std::string name;
    int width = 0;
    int height = 0;
    rb_image_extension extension = RB_IMAGE_REPEAT;
    std::vector<glm::vec3> pixels;
};

// From the origin, metres: areas, and the squares of distances, stay far from the ends of float.
constexpr double kFarthest = 1e12;

// N-gons over shared vertices, in object space. A corner is a position in cornerVertices; face f
// has the corners faceOffsets[f] .. faceOffsets[f + 1] - 1.
struct Mesh {
    std::string name;
    std::vector<glm::vec3> vertices;
    std::vector<int32_t> cornerVertices;
    std::vector<int32_t> faceOffsets;
    std::vector<int32_t> faceMaterials;    // per face; -1 is the default material
    std::vector<glm::vec3> cornerNormals;  // per corner, or empty
    std::vector<uint64_t> sharpEdges;      // edgeKey of each, ascending
    std::vector<glm::vec2> uvs;            // per corner, or empty
    std::vector<glm::vec3> cornerColors;   // per corner, or empty

    size_t faceCount() const { return faceOffsets.size() - 1; }
    size_t cornerCount() const { return cornerVertices.size(); }
};

// An edge between two vertices, whichever comes first.
inline uint64_t edgeKey(int32_t a, int32_t b) {
    return uint64_t(a < b ? a : b) << 32 | uint64_t(a < b ? b : a);
}

// The angle of each corner, radians.
std::vector<float> cornerAngles(const Mesh& mesh);

// A light set is a named group of lights with results of its own. What belongs to none,
// kNoLightSet, only counts in the light of all.
constexpr int32_t kNoLightSet = RB_NO_LIGHT_SET;

// A mesh in the world. transform maps object space to world space (the last row is 0 0 0 1).
struct Instance {
    std::string name;
    int32_t mesh = 0;
    glm::dmat4 transform{1.0};
    rb_role role = RB_ROLE_BAKE;
    rb_side side = RB_SIDE_FRONT;
    int32_t lightSet = kNoLightSet;  // of its emission
    bool stopsDirect = true;         // blocks the light of the sources
    bool exchanges = true;           // sends light to other surfaces, and blocks what they send
    // Where only some corners have a result: per vertex of the mesh, whether one of its corners
    // has, and per face, whether one of its vertices. Empty: all.
    std::vector<uint8_t> resultVertices{}, resultFaces{};
    // Whether these are few among corners without a result, as those of a mesh that a modifier has
    // subdivided.
    bool hasSparseResults = false;

    bool hasResultAtVertex(size_t vertex) const {
        return role == RB_ROLE_BAKE && (resultVertices.empty() || resultVertices[vertex]);
    }
    bool hasResultOnFace(size_t face) const {
        return role == RB_ROLE_BAKE && (resultFaces.empty() || resultFaces[face]);
    }

    // A mirroring transform turns the winding of faces, but the front stays outside as in Blender.
    // One that flattens has a determinant of rounding alone, and does not mirror.
    bool isMirrored() const {
        constexpr double kFlat = 1e-9;  // over the product of the lengths of the columns
        const glm::dmat3 turn(transform);
        return glm::determinant(turn) <
               -kFlat * glm::length(turn[0]) * glm::length(turn[1]) * glm::length(turn[2]);
    }
};

struct Light {
    enum class Kind { POINT, SUN, AREA };
    std::string name;
    Kind kind = Kind::POINT;
    // W/sr for POINT, W/m^2 at normal incidence for SUN, W/(m^2 sr) for AREA.
    glm::dvec3 strength{0.0};
    glm::dvec3 position{0.0};  // POINT, AREA: centre
    double radius = 0.0;       // POINT
    rb_point_shape pointShape = RB_POINT_DISK;
    glm::dvec3 direction{0.0, 0.0, 1.0};  // SUN: unit vector towards it
    double angle = 0.0;                   // SUN: full angular diameter, radians
    glm::dvec3 axisU{0.0}, axisV{0.0};    // AREA: half extents; shines towards cross(axisU, axisV)
    rb_area_shape areaShape = RB_AREA_RECTANGLE;
    double spread = glm::pi<double>();  // AREA: full opening, radians; the power is kept
    bool castsShadows = true;           // false: nothing stops its light
    bool hasCone = false;               // POINT with a spot's cone
    glm::dmat3 worldToCone{1.0};        // into the space where the cone looks along -Z
    double coneAngle = 0.0;             // full opening, radians
    double coneBlend = 0.0;             // soft share of the cone, 0 to 1
    bool coneDims = false;              // the intensity falls with the cosine to the axis
    int32_t lightSet = kNoLightSet;
};

// Radiance of the world by direction, W/(m^2 sr): equirectangular, bottom row first. Cycles'
// mapping: the middle column is +X, the one at 3/4 of the width -Y, the top row +Z. Without
// pixels: none.
struct WorldImage {
    int width = 0;
    int height = 0;
    std::vector<glm::vec3> pixels;

    // Over all directions.
    glm::vec3 meanRadiance() const;
};

// Everything the caller gave, as given, after validation. Nothing of it changes during a bake.
class Scene {
  public:
    // Each adds one object and returns its id; throws Error(INVALID_ARGUMENT) that names the
    // object.
    int32_t addImage(Image image);
    int32_t addMaterial(Material material);
    int32_t addMesh(Mesh mesh);
    int32_t addInstance(Instance instance);
    int32_t addLight(Light light);
    void setWorld(const glm::vec3& radiance);  // negative parts count as 0
    void setWorldImage(WorldImage image);
    int32_t addLightSet(std::string name);

    // Checks that an id was given out; `what` names its kind in the message.
    Mesh& mesh(int32_t id);
    Light& light(int32_t id);
    Instance& instance(int32_t id);
    void setResultCorners(int32_t instance, const int32_t* corners, size_t count);
    // Of instances whose other corners have one.
    size_t cornersWithoutResult() const;
    void checkLightSet(int32_t id) const;  // kNoLightSet is one too

    // The world's part of the light of a set, W/(m^2 sr): all or nothing.
    glm::vec3 worldRadianceOf(int32_t lightSet) const {
        return worldLightSet == lightSet ? worldRadiance : glm::vec3(0.0f);
    }
    const Material& materialOf(const Mesh& mesh, size_t face) const;
    const Material& materialOf(size_t instance, size_t face) const {
        return materialOf(meshes[instances[instance].mesh], face);
    }

    std::vector<Image> images;
    std::vector<Material> materials;
    std::vector<Mesh> meshes;
    std::vector<Instance> instances;
    std::vector<Light> lights;
    glm::vec3 worldRadiance{0.0f};        // W/(m^2 sr), constant
    WorldImage worldImage;                // what comes on top of it
    std::vector<std::string> lightSets;   // names
    int32_t worldLightSet = kNoLightSet;  // of both
    Warnings warnings;                    // what was changed to make the scene usable
};

}  // namespace raybundle
