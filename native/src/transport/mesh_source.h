// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "transport/light_source.h"

namespace raybundle {

// The emissive faces of one object and material. Where emission or opacity varies between patches,
// points are chosen by the power of patches and there is no closed form.
class MeshSource : public LightSource {
  public:
    // parents: into Patches::parents; emission: of their front and back, W/m^2. `patches` must
    // outlive it. Where they vary, sideEmission holds the emission per side of all patches, W/m^2
    // of the whole patch, and must outlive it too.
    MeshSource(const Patches& patches, std::vector<uint32_t> parents,
               const std::array<glm::vec3, 2>& emission,
               const std::vector<glm::vec3>* sideEmission = nullptr);

    LightSample sample(const glm::vec3& point, const glm::vec3& receiver,
                       glm::vec2 uv) const override;
    std::optional<glm::vec3> irradiance(const glm::vec3& point,
                                        const glm::vec3& receiver) const override;
    bool isOutOfSight(const glm::vec3& point, const glm::vec3& receiver,
                      float radius) const override;
    float distance(const glm::vec3& point) const override {
        return glm::length(centre - point) - extent;
    }
    glm::vec3 power() const override { return totalPower; }
    EmittedRay emit(const glm::vec4& u, float sceneRadius) const override;

  private:
    glm::vec3 outlineIrradiance(const glm::vec3& point, const glm::vec3& receiver) const;
    void boundSource();
    void findOutline();
    struct SurfacePoint {
        glm::vec3 position, normal;
        uint32_t parent;
        std::optional<uint32_t> side;  // where it is chosen by power
        float area;                    // over the probability of the point: m^2 that it stands for
    };
    SurfacePoint onSurface(glm::vec2 uv) const;
    SurfacePoint onParents(glm::vec2 uv) const;
    glm::vec3 emissionOf(uint32_t patch, int k) const;
    glm::vec3 emissionAt(const SurfacePoint& on, int k) const;
    void chooseByPower();

    const Patches& patches;
    const std::vector<uint32_t> parents;
    const std::array<glm::vec3, 2> emission;  // W/m^2, front and back; most where it varies
    const std::vector<glm::vec3>* const sideEmission;  // where it varies
    std::vector<uint32_t> shining;                     // sides, where it varies
    std::vector<double> powerUpTo;                     // of them, cumulative, W
    glm::vec3 totalPower{0.0f};                        // W
    std::vector<double> areaUpTo;                      // per parent, cumulative, m^2
    double total = 0;                                  // m^2
    glm::vec3 centre{0.0f}, planeNormal{0.0f};
    float extent = 0;  // radius of a sphere around centre, metres
    bool isPlanar = false;
    std::vector<std::pair<glm::dvec3, glm::dvec3>> outline;  // of a planar source, if short
};

}  // namespace raybundle
