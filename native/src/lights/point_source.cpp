// SPDX-License-Identifier: GPL-3.0-or-later
//
// Point and spot lamps: spheres, or disks that turn towards each receiver.
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>

#include "lights/lamps.h"
#include "lights/receiver_place.h"
#include "lights/spot_cone.h"
#include "patches/plane.h"
#include "sampling/sphere_sampling.h"
#include "sampling/spherical_triangle.h"

namespace raybundle {
namespace {

// Patches larger than this share of their distance from a point lamp receive light that varies over
// them.
constexpr float kNearPatch = 0.3f;

class PointSource : public LightSource {
  public:
    PointSource(const Light& light, const glm::dvec3& centre)
        : light(light), position(light.position - centre), intensity(light.strength) {
        if (light.hasCone) cone.emplace(light);
        totalPower = 2 * glm::two_pi<float>() * intensity * (cone ? cone->meanOverSphere() : 1);
    }

    LightSample sample(const glm::vec3& point, const glm::vec3& normal,
                       glm::vec2 uv) const override {
        const glm::vec3 towards = position - point;
        const float distance2 = glm::dot(towards, towards);
        const float radius = float(light.radius);
        LightSample sample;
        if (distance2 <= 0) return sample;
        if (radius > 0 && light.pointShape == RB_POINT_SPHERE && distance2 <= radius * radius)
            return sample;  // the point is inside the sphere
        const float distance = std::sqrt(distance2);
        const glm::vec3 axis = towards / distance;
        if (radius == 0) {
            sample.direction = axis;
            sample.distance = distance;
            sample.irradiance = intensity * std::max(0.0f, glm::dot(normal, axis)) / distance2;
        } else if (light.pointShape == RB_POINT_DISK) {
            // Disk of radius r that faces the receiver, with radiance I / (pi r^2).
            const auto [x, y] = frame(axis);
            const glm::vec2 d = radius * onDisk(uv);
            sample = surfaceSample(point, normal, position + d.x * x + d.y * y, -axis,
                                   intensity / (glm::pi<float>() * radius * radius),
                                   glm::pi<float>() * radius * radius);
        } else {
            // Uniform direction in the cone that the sphere fills. The sphere's radiance is I / (pi
            // r^2), too.
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
        if (cone) sample.irradiance *= cone->share(-sample.direction);
        return sample;
    }

    // A sphere that is wholly above the horizon gives the irradiance of a point lamp at its centre.
    std::optional<glm::vec3> irradiance(const glm::vec3& point,
                                        const glm::vec3& normal) const override {
        const glm::vec3 towards = position - point;
        const float height = glm::dot(towards, normal), distance2 = glm::dot(towards, towards);
        if (height <= -float(light.radius)) return glm::vec3(0.0f);
        if (!isPoint() && (cone || isDisk() || height < float(light.radius))) return std::nullopt;
        if (!(height > 0)) return glm::vec3(0.0f);
        const float distance = std::sqrt(distance2);
        const float share = cone ? cone->share(-towards / distance) : 1.0f;
        return intensity * (share * height / (distance * distance2));
    }

    // The power that leaves towards the patch is its solid angle times the intensity, at any
    // distance.
    std::optional<glm::vec3> meanIrradiance(const ReceiverPlace& patch) const override {
        if (cone || isDisk() || !isBefore(patch)) return std::nullopt;
        const std::array<SphericalTriangle, 2> halves = seen(patch);
        return intensity * float((halves[0].area() + halves[1].area()) / areaOf(patch));
    }

    bool isSteepOn(const ReceiverPlace& patch) const override {
        return cone && cone->isSteepBetween(cornersOf(patch));
    }

    // Points on the patch are uniform in the solid angle under which the lamp sees the patch, since
    // the light of the lamp is, or follow the cone if it lights a small part of the patch.
    bool choosesPlaces() const override { return true; }
    PatchPoint placeOn(const ReceiverPlace& patch, glm::vec2 uv) const override {
        if (isNarrowOn(patch)) return placeInCone(patch, uv);
        if (patch.radius == 0 || patch.radius < kNearPatch * distance(patch.middle) ||
            !isBefore(patch))
            return LightSource::placeOn(patch, uv);
        const std::array<SphericalTriangle, 2> halves = seen(patch);
        const double all = halves[0].area() + halves[1].area();
        const float first = float(halves[0].area() / all);
        const bool isFirst = uv.x < first;
        const SphericalTriangle& half = halves[isFirst ? 0 : 1];
        if (!half.isSampled()) return LightSource::placeOn(patch, uv);
        uv.x = isFirst ? uv.x / first : (uv.x - first) / (1 - first);
        const glm::dvec3 d = half.sample({std::min(uv.x, 0.9999999f), uv.y});
        const glm::dvec3 n(patch.normal);
        const double height = glm::dot(glm::dvec3(position - patch.origin), n);
        const double cosine = -glm::dot(d, n), along = height / cosine;
        if (!(cosine > 0)) return LightSource::placeOn(patch, uv);
        // The weight is the density of points uniform by area over the density of this sampling.
        return {position + glm::vec3(along * d),
                float(all * along * along / (cosine * areaOf(patch)))};
    }

    bool isOutOfSight(const ReceiverPlace& place) const override {
        return glm::dot(place.normal, position - place.middle) <
               -(place.reach(place.normal) + float(light.radius));
    }

    float distance(const glm::vec3& point) const override {
        return glm::length(position - point) - float(light.radius);
    }

    glm::vec3 power() const override { return isDisk() ? glm::vec3(0.0f) : totalPower; }

    // A disk that faces each receiver has no fixed surface to emit from. But each line through it
    // has its radiance (see emit()), and these lines carry as much power as those of the sphere.
    glm::vec3 shootingPower(float) const override { return totalPower; }

    EmittedRay emit(const glm::vec4& u, float) const override {
        EmittedRay ray;
        ray.origin = position;
        if (cone) {
            const SpotCone::Ray along = cone->emit({u.x, u.y});
            ray.direction = along.direction;
            ray.weight = glm::vec3(along.weight);
        } else {
            ray.direction = uniformDirection({u.x, u.y});
        }
        if (light.radius == 0) return ray;
        // Rays follow all lines of one direction that pass within the radius r of the centre, each
        // at a distance d from it.
        const float r2 = float(light.radius * light.radius);
        const glm::vec2 across = float(light.radius) * onDisk({u.z, u.w});
        const auto [x, y] = frame(ray.direction);
        const float d2 = glm::dot(across, across), rest = std::sqrt(std::max(0.0f, r2 - d2));
        ray.origin += across.x * x + across.y * y;
        // A sphere emits such a ray where the line leaves the sphere. Let t be the position along
        // the line, 0 where the line is nearest to the centre. The disk that faces the point at t
        // intersects the line only if the point is far enough: t > d^2 / sqrt(r^2 - d^2). From
        // nearer points the line passes beside the disk.
        if (isDisk())
            ray.from = rest > 0 ? d2 / rest : std::numeric_limits<float>::infinity();
        else
            ray.origin += rest * ray.direction;
        return ray;
    }

  private:
    bool isPoint() const { return light.radius == 0; }
    bool isDisk() const { return light.radius > 0 && light.pointShape == RB_POINT_DISK; }

    // Returns whether the source is wholly in front of a patch and not in its plane.
    bool isBefore(const ReceiverPlace& patch) const {
        const Plane plane(patch.origin, patch.a, patch.b, patch.normal, double(patch.radius));
        return plane.height(position) >= std::max(double(light.radius), plane.thickness);
    }

    // Returns a patch as seen from the centre of the lamp, as two triangles. Only the first counts
    // for a triangle.
    std::array<SphericalTriangle, 2> seen(const ReceiverPlace& patch) const {
        const glm::dvec3 o = glm::dvec3(patch.origin - position), a(patch.a), b(patch.b);
        const glm::dvec3 end = o + (patch.isTriangle ? b : a + b);
        return {SphericalTriangle(o, o + a, o + b), SphericalTriangle(end, o + b, o + a)};
    }

    // Returns whether the cone of a point lamp fills a smaller solid angle than a patch, so that
    // most points of the patch may get no light.
    bool isNarrowOn(const ReceiverPlace& patch) const {
        if (!cone || !isPoint() || patch.radius == 0 || !isBefore(patch) || !isSteepOn(patch))
            return false;
        const std::array<SphericalTriangle, 2> halves = seen(patch);
        return halves[0].area() + halves[1].area() >
               4 * glm::pi<double>() * double(cone->meanOverSphere());
    }

    // Returns the point of a patch that a ray of the cone meets. The weight is 0 if it misses the
    // patch.
    PatchPoint placeInCone(const ReceiverPlace& patch, glm::vec2 uv) const {
        const SpotCone::Ray ray = cone->emit(uv);
        const glm::dvec3 d(ray.direction), a(patch.a), b(patch.b), across = glm::cross(a, b);
        const glm::dvec3 n(patch.normal), origin(patch.origin - position);
        const double cosine = -glm::dot(d, n), along = -glm::dot(origin, n) / cosine;
        const glm::dvec3 on = along * d - origin;
        const double u = glm::dot(glm::cross(on, b), across) / glm::dot(across, across);
        const double v = glm::dot(glm::cross(a, on), across) / glm::dot(across, across);
        const double share = double(cone->share(ray.direction));
        const bool isOn = u >= 0 && v >= 0 && (patch.isTriangle ? u + v : std::max(u, v)) <= 1;
        if (!(cosine > 0 && share > 0 && isOn)) return {patch.middle, 0};
        // The weight is the density of points uniform by area over the density of these points.
        const double all = 4 * glm::pi<double>() * double(ray.weight * cone->meanOverSphere());
        return {position + glm::vec3(along * d),
                float(all * along * along / (share * cosine * areaOf(patch)))};
    }

    // Returns the corners of a patch, relative to the lamp. A triangle has its last corner twice.
    std::array<glm::dvec3, 4> cornersOf(const ReceiverPlace& patch) const {
        const glm::dvec3 o = patch.origin - position, a(patch.a), b(patch.b);
        return {o, o + a, o + b, patch.isTriangle ? o + b : o + a + b};
    }

    static double areaOf(const ReceiverPlace& patch) {
        return glm::length(glm::cross(glm::dvec3(patch.a), glm::dvec3(patch.b))) *
               (patch.isTriangle ? 0.5 : 1.0);
    }

    const Light& light;
    const glm::vec3 position;
    const glm::vec3 intensity;
    std::optional<SpotCone> cone;
    glm::vec3 totalPower{0.0f};
};

}  // namespace

std::unique_ptr<LightSource> pointSource(const Light& light, const glm::dvec3& centre) {
    return std::make_unique<PointSource>(light, centre);
}

}  // namespace raybundle
