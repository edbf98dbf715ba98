// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
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

// An image of linear RGB pixels, in rows from the bottom to the top.
struct Image {
    std::string name;
    int width = 0;
    int height = 0;
    rb_image_extension extension = RB_IMAGE_REPEAT;
    // width * height pixels, finite and not negative.
    std::vector<glm::vec3> pixels;
};

// Largest distance of any point from the origin, m. Within it, areas and squared distances stay far
// from the limits of float.
constexpr double kFarthest = 1e12;

// A mesh of polygons that share vertices, in object space (m). A corner is an index in
// cornerVertices. The corners of face f are faceOffsets[f] to faceOffsets[f + 1] - 1.
struct Mesh {
    std::string name;
    std::vector<glm::vec3> vertices;
    std::vector<int32_t> cornerVertices;  // per corner
    std::vector<int32_t> faceOffsets;
    std::vector<int32_t> faceMaterials;    // per face, id of a material; -1 is the default material
    std::vector<glm::vec3> cornerNormals;  // per corner, unit, or empty
    std::vector<uint64_t> sharpEdges;      // edgeKey() of each sharp edge, ascending
    std::vector<glm::vec2> uvs;            // per corner, or empty
    std::vector<glm::vec3> cornerColors;   // per corner, linear RGB, or empty

    size_t faceCount() const { return faceOffsets.size() - 1; }
    size_t cornerCount() const { return cornerVertices.size(); }
};

// Returns a key of the edge between two vertices. It does not depend on their order.
inline uint64_t edgeKey(int32_t a, int32_t b) {
    return uint64_t(a < b ? a : b) << 32 | uint64_t(a < b ? b : a);
}

// Returns the interior angle of the face at each corner, radians. In [0, pi]: a reflex corner gets
// 2 pi minus its interior angle.
std::vector<float> cornerAngles(const Mesh& mesh);

// The light set of lights that belong to no light set. Their light counts only in the total. A
// light set is a named group of lights that has results of its own.
constexpr int32_t kNoLightSet = RB_NO_LIGHT_SET;

// An object: a mesh placed in the world. `transform` maps object space to world space (m); its last
// row is 0 0 0 1.
struct Instance {
    std::string name;
    // Id of a mesh of the scene.
    int32_t mesh = 0;
    glm::dmat4 transform{1.0};
    rb_role role = RB_ROLE_BAKE;
    // The side of the surface whose light is the result.
    rb_side side = RB_SIDE_FRONT;
    // The light set of the emission of the object.
    int32_t lightSet = kNoLightSet;
    bool stopsDirect = true;  // blocks the light of the sources
    bool exchanges = true;  // emits and reflects light to other surfaces, and blocks that of others
    // Factors on the target error of the light of the object, and on the edges of its patches.
    float noiseFactor = 1, patchFactor = 1;
    // If only some corners have a result: whether a vertex of the mesh has a corner with a result
    // (per vertex), and whether a face has such a vertex (per face). Empty if all corners have a
    // result.
    std::vector<uint8_t> resultVertices{}, resultFaces{};
    // Whether the corners with a result are few among all corners, as on a mesh that a modifier has
    // subdivided.
    bool hasSparseResults = false;
    // Whether the mesh has been adapted to the light of its patches, so that its vertices show what
    // the patches have got.
    bool isAdapted = false;

    // Returns whether the corners at a vertex of the mesh have a result.
    bool hasResultAtVertex(size_t vertex) const {
        return role == RB_ROLE_BAKE && (resultVertices.empty() || resultVertices[vertex]);
    }
    // Returns whether a face of the mesh has corners with a result.
    bool hasResultOnFace(size_t face) const {
        return role == RB_ROLE_BAKE && (resultFaces.empty() || resultFaces[face]);
    }

    // Returns whether the transform mirrors. Mirroring reverses the winding of faces, but the front
    // stays outside, as in Blender. A transform that flattens the mesh has a determinant that is
    // only rounding error, and does not count as mirroring.
    bool isMirrored() const {
        // Relative to the product of the lengths of the columns.
        constexpr double kFlat = 1e-9;
        const glm::dmat3 turn(transform);
        return glm::determinant(turn) <
               -kFlat * glm::length(turn[0]) * glm::length(turn[1]) * glm::length(turn[2]);
    }
};

