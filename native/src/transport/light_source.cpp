// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/light_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <map>

#include "transport/mesh_source.h"
#include "transport/sphere_sampling.h"

namespace raybundle {

LightSample surfaceSample(const glm::vec3& point, const glm::vec3& normal, const glm::vec3& on,
                          const glm::vec3& onNormal, const glm::vec3& radiance, float area) {
    LightSample sample;
    const glm::vec3 d = on - point;
    const float distance2 = glm::dot(d, d);
    if (distance2 <= 0) return sample;
    sample.distance = std::sqrt(distance2);
    sample.direction = d / sample.distance;
    const float cosReceiver = glm::dot(normal, sample.direction);
    const float cosSource = -glm::dot(onNormal, sample.direction);
    if (cosReceiver > 0 && cosSource > 0)
        sample.irradiance = radiance * (area * cosReceiver * cosSource / distance2);
    return sample;
}

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
class PointSource : public LightSource {
  public:
    PointSource(const Light& light, const glm::dvec3& centre)
        : light(light), position(light.position - centre), intensity(light.strength) {
        meanCone = meanOverSphere();
        if (light.radius == 0 || light.pointShape == RB_POINT_SPHERE)
            totalPower = 2 * glm::two_pi<float>() * intensity * meanCone;
    }

    LightSample sample(const glm::vec3& point, const glm::vec3& normal,
                       glm::vec2 uv) const override {
        const glm::vec3 towards = position - point;
        const float distance2 = glm::dot(towards, towards);
        const float radius = float(light.radius);
        LightSample sample;
        if (distance2 <= 0) return sample;
        if (radius > 0 && light.pointShape == RB_POINT_SPHERE && distance2 <= radius * radius)
            return sample;  // inside the sphere
        const float distance = std::sqrt(distance2);
        const glm::vec3 axis = towards / distance;
        if (radius == 0) {
            sample.direction = axis;
            sample.distance = distance;
            sample.irradiance = intensity * std::max(0.0f, glm::dot(normal, axis)) / distance2;
        } else if (light.pointShape == RB_POINT_DISK) {
            // Disk of radius r facing the receiver with radiance I / (pi r^2).
            const auto [x, y] = frame(axis);
            const glm::vec2 d = radius * onDisk(uv);
            sample = surfaceSample(point, normal, position + d.x * x + d.y * y, -axis,
                                   intensity / (glm::pi<float>() * radius * radius),
                                   glm::pi<float>() * radius * radius);
        } else {
            // Uniform direction in the cone that the sphere of the same radiance fills.
            const float cosMax = std::sqrt(std::max(0.0f, 1 - radius * radius / distance2));
            const float solidAngle =
                glm::two_pi<float>() * (radius * radius / distance2) / (1 + cosMax);
            sample.direction = inCone(axis, cosMax, uv);
            const float b = distance * glm::dot(axis, sample.direction);
            const float inside = radius * radius - distance2 + b * b;
            sample.distance = b - std::sqrt(std::max(0.0f, inside));
            sample.irradiance = intensity / (glm::pi<float>() * radius * radius) * solidAngle *
                                std::max(0.0f, glm::dot(normal, sample.direction));
        }
        sample.irradiance *= cone(-sample.direction);
        return sample;
    }

    std::optional<glm::vec3> irradiance(const glm::vec3&, const glm::vec3&) const override {
        return std::nullopt;  // a sample is as good
    }

    bool isOutOfSight(const glm::vec3& point, const glm::vec3& normal,
                      float radius) const override {
        return glm::dot(normal, position - point) < -(radius + float(light.radius));
    }

    float distance(const glm::vec3& point) const override {
        return glm::length(position - point) - float(light.radius);
    }

    glm::vec3 power() const override { return totalPower; }

    EmittedRay emit(const glm::vec4& u) const override {
        EmittedRay ray;
        ray.origin = position;
        ray.direction = uniformDirection(glm::vec2(u));
        ray.weight = cone(ray.direction) / meanCone;
        return ray;
    }

