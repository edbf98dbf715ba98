// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sun lamps: disks of the sky, infinitely far away.
#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>

#include "lights/lamps.h"
#include "lights/receiver_place.h"
#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

class SunSource : public LightSource {
  public:
    explicit SunSource(const Light& light)
        : direction(light.direction),
          strength(light.strength),
          half(float(0.5 * light.angle)),
          cosHalf(std::cos(half)),
          sinHalf(std::sin(half)) {}

    LightSample sample(const glm::vec3&, const glm::vec3& normal, glm::vec2 uv) const override {
        LightSample sample;
        sample.distance = std::numeric_limits<float>::infinity();
        sample.direction = half > 0 ? inCone(direction, cosHalf, uv) : direction;
        // Radiance E / (pi sin^2 half) times the solid angle 2 pi (1 - cos half) of the disk.
        sample.irradiance =
            strength * perCosine() * std::max(0.0f, glm::dot(normal, sample.direction));
        return sample;
    }

    std::optional<glm::vec3> irradiance(const glm::vec3&, const glm::vec3& normal) const override {
        const float c = glm::dot(normal, direction);
        // The closed form holds if the disk is wholly above or wholly below the horizon. Other
        // disks are sampled.
        if (c >= sinHalf) return strength * c;
        if (c <= -sinHalf) return glm::vec3(0.0f);
        return std::nullopt;
    }

    bool isOutOfSight(const ReceiverPlace& place) const override {
        return glm::dot(place.normal, direction) <= -sinHalf;
    }

    float distance(const glm::vec3&) const override {
        return std::numeric_limits<float>::infinity();
    }

    glm::vec3 power() const override { return glm::vec3(0.0f); }

    // Parallel rays of each direction start from a disk that covers the scene.
    glm::vec3 shootingPower(float sceneRadius) const override {
        const float r = kCover * sceneRadius;
        return strength * (perCosine() * glm::pi<float>() * r * r);
    }

    EmittedRay emit(const glm::vec4& u, float sceneRadius) const override {
        EmittedRay ray;
        const glm::vec3 towards = half > 0 ? inCone(direction, cosHalf, {u.x, u.y}) : direction;
        const auto [x, y] = frame(towards);
        const glm::vec2 d = onDisk({u.z, u.w});
        ray.origin = kCover * sceneRadius * (towards + d.x * x + d.y * y);
        ray.direction = -towards;
        return ray;
    }

  private:
    // Radius of the disk that rays start from, in radii of the scene.
    static constexpr float kCover = 1.001f;

    // Returns the radiance times the solid angle of the disk, relative to the irradiance on a plane
    // that faces its middle.
    float perCosine() const { return half > 0 ? 2 / (1 + cosHalf) : 1; }

    const glm::vec3 direction, strength;
    const float half;  // angular radius, radians
    const float cosHalf, sinHalf;
};

}  // namespace

std::unique_ptr<LightSource> sunSource(const Light& light, const glm::dvec3& /*centre*/) {
    return std::make_unique<SunSource>(light);
}

}  // namespace raybundle
