// SPDX-License-Identifier: GPL-3.0-or-later
//
// The irradiance without occluders from one side of a mesh of uneven emission, such as a screen
// with an image. Faces close by use the closed form. Far clusters of faces use the first moments of
// their light in each channel.
//
// Sources: Lambert's formula for polygons (lights/mesh_outline.h); clusters that are opened by the
// ratio of their size to their distance: Barnes and Hut, "A hierarchical O(N log N)
// force-calculation algorithm" (1986).
// Differs:
// - A cluster counts as far only if the whole cluster is above the receiver's horizon and all its
//   faces are turned towards the receiver. The product of the cosines divided by the squared
//   distance is then expanded to second order.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "lights/light_tree.h"

namespace raybundle {

// The light of the clusters of a LightTree. Empty if default-constructed.
class FaceClusters {
  public:
    FaceClusters() = default;
    // `faces` must be in the order of the tree. `radiance` is per face and channel, W/(m^2 sr).
    FaceClusters(const LightTree& tree, const std::vector<LightFace>& faces,
                 const std::vector<glm::vec3>& radiance);

    // Largest number of faces for which the class is worth its memory, about 600 bytes per face.
    static constexpr size_t kMostFaces = 1 << 15;

    bool isEmpty() const { return light.empty(); }
    // Returns the irradiance at a point with a unit normal, W/m^2. `tree` must be that of the
    // constructor. `ofFace` returns the irradiance from one face, and is called for faces close by.
    glm::vec3 irradiance(const LightTree& tree, const glm::vec3& point, const glm::vec3& normal,
                         const std::function<glm::vec3(uint32_t face)>& ofFace) const;

  private:
    // Moments of the light of a cluster in one channel.
    struct DistantLight {
        glm::vec3 vector{0.0f};  // sum of radiance * area * normal, W/sr
        glm::vec3 middle{0.0f};  // mean position, weighted by radiance times area, metres
        glm::mat3 spread{0.0f};  // mean outer product of the offset from `middle` with itself, m^2
        // Sum of radiance * area * (outer product of the normal and the offset from `middle`), W
        // m/sr. Zero if the cluster is flat.
        glm::mat3 bend{0.0f};

        // Returns the irradiance at a point with a unit normal, W/m^2.
        float irradiance(const glm::vec3& point, const glm::vec3& normal) const;
    };
    std::vector<std::array<DistantLight, 3>> light;  // per cluster of the tree, by channel
};

}  // namespace raybundle
