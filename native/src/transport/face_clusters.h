// SPDX-License-Identifier: GPL-3.0-or-later
//
// The irradiance that one side of a mesh of uneven emission, as of a screen with an image, gives
// without occluders: that of each face close by in closed form, and that of clusters of faces far
// away by the first moments of their light in each channel.
//
// Sources: Lambert's formula for polygons (transport/mesh_outline.h); clusters opened by their size
// over their distance: Barnes and Hut, "A hierarchical O(N log N) force-calculation algorithm"
// (1986).
// Differs:
// - A cluster is far only where the receiver looks at all of it and all of it at the receiver. The
//   product of the cosines over the square of the distance is then expanded to second order.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "patches/plane.h"
#include "transport/light_tree.h"

namespace raybundle {

class FaceClusters {
  public:
    FaceClusters() = default;
    // faces: in the order of a LightTree. Per face: its radiance, W/(m^2 sr), and its plane with
    // the normal where the light goes.
    FaceClusters(const std::vector<LightFace>& faces, const std::vector<glm::vec3>& radiance,
                 const std::vector<Plane>& planes);

    // Of more it is not worth its memory, about 1 kB a face.
    static constexpr size_t kMostFaces = 1 << 15;

    bool isEmpty() const { return nodes.empty(); }
    // At a point with a unit normal, W/m^2.
    glm::vec3 irradiance(const glm::vec3& point, const glm::vec3& normal) const;

  private:
    // Moments of the light of a cluster in one channel.
    struct DistantLight {
        glm::vec3 vector{0.0f};  // sum of radiance, area and normal, W/sr
        glm::vec3 middle{0.0f};  // of radiance times area, metres
        glm::mat3 spread{0.0f};  // mean product of what it is off the middle, m^2
        // Sum of radiance, area, and products of the normal and what it is off the middle, W m/sr:
        // zero if the cluster is flat.
        glm::mat3 bend{0.0f};

        // At a point with a unit normal, W/m^2.
        float irradiance(const glm::vec3& point, const glm::vec3& normal) const;
    };
    // Those of a cluster follow each other; of its two halves the first follows it.
    struct Node {
        glm::vec3 centre;                   // of a sphere around it, metres
        float radius;                       // metres
        glm::vec3 axis;                     // of the cone of normals
        float cosine, sine;                 // of half its opening
        uint32_t next;                      // node after all in this one
        uint32_t face;                      // of a cluster of one face; else kNoFace
        std::array<DistantLight, 3> light;  // by channel
    };
    static constexpr uint32_t kNoFace = ~0u;
    struct Face {
        std::array<glm::dvec3, 4> corners;  // a triangle's last one is not used
        int count;
        glm::vec3 radiance;
        Plane plane;
    };
    void build(const std::vector<LightFace>& faces, const std::vector<glm::vec3>& radiance,
               uint32_t first, uint32_t count);

    std::vector<Node> nodes;
    std::vector<Face> shapes;
};

}  // namespace raybundle
