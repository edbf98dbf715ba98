// SPDX-License-Identifier: GPL-3.0-or-later
//
// The irradiance that one side of a mesh of uneven emission, as of a screen with an image, gives
// without occluders: that of each face close by in closed form, and that of clusters of faces far
// away by the first moments of their light in each channel.
//
// Sources: Lambert's formula for polygons (lights/mesh_outline.h); clusters opened by their size
// over their distance: Barnes and Hut, "A hierarchical O(N log N) force-calculation algorithm"
// (1986).
// Differs:
// - A cluster is far only where the receiver looks at all of it and all of it at the receiver. The
//   product of the cosines over the square of the distance is then expanded to second order.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "lights/light_tree.h"

namespace raybundle {

class FaceClusters {
  public:
    FaceClusters() = default;
    // faces: in the order of the tree. Per face: its radiance, W/(m^2 sr).
    FaceClusters(const LightTree& tree, const std::vector<LightFace>& faces,
                 const std::vector<glm::vec3>& radiance);

    // Of more it is not worth its memory, about 600 bytes a face.
    static constexpr size_t kMostFaces = 1 << 15;

    bool isEmpty() const { return light.empty(); }
    // At a point with a unit normal, W/m^2. ofFace: that of one face, which is close by.
    glm::vec3 irradiance(const LightTree& tree, const glm::vec3& point, const glm::vec3& normal,
                         const std::function<glm::vec3(uint32_t face)>& ofFace) const;

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
    std::vector<std::array<DistantLight, 3>> light;  // per cluster of the tree, by channel
};

}  // namespace raybundle
