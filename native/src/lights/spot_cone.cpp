// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/spot_cone.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

constexpr int kGrid = 64;        // grid points per axis for the mean over a deformed cone
constexpr int kBisections = 40;  // steps to invert the integral of the share
// A rim is steep if its width is smaller than this share of the patch. A quadrature with 8 points
// along the patch then has fewer than two in the rim.
constexpr double kSteep = 0.25;

}  // namespace

SpotCone::SpotCone(const Light& light)
    : toLocal(light.worldToCone),
      fromLocal(glm::inverse(light.worldToCone)),
      edge(std::cos(0.5 * light.coneAngle)),
      soft((1 - edge) * light.coneBlend),
      dims(light.coneDims) {
    total = integral(1);
    if (!(total > 0) || glm::determinant(toLocal) == 0) return;  // the lamp emits nothing
    double sum = 0, low = INFINITY, high = 0;
    for (int i = 0; i < kGrid; ++i)
        for (int j = 0; j < kGrid; ++j) {
            const double s = stretch(local((glm::vec2(i, j) + 0.5f) / float(kGrid)));
            sum += s;
            low = std::min(low, s);
            high = std::max(high, s);
        }
    meanStretch = sum / (kGrid * kGrid);
    isDeformed = high > (1 + 1e-5) * low;
    mean = float(0.5 * total * meanStretch);
}

float SpotCone::share(const glm::vec3& direction) const {
    return float(shareAt(-glm::normalize(toLocal * glm::dvec3(direction)).z));
}

bool SpotCone::isSteepBetween(const std::array<glm::dvec3, 4>& corners) const {
    // A cone that dims to nothing at its rim has no edge there.
    if (dims && edge <= 0 && soft == 0) return false;
    glm::dvec3 sum(0.0), directions[4];
    for (size_t k = 0; k < 4; ++k) {
        const glm::dvec3 place = toLocal * corners[k];
        directions[k] = glm::normalize(place);
        sum += place;
    }
    // In the cone's own space the patch is flat too, so that no direction to it is further from
    // that to its middle than those to its corners.
    const glm::dvec3 middle = glm::normalize(sum);
    double reach = 0;
    for (const glm::dvec3& d : directions)
        reach = std::max(reach, std::acos(std::clamp(glm::dot(d, middle), -1.0, 1.0)));
    const double angle = std::acos(std::clamp(-middle.z, -1.0, 1.0));
    const double least = std::cos(std::min(angle + reach, glm::pi<double>()));
    const double most = std::cos(std::max(angle - reach, 0.0));
    return least < edge + soft && most > edge && soft < kSteep * (most - least);
}

double SpotCone::shareAt(double cosine) const {
    if (cosine <= edge) return 0;
    const double t = soft > 0 ? std::min(1.0, (cosine - edge) / soft) : 1;
    return t * t * (3 - 2 * t) * (dims ? std::max(0.0, cosine) : 1);
}

// Returns the integral of the share over the cosine to the axis, from the rim to `cosine`.
double SpotCone::integral(double cosine) const {
    auto primitive = [&](double z) {
        const double t = soft > 0 ? std::clamp((z - edge) / soft, 0.0, 1.0) : 0;
        const double full = edge + soft;  // from this cosine on the light has its full strength
        const double t3 = t * t * t, flat = t3 * (1 - 0.5 * t);
        if (!dims) return soft * flat + std::max(0.0, z - full);
        const double sloped = t3 * t * (0.75 - 0.4 * t);
        return soft * (edge * flat + soft * sloped) + 0.5 * std::max(0.0, z * z - full * full);
    };
    const double least = dims ? std::max(edge, 0.0) : edge;
    return cosine > least ? primitive(cosine) - primitive(least) : 0;
}

// Samples a direction in proportion to the share, in the cone's own space, whose axis is -z.
glm::dvec3 SpotCone::local(glm::vec2 uv) const {
    const glm::dvec2 d(onDisk(uv));
    const double r2 = glm::dot(d, d), wanted = (1 - r2) * total;
    double low = edge, high = 1;
    for (int k = 0; k < kBisections; ++k) {
        const double middle = 0.5 * (low + high);
        (integral(middle) < wanted ? low : high) = middle;
    }
    const double z = 0.5 * (low + high);
    const double scale = r2 > 0 ? std::sqrt(std::max(0.0, 1 - z * z) / r2) : 0;
    return {scale * d.x, scale * d.y, -z};
}

// Returns the ratio of a solid angle in world space to the corresponding one in the cone's space.
double SpotCone::stretch(const glm::dvec3& local) const {
    return std::abs(glm::determinant(fromLocal)) / std::pow(glm::length(fromLocal * local), 3);
}

SpotCone::Ray SpotCone::emit(glm::vec2 uv) const {
    const glm::dvec3 drawn = local(uv);
    return {glm::vec3(glm::normalize(fromLocal * drawn)),
            isDeformed ? float(stretch(drawn) / meanStretch) : 1.0f};
}

}  // namespace raybundle