    static glm::vec3 inCone(const glm::vec3& axis, float cosMax, glm::vec2 uv) {
        const glm::vec2 d = onDisk(uv);
        const float r2 = glm::dot(d, d);
        const float z = 1 - r2 * (1 - cosMax);
        const float scale = r2 > 0 ? std::sqrt(std::max(0.0f, 1 - z * z) / r2) : 0;
        const auto [x, y] = frame(axis);
        return scale * (d.x * x + d.y * y) + z * axis;
    }

  private:
    // Share of the intensity that a spot sends in a direction away from it (Blender's smoothstep).
    float cone(const glm::vec3& direction) const {
        if (!light.hasCone) return 1;
        const glm::dvec3 local = glm::normalize(light.worldToCone * glm::dvec3(direction));
        const double edge = std::cos(0.5 * light.coneAngle);
        const double soft = (1 - edge) * light.coneBlend;
        if (-local.z <= edge) return 0;
        const double t = soft > 0 ? std::min(1.0, (-local.z - edge) / soft) : 1;
        return float(t * t * (3 - 2 * t) * (light.coneDims ? std::max(0.0, -local.z) : 1));
    }

    // Mean of the cone over all directions.
    float meanOverSphere() const {
        if (!light.hasCone) return 1;
        // Midpoint rule over the sphere; only the power balance needs it.
        constexpr int kSteps = 64;
        float sum = 0;
        for (int i = 0; i < kSteps; ++i)
            for (int j = 0; j < kSteps; ++j)
                sum += cone(uniformDirection((glm::vec2(i, j) + 0.5f) / float(kSteps)));
        return sum / (kSteps * kSteps);
    }

    const Light& light;
    const glm::vec3 position;
    const glm::vec3 intensity;
    float meanCone = 1;
    glm::vec3 totalPower{0.0f};
};

class SunSource : public LightSource {
  public:
    explicit SunSource(const Light& light)
        : direction(light.direction), strength(light.strength), half(float(0.5 * light.angle)) {}

    LightSample sample(const glm::vec3&, const glm::vec3& normal, glm::vec2 uv) const override {
        LightSample sample;
        sample.distance = kInfinity;
        const float cosMax = std::cos(half);
        sample.direction = half > 0 ? PointSource::inCone(direction, cosMax, uv) : direction;
        // Radiance E / (pi sin^2 half) over the solid angle 2 pi (1 - cos half).
        const float perCosine = half > 0 ? 2 / (1 + cosMax) : 1;
        sample.irradiance =
            strength * perCosine * std::max(0.0f, glm::dot(normal, sample.direction));
        return sample;
    }

    std::optional<glm::vec3> irradiance(const glm::vec3&, const glm::vec3& normal) const override {
        const float c = glm::dot(normal, direction);
        // Wholly above or wholly below the horizon; in between it is sampled.
        if (c >= std::sin(half)) return strength * c;
        if (c <= -std::sin(half)) return glm::vec3(0.0f);
        return std::nullopt;
    }

    bool isOutOfSight(const glm::vec3&, const glm::vec3& normal, float) const override {
        return glm::dot(normal, direction) <= -std::sin(half);
    }

    float distance(const glm::vec3&) const override { return kInfinity; }

    glm::vec3 power() const override { return glm::vec3(0.0f); }
    EmittedRay emit(const glm::vec4&) const override { return {}; }

  private:
    const glm::vec3 direction, strength;
    const float half;  // angular radius
};

class AreaSource : public LightSource {
  public:
    AreaSource(const Light& light, const glm::dvec3& centre)
        : position(light.position - centre),
          u(light.axisU),
          v(light.axisV),
          radiance(light.strength),
          isEllipse(light.areaShape == RB_AREA_ELLIPSE) {
        const glm::vec3 n = glm::cross(u, v);
        area = 4 * glm::length(n);
        normal = area > 0 ? glm::normalize(n) : glm::vec3(0.0f);
        if (isEllipse) area *= glm::quarter_pi<float>();
    }

