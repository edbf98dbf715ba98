// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "raybundle/raybundle.h"

namespace raybundle {

// Light at the corners of a mesh.
struct CornerLight {
    std::vector<glm::vec3> direct, indirect;  // per corner, irradiance, W/m^2
    std::vector<glm::vec3> exitance;          // per corner, emission included, W/m^2

    // Radiance, W/(m^2 sr), of an output, per corner.
    std::vector<glm::vec3> perCorner(rb_output output) const;
    void add(const CornerLight& other);
};

// The light of one instance, as the caller gets it: that of all light sources, the sum of what each
// light set and the sources of none give.
struct InstanceLight : CornerLight {
    std::string name;
    bool isBaked = false;
    std::vector<int32_t> cornerVertices;
    size_t vertexCount = 0;
    std::vector<float> cornerAngles;  // radians, weights of the mean at a vertex
    std::vector<CornerLight> sets;    // per light set of the scene
    std::vector<float> error;         // per corner, W/(m^2 sr), see rb_get_corner_error
    // Of sparse results that corners gathered: the noise of their rays, relative to the RMS.
    std::optional<float> gatheredNoise{};

    // An output of this or of a set, per vertex: the mean of its corners, weighted by their angles.
    std::vector<glm::vec3> perVertex(rb_output output) const { return perVertex(*this, output); }
    std::vector<glm::vec3> perVertex(const CornerLight& light, rb_output output) const;
};

}  // namespace raybundle
