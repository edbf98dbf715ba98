// SPDX-License-Identifier: GPL-3.0-or-later
//
// The fronts or the backs of the emissive faces of one object and material as a source of light.
// What a receiver gets without occluders has a closed form (lights/mesh_outline.h) or, where the
// emission varies, nearly one (lights/face_clusters.h); which of it is seen, samples tell, whose
// faces are chosen by a tree (lights/light_tree.h).
#pragma once

#include <optional>
#include <vector>

#include "lights/enclosing.h"
#include "lights/face_clusters.h"
#include "lights/light_source.h"
#include "lights/light_tree.h"
#include "lights/mesh_outline.h"

namespace raybundle {

// The faces of one source.
struct EmissiveFaces {
    std::vector<uint32_t> parents;  // into Patches::parents
    uint32_t back = 0;              // 0: their fronts, 1: their backs
    glm::vec3 emission{0.0f};       // of those, W/m^2; where it varies, the most of it
    // Where the emission varies: per side of all patches, W/m^2 of the whole patch; else null.
    const std::vector<glm::vec3>* sideEmission = nullptr;
    Extent whole{};           // what the faces are part of
    bool isEnclosed = false;  // their light does not get out of that
    // What sides send towards a direction beyond that, where the emission varies; or null.
    const DirectedEmission* directed = nullptr;
};

class MeshSource : public LightSource {
  public:
    // `patches` and what `own` points to must outlive the object.
    MeshSource(const Patches& patches, const EmissiveFaces& own);

    LightSample sample(const glm::vec3& point, const glm::vec3& receiver,
                       glm::vec2 uv) const override;
    std::optional<glm::vec3> irradiance(const glm::vec3& point,
                                        const glm::vec3& receiver) const override;
    // By clusters a point takes as long as many shadow rays.
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
    // Of a side of the source, W/m^2.
    glm::vec3 emissionOf(uint32_t side) const {
        return sideEmission ? (*sideEmission)[side] : emission;
    }

    // By channel: what a side of the source sends towards a direction away from it over what it
    // sends in the mean.
    glm::vec3 shareTowards(uint32_t side, const glm::vec3& direction) const;

    const Patches& patches;
    const glm::vec3 emission;                          // W/m^2
    const std::vector<glm::vec3>* const sideEmission;  // where it varies
    const Extent whole;
    const bool isEnclosed;
    const DirectedEmission* const directed;
    glm::vec3 totalPower{0.0f};  // W
    glm::vec3 centre{0.0f};
    float extent = 0;        // radius of a sphere around centre, metres
    double wholeExtent = 0;  // of one around what it is part of
    // Sides of parents, or of patches where the emission varies; in the tree's order.
    std::vector<LightFace> faces;
    // Per face: what its samples need and its corners give.
    struct FaceShape {
        Plane plane;
        glm::vec3 middle;
        glm::vec3 radiance;  // W/(m^2 sr)
        float area;          // m^2
        float nearSquare;    // of the distance from the middle below which it is near, m^2
        // A point is in front for certain where the square of its height is larger than the first
        // and so many times the square of its distance from the middle, m^2 and 1.
        float clearSquare, clearSlope;
        uint32_t parent;  // into Patches::parents

        // Of a point at about that height over the plane, and square of the distance from the
        // middle, metres and m^2.
        bool isBefore(const glm::vec3& point, float height, float distance2) const {
            return (height > 0 && height * height > clearSquare + clearSlope * distance2) ||
                   plane.side(point) == PlaneSide::FRONT;
        }
    };
    FaceShape shapeOf(const LightFace& face) const;
    std::vector<glm::vec3> radiances() const;  // per face, W/(m^2 sr)
    // That of one face in closed form, W/m^2.
    glm::vec3 irradianceOf(uint32_t face, const glm::vec3& point, const glm::vec3& receiver) const;
    std::vector<FaceShape> shapes;
    LightTree tree;
    MeshOutline outline;    // where the emission is even
    FaceClusters clusters;  // where it varies
};

}  // namespace raybundle
