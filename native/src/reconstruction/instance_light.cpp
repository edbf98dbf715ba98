// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/instance_light.h"

#include <glm/gtc/constants.hpp>

#include "job/error.h"

namespace raybundle {

std::vector<glm::vec3> CornerLight::perCorner(rb_output output) const {
    std::vector<glm::vec3> radiance(direct.size());
    for (size_t c = 0; c < radiance.size(); ++c) {
        glm::vec3 perArea(0.0f);
        switch (output) {
            case RB_OUTPUT_COMBINED:
                perArea = exitance[c];
                break;
            case RB_OUTPUT_LIGHTING:
                perArea = direct[c] + indirect[c];
                break;
            case RB_OUTPUT_DIRECT:
                perArea = direct[c];
                break;
            case RB_OUTPUT_INDIRECT:
                perArea = indirect[c];
                break;
            default:
                throw invalidArgument("there is no output " + std::to_string(int(output)));
        }
        radiance[c] = perArea / glm::pi<float>();
    }
    return radiance;
}

void CornerLight::add(const CornerLight& other) {
    for (size_t c = 0; c < direct.size(); ++c) {
        direct[c] += other.direct[c];
        indirect[c] += other.indirect[c];
        exitance[c] += other.exitance[c];
    }
}

std::vector<glm::vec3> InstanceLight::perVertex(const CornerLight& light, rb_output output) const {
    const std::vector<glm::vec3> corners = light.perCorner(output);
    std::vector<glm::vec3> vertices(vertexCount, glm::vec3(0.0f));
    std::vector<float> weights(vertexCount, 0.0f);
    for (size_t c = 0; c < corners.size(); ++c) {
        vertices[size_t(cornerVertices[c])] += cornerAngles[c] * corners[c];
        weights[size_t(cornerVertices[c])] += cornerAngles[c];
    }
    for (size_t v = 0; v < vertices.size(); ++v)
        if (weights[v] > 0) vertices[v] /= weights[v];
    return vertices;
}

const InstanceLight& bakedInstance(const std::vector<InstanceLight>& light, int32_t instance) {
    if (instance < 0 || size_t(instance) >= light.size())
        throw invalidArgument("there is no instance " + std::to_string(instance));
    const InstanceLight& found = light[size_t(instance)];
    if (!found.isBaked)
        throw invalidArgument("object \"" + found.name +
                              "\" has the role OCCLUDE, so that it has no result");
    return found;
}

}  // namespace raybundle
