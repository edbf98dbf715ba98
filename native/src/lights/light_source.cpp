// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/light_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <map>
#include <tuple>

#include "lights/enclosing.h"
#include "lights/mesh_source.h"
#include "lights/receiver_place.h"
#include "lights/spot_cone.h"
#include "lights/world_source.h"
#include "patches/plane.h"
#include "sampling/area_spread.h"
#include "sampling/hasher.h"
#include "sampling/sphere_sampling.h"
#include "sampling/spherical_triangle.h"

namespace raybundle {

namespace {

constexpr ptrdiff_t kMostOfObject = 32;

// A patch larger than this share of its distance from a point lamp gets light that varies over it.
constexpr float kNearPatch = 0.3f;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

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
        if (cone) sample.irradiance *= cone->share(-sample.direction);
        return sample;
    }

    // A sphere that is wholly above the horizon gives what its centre would.
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

    // What leaves towards the patch: its solid angle times the intensity, however near it is.
    std::optional<glm::vec3> meanIrradiance(const ReceiverPlace& patch) const override {
        if (cone || isDisk() || !isBefore(patch)) return std::nullopt;
        const std::array<SphericalTriangle, 2> halves = seen(patch);
        return intensity * float((halves[0].area() + halves[1].area()) / areaOf(patch));
    }

    // Uniform by the angle at which the source sees them, as its light is.
    bool choosesPlaces() const override { return true; }
    PatchPoint placeOn(const ReceiverPlace& patch, glm::vec2 uv) const override {
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
        // Over the density at which an equal area of the patch is seen.
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

    // A disk that faces each receiver has no surface to emit from, but each line through it has
    // its radiance (see emit), and they carry as much as those of the sphere.
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
        // All lines of a direction that pass within the radius r of the centre, at a distance d.
        const float r2 = float(light.radius * light.radius);
        const glm::vec2 across = float(light.radius) * onDisk({u.z, u.w});
        const auto [x, y] = frame(ray.direction);
        const float d2 = glm::dot(across, across), rest = std::sqrt(std::max(0.0f, r2 - d2));
        ray.origin += across.x * x + across.y * y;
        // A sphere emits them where they leave it. The disk that faces a point at t along the line
        // (t = 0 where it is nearest to the centre) lies across the line only if the point is
        // far enough, t > d^2 / sqrt(r^2 - d^2): nearer points see the line pass beside the disk.
        if (isDisk())
            ray.from = rest > 0 ? d2 / rest : kInfinity;
        else
            ray.origin += rest * ray.direction;
        return ray;
    }

  private:
    bool isPoint() const { return light.radius == 0; }
    bool isDisk() const { return light.radius > 0 && light.pointShape == RB_POINT_DISK; }

    // Whether the source is wholly in front of a patch, and not in its plane.
    bool isBefore(const ReceiverPlace& patch) const {
        const Plane plane(patch.origin, patch.a, patch.b, patch.normal, double(patch.radius));
        return plane.height(position) >= std::max(double(light.radius), plane.thickness);
    }

    // A patch as it is seen from the centre; a triangle has no second half.
    std::array<SphericalTriangle, 2> seen(const ReceiverPlace& patch) const {
        const glm::dvec3 o = glm::dvec3(patch.origin - position), a(patch.a), b(patch.b);
        const glm::dvec3 end = o + (patch.isTriangle ? b : a + b);
        return {SphericalTriangle(o, o + a, o + b), SphericalTriangle(end, o + b, o + a)};
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
        sample.distance = kInfinity;
        sample.direction = half > 0 ? inCone(direction, cosHalf, uv) : direction;
        // Radiance E / (pi sin^2 half) over the solid angle 2 pi (1 - cos half).
        sample.irradiance =
            strength * perCosine() * std::max(0.0f, glm::dot(normal, sample.direction));
        return sample;
    }

    std::optional<glm::vec3> irradiance(const glm::vec3&, const glm::vec3& normal) const override {
        const float c = glm::dot(normal, direction);
        // Wholly above or wholly below the horizon; in between it is sampled.
        if (c >= sinHalf) return strength * c;
        if (c <= -sinHalf) return glm::vec3(0.0f);
        return std::nullopt;
    }

