// SPDX-License-Identifier: GPL-3.0-or-later
//
// The fronts or the backs of the emissive faces of one object and material as a light source. The
// irradiance without occluders has a closed form (lights/mesh_outline.h), or an approximation where
// the emission varies (lights/face_clusters.h). Shadow rays to sampled points find which part of
// the source is visible. The faces to sample are chosen by a tree (lights/light_tree.h).
#pragma once

#include <optional>
#include <vector>

#include "lights/enclosing.h"
#include "lights/face_clusters.h"
#include "lights/light_source.h"
#include "lights/light_tree.h"
#include "lights/mesh_outline.h"

namespace raybundle {

// The faces of one source. Pointers are not owned.
struct EmissiveFaces {
    std::vector<uint32_t> parents;  // indices into Patches::parents
    uint32_t back = 0;              // 0: the fronts of the faces emit, 1: the backs
    glm::vec3 emission{0.0f};       // exitance of these sides, W/m^2; the maximum if it varies
    // If the emission varies: exitance per patch side, averaged over the whole patch, W/m^2.
    // Otherwise null.
    const std::vector<glm::vec3>* sideEmission = nullptr;
    Extent whole{};           // box of the surfaces that the faces belong to
    bool isEnclosed = false;  // whether their light does not leave these surfaces
    // Dependence of the emission on the direction, or null. Only together with `sideEmission`.
    const DirectedEmission* directed = nullptr;
};

// A light source made of the sides of emissive faces.
class MeshSource : public LightSource {
  public:
    // `patches` and the objects that `own` points to must outlive the source.
    MeshSource(const Patches& patches, const EmissiveFaces& own);

    LightSample sample(const glm::vec3& point, const glm::vec3& receiver,
                       glm::vec2 uv) const override;
    std::optional<glm::vec3> irradiance(const glm::vec3& point,
                                        const glm::vec3& receiver) const override;
    // The clusters take as long for one point as many shadow rays, so the closed form is evaluated
    // at one point for larger patches.
    float farPatch() const override { return clusters.isEmpty() ? LightSource::farPatch() : 0.1f; }
    bool staysInside() const override { return isEnclosed; }
    bool isOutOfSight(const ReceiverPlace& place) const override;
    float distance(const glm::vec3& point) const override {
        return glm::length(centre - point) - extent;
    }
    glm::vec3 power() const override { return totalPower; }
    EmittedRay emit(const glm::vec4& u, float sceneRadius) const override;

  private:
    void boundSource(const std::vector<uint32_t>& parents);
    void collectFaces(const std::vector<uint32_t>& parents, uint32_t back);
    // Returns the exitance of a side of the source, W/m^2.
    glm::vec3 emissionOf(uint32_t side) const {
        return sideEmission ? (*sideEmission)[side] : emission;
    }

    // Returns the exitance of a side towards a direction (unit, away from the side) relative to the
    // mean over all directions, by channel.
    glm::vec3 shareTowards(uint32_t side, const glm::vec3& direction) const;

    const Patches& patches;
    const glm::vec3 emission;                          // W/m^2
    const std::vector<glm::vec3>* const sideEmission;  // null: the emission is even
    const Extent whole;
    const bool isEnclosed;
    const DirectedEmission* const directed;
    glm::vec3 totalPower{0.0f};  // W
    glm::vec3 centre{0.0f};
    float extent = 0;        // radius of a sphere around `centre` that contains the faces, metres
    double wholeExtent = 0;  // radius of a sphere that contains `whole`, metres
    // Sides of parents, or of patches if the emission varies, in the order of the tree.
    std::vector<LightFace> faces;
    // The data of one face that its samples need, computed from its corners.
    struct FaceShape {
        Plane plane;
        glm::vec3 middle;
        glm::vec3 radiance;  // W/(m^2 sr)
        float area;          // m^2
        float nearSquare;    // squared distance from the middle below which the face is near, m^2
        // A point is certainly in front of the face if the square of its height exceeds clearSquare
        // (m^2) plus clearSlope (no unit) times its squared distance from the middle.
        float clearSquare, clearSlope;
        uint32_t parent;  // index into Patches::parents

        // Returns whether a point is in front of the face. `height` is the approximate height over
        // the plane in metres, `distance2` the squared distance from the middle in m^2.
        bool isBefore(const glm::vec3& point, float height, float distance2) const {
            return (height > 0 && height * height > clearSquare + clearSlope * distance2) ||
                   plane.side(point) == PlaneSide::FRONT;
        }
    };
    FaceShape shapeOf(const LightFace& face) const;
    std::vector<glm::vec3> radiances() const;  // per face, W/(m^2 sr)
    // Returns the irradiance from one face in closed form, W/m^2.
    glm::vec3 irradianceOf(uint32_t face, const glm::vec3& point, const glm::vec3& receiver) const;
    std::vector<FaceShape> shapes;
    // One per face.
    LightTree tree;
    MeshOutline outline;    // used if the emission is even
    FaceClusters clusters;  // used if the emission varies
};

}  // namespace raybundle