    LightSample sample(const glm::vec3& point, const glm::vec3& receiver,
                       glm::vec2 uv) const override {
        return surfaceSample(point, receiver, onSurface(uv), normal, radiance, area);
    }

    std::optional<glm::vec3> irradiance(const glm::vec3& point,
                                        const glm::vec3& receiver) const override {
        if (glm::dot(point - position, normal) <= 0) return glm::vec3(0.0f);
        if (isEllipse) return std::nullopt;
        const glm::dvec3 p(position), du(u), dv(v);
        const glm::dvec3 corners[4] = {p - du - dv, p + du - dv, p + du + dv, p - du + dv};
        return radiance * float(polygonIrradiance(point, receiver, corners, 4));
    }

    bool isOutOfSight(const glm::vec3& point, const glm::vec3& receiver,
                      float radius) const override {
        return glm::dot(point - position, normal) < -radius ||
               glm::dot(receiver, position - point) < -(radius + glm::length(u) + glm::length(v));
    }

    float distance(const glm::vec3& point) const override {
        return glm::length(position - point) - glm::length(u) - glm::length(v);
    }

    glm::vec3 power() const override { return glm::pi<float>() * radiance * area; }

    EmittedRay emit(const glm::vec4& r) const override {
        return {onSurface({r.x, r.y}), cosineDirection(normal, {r.z, r.w}), 1};
    }

  private:
    glm::vec3 onSurface(glm::vec2 uv) const {
        const glm::vec2 d = isEllipse ? onDisk(uv) : 2.0f * uv - 1.0f;
        return position + d.x * u + d.y * v;
    }

    const glm::vec3 position, u, v, radiance;
    const bool isEllipse;
    glm::vec3 normal;
    float area;
};

}  // namespace

std::vector<std::unique_ptr<LightSource>> lightSources(const Scene& scene, const Patches& patches,
                                                       const std::vector<bool>& gatheredSides) {
    std::vector<std::unique_ptr<LightSource>> sources;
    for (const Light& light : scene.lights) {
        if (light.strength == glm::dvec3(0.0)) continue;
        switch (light.kind) {
            case Light::Kind::POINT:
                sources.push_back(std::make_unique<PointSource>(light, patches.centre));
                break;
            case Light::Kind::SUN:
                sources.push_back(std::make_unique<SunSource>(light));
                break;
            case Light::Kind::AREA:
                if (glm::length(glm::cross(light.axisU, light.axisV)) > 0)
                    sources.push_back(std::make_unique<AreaSource>(light, patches.centre));
                break;
        }
    }

    std::map<std::pair<uint32_t, int32_t>, std::vector<uint32_t>>
        groups;  // by instance and material
    for (size_t p = 0; p < patches.parents.size(); ++p) {
        const Parent& parent = patches.parents[p];
        if (!gatheredSides[2 * parent.firstPatch] && !gatheredSides[2 * parent.firstPatch + 1])
            continue;
        const Mesh& mesh = scene.meshes[scene.instances[parent.instance].mesh];
        groups[{parent.instance, mesh.faceMaterials[parent.face]}].push_back(uint32_t(p));
    }
    for (auto& [key, parents] : groups) {
        const uint32_t side = 2 * patches.parents[parents.front()].firstPatch;
        std::array<glm::vec3, 2> emission{glm::vec3(0.0f), glm::vec3(0.0f)};
        for (int k = 0; k < 2; ++k)
            if (gatheredSides[side + k]) emission[k] = patches.emission[side + k];
        sources.push_back(std::make_unique<MeshSource>(patches, std::move(parents), emission));
    }
    return sources;
}

}  // namespace raybundle
