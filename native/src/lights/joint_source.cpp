// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/joint_source.h"

#include <algorithm>
#include <limits>

namespace raybundle {

uint32_t JointSource::strongest() const {
    size_t best = 0;
    for (size_t k = 1; k < indices.size(); ++k)
        if (weightOf(k) > weightOf(best)) best = k;
    return indices[best];
}

LightSample JointSource::sample(const glm::vec3& point, const glm::vec3& normal,
                                glm::vec2 uv) const {
    const float at = uv.x * all();
    size_t k =
        size_t(std::upper_bound(weightUpTo.begin(), weightUpTo.end(), at) - weightUpTo.begin());
    k = std::min(k, indices.size() - 1);
    const float own = weightOf(k), from = weightUpTo[k] - own;
    uv.x = std::clamp((at - from) / own, 0.0f, 0.9999999f);
    LightSample sample = (*sources)[indices[k]]->sample(point, normal, uv);
    sample.irradiance *= all() / own;
    return sample;
}

float JointSource::distance(const glm::vec3& point) const {
    float least = std::numeric_limits<float>::infinity();
    for (const uint32_t index : indices)
        least = std::min(least, (*sources)[index]->distance(point));
    return least;
}

}  // namespace raybundle
