// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "raybundle/raybundle.h"

namespace raybundle {

// The light at the corners of a mesh, by all light sources or by one light set.
struct CornerLight {
    std::vector<glm::vec3> direct, indirect;  // per corner, irradiance, W/m^2
    std::vector<glm::vec3> exitance;          // per corner, with emission, W/m^2

    // Returns the radiance of an output per corner, W/(m^2 sr). Throws Error(INVALID_ARGUMENT) if
    // there is no such output.
    std::vector<glm::vec3> perCorner(rb_output output) const;
    // Adds the light of `other`, which must have as many corners.
    void add(const CornerLight& other);
};

// The light of one instance, as the caller gets it. The inherited fields hold the light of all
// sources: the sum of the light sets and of the sources in no set. The fields per corner are empty
// for an instance that was not reconstructed.
struct InstanceLight : CornerLight {
    std::string name;
    bool isBaked = false;
    // The vertex of each corner.
    std::vector<int32_t> cornerVertices;
    size_t vertexCount = 0;
    std::vector<float> cornerAngles;  // per corner, radians; weights of the mean at a vertex
    std::vector<CornerLight> sets;    // per light set of the scene
    std::vector<float> error;         // per corner, W/(m^2 sr), see rb_get_corner_error
    // For light that corners gathered, of sparse results and on dense surfaces: the noise of the
    // rays of these corners, relative to the RMS of the light. Otherwise empty.
    std::optional<float> gatheredNoise{};
    // If gatheredNoise is set: the error of light that was gathered at some places and interpolated
    // at others, relative to the RMS of the light.
    float gatheredSurplus = 0;

    // Return an output of the light of all sources or of the given light, per vertex, W/(m^2 sr).
    // The value is the mean of the vertex's corners, weighted by their angles; 0 if the vertex has
    // no corners. `light` must have the corners of this instance.
    std::vector<glm::vec3> perVertex(rb_output output) const { return perVertex(*this, output); }
    std::vector<glm::vec3> perVertex(const CornerLight& light, rb_output output) const;
};

// Returns the light of an instance with role BAKE. Throws Error(INVALID_ARGUMENT) if there is no
// such instance or it has another role.
const InstanceLight& bakedInstance(const std::vector<InstanceLight>& light, int32_t instance);

}  // namespace raybundle