// A point, spot, sun or area light in world space. Comments of members name the kinds that use
// them.
struct Light {
    enum class Kind { POINT, SUN, AREA };
    std::string name;
    Kind kind = Kind::POINT;
    // RGB. Radiant intensity (W/sr) of a POINT, irradiance at normal incidence (W/m^2) of a SUN,
    // radiance (W/(m^2 sr)) of an AREA.
    glm::dvec3 strength{0.0};
    glm::dvec3 position{0.0};  // POINT; AREA: its centre, m
    double radius = 0.0;       // POINT, m
    rb_point_shape pointShape = RB_POINT_DISK;
    glm::dvec3 direction{0.0, 0.0, 1.0};  // SUN: unit vector towards it
    double angle = 0.0;                   // SUN: full angular diameter, radians
    glm::dvec3 axisU{0.0}, axisV{0.0};  // AREA: half extents, m; shines towards cross(axisU, axisV)
    rb_area_shape areaShape = RB_AREA_RECTANGLE;
    double spread = glm::pi<double>();  // AREA: full opening angle, radians; keeps the power
    bool castsShadows = true;           // false: no surface blocks the light
    bool hasCone = false;               // POINT that is a spot light
    glm::dmat3 worldToCone{1.0};        // into the space in which the cone points along -Z
    double coneAngle = 0.0;             // full opening angle, radians
    double coneBlend = 0.0;             // share of the cone that is soft, 0 to 1
    bool coneDims = false;              // intensity is multiplied by the cosine to the axis
    int32_t lightSet = kNoLightSet;
};

// The radiance of the world by direction, W/(m^2 sr): an equirectangular image of linear RGB, in
// rows from the bottom to the top. The mapping is that of Cycles: the middle column is +X, the
// column at 3/4 of the width -Y, the top row +Z. Empty if the world has no image.
struct WorldImage {
    int width = 0;
    int height = 0;
    std::vector<glm::vec3> pixels;

    // Returns the mean radiance over all directions, W/(m^2 sr), or 0 without an image.
    glm::vec3 meanRadiance() const;
};

// The scene as the caller gave it, validated. It does not change during a bake. Owns all its
// objects; ids are indices in the vectors below.
class Scene {
  public:
    // Functions that add an object and return its id. Each throws Error(INVALID_ARGUMENT), with a
    // message that names the object, if the object cannot be used.
    //
    // Adds an image. Pixels that are negative or not finite become black.
    int32_t addImage(Image image);
    // Adds a material. Clamps reflectances to 0.999, with a warning if that changes one. Its images
    // must be added before.
    int32_t addMaterial(Material material);
    // Adds a mesh. Its materials must be added before.
    int32_t addMesh(Mesh mesh);
    // Adds an instance. Its mesh must be added before, and its transform must be finite.
    int32_t addInstance(Instance instance);
    // Adds a light, and normalises the direction of a SUN. Throws if the light reaches further than
    // kFarthest from the origin, or if its strength is above 1e15 (for an AREA: its strength times
    // the area of the parallelogram of axisU and axisV).
    int32_t addLight(Light light);
    // Sets the constant radiance of the world, W/(m^2 sr). Negative channels count as 0. Throws
    // Error(INVALID_ARGUMENT) if it is not finite or above 1e15.
    void setWorld(const glm::vec3& radiance);
    // Sets the radiance that the world adds by direction. Throws Error(INVALID_ARGUMENT) if the
    // image is empty, or a pixel is negative, not finite or above 1e15.
    void setWorldImage(WorldImage image);
    // Adds a light set and returns its id. Throws Error(INVALID_ARGUMENT) if the name is in use.
    int32_t addLightSet(std::string name);

    // Return the object of an id. Each throws Error(INVALID_ARGUMENT) if there is no such object.
    Mesh& mesh(int32_t id);
    Light& light(int32_t id);
    Instance& instance(int32_t id);
    // Sets which corners of the instance's mesh have a result. `corners` holds `count` indices of
    // corners. Throws Error(INVALID_ARGUMENT) for an unknown instance or corner.
    void setResultCorners(int32_t instance, const int32_t* corners, size_t count);
    // Returns the number of corners without a result, over all instances with role BAKE that have a
    // result at some corners only.
    size_t cornersWithoutResult() const;
    // Throws Error(INVALID_ARGUMENT) unless `id` is a light set or kNoLightSet.
    void checkLightSet(int32_t id) const;

    // Returns the constant radiance of the world that belongs to a light set, W/(m^2 sr): the
    // world's, or 0 if the world belongs to another one.
    glm::vec3 worldRadianceOf(int32_t lightSet) const {
        return worldLightSet == lightSet ? worldRadiance : glm::vec3(0.0f);
    }
    // Return the material of a face. It is a default grey without emission if the face has no
    // material.
    const Material& materialOf(const Mesh& mesh, size_t face) const;
    const Material& materialOf(size_t instance, size_t face) const {
        return materialOf(meshes[instances[instance].mesh], face);
    }

    // Returns whether any material emits light.
    bool emits() const {
        return std::any_of(materials.begin(), materials.end(),
                           [](const Material& material) { return material.emits(); });
    }

    std::vector<Image> images;
    std::vector<Material> materials;
    std::vector<Mesh> meshes;
    std::vector<Instance> instances;
    std::vector<Light> lights;
    glm::vec3 worldRadiance{0.0f};  // linear RGB, W/(m^2 sr)
    // Radiance by direction, added to worldRadiance.
    WorldImage worldImage;
    std::vector<std::string> lightSets;  // names
    // The light set of worldRadiance and worldImage.
    int32_t worldLightSet = kNoLightSet;
    Warnings warnings;  // changes that were made so that the scene can be used
};

}  // namespace raybundle
