// SPDX-License-Identifier: GPL-3.0-or-later
//
// Area lamps: rectangles and ellipses. Their spread may be narrower than that of a Lambertian
// emitter.
#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "lights/lamps.h"
#include "lights/mesh_outline.h"
#include "lights/receiver_place.h"
#include "patches/plane.h"
#include "sampling/area_spread.h"
#include "sampling/sphere_sampling.h"
#include "sampling/spherical_triangle.h"

namespace raybundle {
namespace {

class AreaSource : public LightSource {
  public:
    AreaSource(const Light& light, const glm::dvec3& centre)
        : position(light.position - centre),
          u(light.axisU),
          v(light.axisV),
          radiance(light.strength),
          isEllipse(light.areaShape == RB_AREA_ELLIPSE),
          spread(light.spread) {
        const glm::vec3 n = glm::cross(u, v);
        area = 4 * glm::length(n);
        normal = area > 0 ? glm::normalize(n) : glm::vec3(0.0f);
        if (isEllipse) area *= glm::quarter_pi<float>();
        isNarrow = !spread.isWhole();
        plane = Plane(position, u, v, normal, double(glm::length(u) + glm::length(v)));
    }

    LightSample sample(const glm::vec3& point, const glm::vec3& receiver,
                       glm::vec2 uv) const override {
        if (plane.side(point) != PlaneSide::FRONT) return {};
        LightSample sample = sampleBefore(point, receiver, uv);
        sample.setMargin(normal, float(plane.thickness));
        return sample;
    }

    std::optional<glm::vec3> irradiance(const glm::vec3& point,
                                        const glm::vec3& receiver) const override {
        if (plane.side(point) != PlaneSide::FRONT) return glm::vec3(0.0f);
        if (isEllipse || !spread.isWhole()) return std::nullopt;
        const glm::dvec3 p(position), du(u), dv(v);
        const glm::dvec3 corners[4] = {p - du - dv, p + du - dv, p + du + dv, p - du + dv};
        return radiance * float(polygonIrradiance(point, receiver, corners, 4));
    }

    bool isOutOfSight(const ReceiverPlace& place) const override {
        const float radius = place.radius, size = glm::length(u) + glm::length(v);
        const glm::vec3 from = place.middle - position;
        const float height = glm::dot(from, normal);
        const float across = glm::length(from - height * normal);
        return height < -(place.reach(normal) + float(plane.thickness)) ||
               (!spread.isWhole() &&
                across > (height + radius) * spread.tangent() + radius + size) ||
               glm::dot(place.normal, from) > place.reach(place.normal) + size;
    }

    float distance(const glm::vec3& point) const override {
        return glm::length(position - point) - glm::length(u) - glm::length(v);
    }

    glm::vec3 power() const override { return glm::pi<float>() * radiance * area; }

    EmittedRay emit(const glm::vec4& r, float) const override {
        EmittedRay ray;
        ray.origin = onSurface({r.x, r.y});
        ray.direction = spread.emit(normal, {r.z, r.w});
        ray.normal = normal;
        return ray;
    }

  private:
    // Returns a sample at a point in front of the lamp.
    LightSample sampleBefore(const glm::vec3& point, const glm::vec3& receiver,
                             glm::vec2 uv) const {
        if (spread.isWhole())
            return surfaceSample(point, receiver, onSurface(uv), normal, radiance, area);
        const Part part = partSeenFrom(point);
        if (!(part.area > 0)) return {};
        if (part.isCone) {
            // The directions of the spread seen from the point all meet the lamp (except near the
            // rim of an ellipse).
            LightSample sample;
            sample.direction = -spread.emit(normal, uv);
            const float cosine = -glm::dot(normal, sample.direction);
            sample.distance = glm::dot(point - position, normal) / cosine;
            const glm::vec2 d = inPlane(point + sample.distance * sample.direction);
            if (isEllipse && glm::dot(d, d) > 1) return {};
            sample.irradiance = radiance * (glm::pi<float>() / cosine *
                                            std::max(0.0f, glm::dot(receiver, sample.direction)));
            return sample;
        }
        // Otherwise, sample the bounds of the part of the surface whose light reaches the point.
        const glm::vec2 d =
            part.isAll && isEllipse ? onDisk(uv) : part.low + uv * (part.high - part.low);
        if (isEllipse && glm::dot(d, d) > 1) return {};
        LightSample sample = surfaceSample(point, receiver, position + d.x * u + d.y * v, normal,
                                           radiance, part.area);
        sample.irradiance *= spread.factor(-glm::dot(normal, sample.direction));
        return sample;
    }

    glm::vec3 onSurface(glm::vec2 uv) const {
        const glm::vec2 d = isEllipse ? onDisk(uv) : 2.0f * uv - 1.0f;
        return position + d.x * u + d.y * v;
    }

    // A rectangular part of the lamp's surface, in units of u and v from -1 to 1.
    struct Part {
        glm::vec2 low, high;
        float area;  // m^2
        // isAll: the part is the whole surface. isCone: the part holds all directions of the
        // spread.
        bool isAll, isCone;
    };

    // Returns the projection of a point on the plane of the lamp, in units of u and v.
    glm::vec2 inPlane(const glm::vec3& point) const {
        const glm::vec3 d = point - position, n = glm::cross(u, v);
        return glm::vec2(glm::dot(glm::cross(d, v), n), glm::dot(glm::cross(u, d), n)) /
               glm::dot(n, n);
    }

    // Returns the bounds of the surface points whose spread contains the direction to a point.
    Part partSeenFrom(const glm::vec3& point) const {
        const float radius = std::max(0.0f, glm::dot(point - position, normal)) * spread.tangent();
        const float cross = glm::length(glm::cross(u, v));
        const glm::vec2 foot = inPlane(point);
        const glm::vec2 reach = radius / cross * glm::vec2(glm::length(v), glm::length(u));
        Part part{glm::clamp(foot - reach, -1.0f, 1.0f), glm::clamp(foot + reach, -1.0f, 1.0f), 0,
                  false, false};
        part.isAll = part.low == glm::vec2(-1) && part.high == glm::vec2(1);
        part.isCone = part.low == foot - reach && part.high == foot + reach;
        const glm::vec2 size = part.high - part.low;
        part.area = part.isAll ? area : size.x * size.y * cross;
        return part;
    }

    const glm::vec3 position, u, v, radiance;
    const bool isEllipse;
    const AreaSpread spread;
    glm::vec3 normal;
    float area;
    Plane plane;
};

}  // namespace

std::unique_ptr<LightSource> areaSource(const Light& light, const glm::dvec3& centre) {
    if (!(glm::length(glm::cross(light.axisU, light.axisV)) > 0)) return nullptr;
    return std::make_unique<AreaSource>(light, centre);
}

}  // namespace raybundle