    bool isOutOfSight(const ReceiverPlace& place) const override {
        return glm::dot(place.normal, direction) <= -sinHalf;
    }

    float distance(const glm::vec3&) const override { return kInfinity; }

    glm::vec3 power() const override { return glm::vec3(0.0f); }

    // Parallel rays of each direction, from a disk that covers the scene.
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
    static constexpr float kCover = 1.001f;  // radius of the disk over the scene's

    // Irradiance across a ray of the sun, whose disk it covers, over that across its middle.
    float perCosine() const { return half > 0 ? 2 / (1 + cosHalf) : 1; }

    const glm::vec3 direction, strength;
    const float half;  // angular radius
    const float cosHalf, sinHalf;
};

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
    // In front of the light.
    LightSample sampleBefore(const glm::vec3& point, const glm::vec3& receiver,
                             glm::vec2 uv) const {
        if (spread.isWhole())
            return surfaceSample(point, receiver, onSurface(uv), normal, radiance, area);
        const Part part = partSeenFrom(point);
        if (!(part.area > 0)) return {};
        if (part.isCone) {
            // The light fills the cone of directions (but for the rim of an ellipse).
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
        // Else the part of the surface whose light reaches the point, or rather its bounds.
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

    // Of the light's surface, in shares of u and v from -1 to 1.
    struct Part {
        glm::vec2 low, high;
        float area;  // m^2
        bool isAll, isCone;
    };

    // The foot of a point in the plane of the light, in shares of u and v.
    glm::vec2 inPlane(const glm::vec3& point) const {
        const glm::vec3 d = point - position, n = glm::cross(u, v);
        return glm::vec2(glm::dot(glm::cross(d, v), n), glm::dot(glm::cross(u, d), n)) /
               glm::dot(n, n);
    }

    // Bounds of the points within the spread of their light from a point.
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

// LightSource::shape of a lamp.
uint64_t shapeOf(const Light& l) {
    Hasher hasher;
    hasher.add(l.kind, l.position, l.radius, l.pointShape, l.direction, l.angle, l.axisU, l.axisV,
               l.areaShape, l.spread, l.castsShadows, l.hasCone, l.worldToCone, l.coneAngle,
               l.coneBlend, l.coneDims);
    return hasher.value();
}

// The same of the fronts (back = 0) or backs of emissive faces.
uint64_t shapeOf(const Patches& patches, const std::vector<uint32_t>& parents, uint32_t back,
                 const std::vector<glm::vec3>& emission, const glm::vec3& strength) {
    Hasher hasher;
    hasher.add(parents);
    hasher.add(back);
    for (uint32_t p : parents) {
        const Parent& parent = patches.parents[p];
        for (uint32_t k = 0; k < parent.patchCount(); ++k)
            for (int c = 0; c < 3; ++c) {
                const float e = emission[2 * (parent.firstPatch + k) + back][c];
                hasher.add(e > 0 ? e / strength[c] : 0.0f);
            }
    }
    return hasher.value();
}

// Lamps that are one object are several sources, or few samples would tell what all of them
// together give, and which one is hidden from a receiver. Of an object with more than
// kMostOfObject, as a tree full of little lights is, they are one.
template <class Groups>
void joinMany(Groups& groups) {
    Groups joined;
    for (auto first = groups.begin(); first != groups.end();) {
        const auto [instance, material, surface] = first->first;
        const auto last = groups.upper_bound({instance, material, UINT32_MAX});
        const bool isOne = std::distance(first, last) > kMostOfObject;
        for (; first != last; ++first) {
            std::vector<uint32_t>& own =
                joined[{instance, material, isOne ? surface : std::get<2>(first->first)}];
            own.insert(own.end(), first->second.begin(), first->second.end());
        }
    }
    groups = std::move(joined);
}

}  // namespace

PatchPoint LightSource::placeOn(const ReceiverPlace& patch, glm::vec2 uv) const {
    return {patch.at(uv)};
}

std::vector<std::unique_ptr<LightSource>> meshSources(const Scene& scene, const Patches& patches,
                                                      const std::vector<bool>& gatheredSides,
                                                      const std::vector<glm::vec3>& emission,
                                                      const DirectedEmission* directed) {
    std::vector<std::unique_ptr<LightSource>> sources;
    using Group = std::tuple<uint32_t, int32_t, uint32_t>;  // instance, material and surface
    std::map<Group, std::vector<uint32_t>> groups;
    for (size_t p = 0; p < patches.parents.size(); ++p) {
        const Parent& parent = patches.parents[p];
        const auto first = gatheredSides.begin() + 2 * int64_t(parent.firstPatch);
        if (std::none_of(first, first + 2 * int64_t(parent.patchCount()),
                         [](bool isGathered) { return isGathered; }))
            continue;
        const Mesh& mesh = scene.meshes[scene.instances[parent.instance].mesh];
        groups[{parent.instance, mesh.faceMaterials[parent.face], parent.surface}].push_back(
            uint32_t(p));
    }
    joinMany(groups);
    const std::vector<Enclosing> surfaces =
        groups.empty() ? std::vector<Enclosing>() : enclosingSurfaces(patches);
    for (const auto& [key, parents] : groups) {
        std::array<glm::vec3, 2> most{glm::vec3(0.0f), glm::vec3(0.0f)};
        const uint32_t first = 2 * patches.parents[parents.front()].firstPatch;
        bool varies = false;
        for (uint32_t p : parents) {
            const Parent& parent = patches.parents[p];
            for (uint32_t k = 0; k < 2 * parent.patchCount(); ++k) {
                const uint32_t side = 2 * parent.firstPatch + k;
                most[k % 2] = glm::max(most[k % 2], emission[side]);
                varies = varies || emission[side] != emission[first + k % 2];
            }
        }
        // Fronts and backs apart: of a lamp that encloses a volume one of them is never seen.
        Enclosing enclosing;
        for (uint32_t p : parents) enclosing.add(surfaces[patches.parents[p].surface]);
        for (uint32_t back = 0; back < 2; ++back) {
            if (most[back] == glm::vec3(0.0f)) continue;
            sources.push_back(std::make_unique<MeshSource>(
                patches, parents, back, most[back], varies || directed ? &emission : nullptr,
                enclosing.box, enclosing.hides[back], directed));
            sources.back()->name = "object \"" + scene.instances[std::get<0>(key)].name + "\"";
            sources.back()->magnitude = most[back];
            sources.back()->shape = shapeOf(patches, parents, back, emission, most[back]);
        }
    }
    return sources;
}

std::vector<std::unique_ptr<LightSource>> lightSources(const Scene& scene, const Patches& patches,
                                                       const std::vector<bool>& gatheredSides,
                                                       const std::vector<glm::vec3>& emission,
                                                       int32_t lightSet) {
    std::vector<std::unique_ptr<LightSource>> sources;
    for (const Light& light : scene.lights) {
        const size_t before = sources.size();
        if (light.strength == glm::dvec3(0.0) || light.lightSet != lightSet) continue;
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
        if (sources.size() == before) continue;
        sources.back()->castsShadows = light.castsShadows;
        sources.back()->name = "lamp \"" + light.name + "\"";
        sources.back()->magnitude = light.strength;
        sources.back()->shape = shapeOf(light);
    }

    if (scene.worldLightSet == lightSet && !scene.worldImage.pixels.empty() &&
        scene.worldImage.meanRadiance() != glm::vec3(0.0f)) {
        Hasher hasher;
        hasher.add(scene.worldImage.width, scene.worldImage.height);
        hasher.add(scene.worldImage.pixels);
        sources.push_back(std::make_unique<WorldSource>(scene.worldImage));
        sources.back()->name = "the world";
        sources.back()->shape = hasher.value();
    }

    for (auto& source : meshSources(scene, patches, gatheredSides, emission, nullptr))
        sources.push_back(std::move(source));
    return sources;
}

}  // namespace raybundle
