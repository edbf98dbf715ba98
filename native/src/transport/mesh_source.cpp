// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/mesh_source.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "transport/sphere_sampling.h"

namespace raybundle {
namespace {

float strength(const glm::vec3& emission) { return emission.x + emission.y + emission.z; }

// Uniform by area: the unit square is folded onto a triangle.
glm::vec3 pointOn(const LightFace& face, glm::vec2 uv) {
    if (face.isTriangle && uv.x + uv.y > 1) uv = 1.0f - uv;
    return face.origin + uv.x * face.a + uv.y * face.b;
}

}  // namespace

MeshSource::MeshSource(const Patches& patches, std::vector<uint32_t> parents,
                       const std::array<glm::vec3, 2>& emission,
                       const std::vector<glm::vec3>* sideEmission,
                       const std::optional<Enclosure>& enclosure)
    : patches(patches),
      parents(std::move(parents)),
      emission(emission),
      sideEmission(sideEmission),
      enclosure(enclosure) {
    boundSource();
    collectFaces();
    tree = LightTree(faces);
    outline = MeshOutline(patches, this->parents, double(extent));
}

// Sphere around the source.
void MeshSource::boundSource() {
    Enclosure box;
    for (uint32_t index : parents) {
        const Parent& parent = patches.parents[index];
        for (size_t k = 0; k < (parent.isTriangle ? 3 : 4); ++k)
            box.add(patches.vertices[parent.vertex[k]]);
    }
    centre = 0.5f * (box.low + box.high);
    extent = 0.5f * glm::length(box.high - box.low);
}

void MeshSource::collectFaces() {
    double sum = 0;
    auto add = [&](const LightFace& face, const glm::vec3& emitted) {
        const double power = double(face.strength * face.area());
        if (!(power > 0)) return;
        faces.push_back(face);
        totalPower += face.area() * emitted;
        powerUpTo.push_back(sum += power);
    };
    for (uint32_t index : parents) {
        const Parent& parent = patches.parents[index];
        for (uint32_t k = 0; k < 2; ++k) {
            if (emission[k] == glm::vec3(0.0f)) continue;
            const glm::vec3 normal = k ? -parent.normal : parent.normal;
            LightFace face{parent.origin,
                           parent.a,
                           parent.b,
                           normal,
                           parent.isTriangle,
                           strength(emission[k]),
                           2 * parent.firstPatch + k};
            if (!sideEmission) {
                add(face, emission[k]);
                continue;
            }
            for (uint32_t p = parent.firstPatch; p < parent.firstPatch + parent.patchCount(); ++p) {
                face.origin = patches.point(p, {0, 0});
                face.a = patches.point(p, {1, 0}) - face.origin;
                face.b = patches.point(p, {0, 1}) - face.origin;
                face.side = 2 * p + k;
                face.strength = strength(emissionOf(face.side));
                add(face, emissionOf(face.side));
            }
        }
    }
}

// Of a side, W/m^2.
glm::vec3 MeshSource::emissionOf(uint32_t side) const {
    return sideEmission ? (*sideEmission)[side] : emission[side % 2];
}

LightSample MeshSource::sample(const glm::vec3& point, const glm::vec3& receiver,
                               glm::vec2 uv) const {
    const auto choice = tree.choose(point, receiver, uv.x);
    if (!choice) return {};
    const LightFace& face = faces[choice->face];
    if (Plane(face.origin, face.normal, double(extent)).side(point) != PlaneSide::FRONT) return {};
    return surfaceSample(point, receiver, pointOn(face, {choice->u, uv.y}), face.normal,
                         emissionOf(face.side) / glm::pi<float>(),
                         face.area() / choice->probability);
}

std::optional<glm::vec3> MeshSource::irradiance(const glm::vec3& point,
                                                const glm::vec3& receiver) const {
    if (sideEmission || outline.isEmpty()) return std::nullopt;
    const glm::vec2 seen(outline.irradiance(point, receiver));
    return (seen.x * emission[0] + seen.y * emission[1]) / glm::pi<float>();
}

bool MeshSource::isOutOfSight(const glm::vec3& point, const glm::vec3& receiver,
                              float radius) const {
    if (glm::dot(receiver, centre - point) < -(radius + extent)) return true;
    if (enclosure && enclosure->distance(point) > radius) return true;
    if (!outline.isPlanar()) return false;
    const float height = float(outline.plane(0).height(point));
    return emission[height > 0 ? 0 : 1] == glm::vec3(0.0f) && std::abs(height) > radius;
}

EmittedRay MeshSource::emit(const glm::vec4& r, float) const {
    EmittedRay ray;
    if (faces.empty()) return ray;
    const double at = double(r.x) * powerUpTo.back();
    const size_t k = std::min<size_t>(
        size_t(std::upper_bound(powerUpTo.begin(), powerUpTo.end(), at) - powerUpTo.begin()),
        faces.size() - 1);
    const double before = k ? powerUpTo[k - 1] : 0;
    const float within = float(std::clamp((at - before) / (powerUpTo[k] - before), 0.0, 1.0));
    const LightFace& face = faces[k];
    // The side is chosen by the sum of the channels.
    const glm::vec3 own = emissionOf(face.side);
    for (int c = 0; c < 3; ++c)
        if (totalPower[c] > 0)
            ray.weight[c] = own[c] / strength(own) * (strength(totalPower) / totalPower[c]);
    ray.origin = pointOn(face, {within, r.y});
    ray.normal = face.normal;
    ray.direction = cosineDirection(ray.normal, {r.z, r.w});
    const uint32_t patch =
        sideEmission ? face.side / 2 : patches.patchAt(patches.parentOf[face.side / 2], ray.origin);
    ray.side = 2 * patch + face.side % 2;
    return ray;
}

}  // namespace raybundle
