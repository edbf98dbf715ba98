// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/mesh_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/gtc/constants.hpp>

#include "job/cancellation.h"
#include "lights/receiver_place.h"
#include "patches/side.h"
#include "sampling/sphere_sampling.h"
#include "sampling/spherical_triangle.h"

namespace raybundle {
namespace {

float strength(const glm::vec3& emission) { return emission.x + emission.y + emission.z; }

// Faces nearer than this number of radii are sampled by solid angle. If they were sampled by area,
// the light of a face that touches the receiver would have infinite variance.
constexpr float kNearFace = 1.5f;

// Maps the unit square to points uniform by area; the part beyond a triangle is folded onto it.
glm::vec3 pointOn(const LightFace& face, glm::vec2 uv) {
    if (face.isTriangle && uv.x + uv.y > 1) uv = 1.0f - uv;
    return face.origin + uv.x * face.a + uv.y * face.b;
}

// A direction to a face, uniform in the face's solid angle.
struct FaceDirection {
    glm::vec3 direction;
    float distance;    // metres
    float solidAngle;  // sr
};

// Samples a direction to a face. Returns nothing if the face must be sampled by area.
std::optional<FaceDirection> directionTo(const LightFace& face, const glm::vec3& point,
                                         glm::vec2 uv) {
    const glm::dvec3 o = glm::dvec3(face.origin) - glm::dvec3(point), a(face.a), b(face.b);
    const SphericalTriangle first(o, o + a, o + b);
    double solidAngle = first.area();
    glm::dvec3 direction;
    if (face.isTriangle) {
        if (!first.isSampled()) return std::nullopt;
        direction = first.sample(uv);
    } else {
        const SphericalTriangle second(o + a + b, o + b, o + a);
        if (!first.isSampled() || !second.isSampled()) return std::nullopt;
        solidAngle += second.area();
        const float share = float(first.area() / solidAngle);
        direction = uv.x < share
                        ? first.sample({uv.x / share, uv.y})
                        : second.sample({std::min((uv.x - share) / (1 - share), 0.9999999f), uv.y});
    }
    const glm::dvec3 normal(face.normal);
    const double slant = glm::dot(direction, normal);
    if (!(slant < 0)) return std::nullopt;
    return FaceDirection{glm::vec3(direction), float(glm::dot(o, normal) / slant),
                         float(solidAngle)};
}

}  // namespace

MeshSource::MeshSource(const Patches& patches, const EmissiveFaces& own)
    : patches(patches),
      emission(own.emission),
      sideEmission(own.sideEmission),
      whole(own.whole),
      isEnclosed(own.isEnclosed),
      directed(own.directed) {
    boundSource(own.parents);
    wholeExtent = std::max(double(extent), 0.5 * whole.diagonal());
    collectFaces(own.parents, own.back);
    tree = LightTree(faces);
    for (const LightFace& face : faces) shapes.push_back(shapeOf(face));
    if (!sideEmission)
        outline = MeshOutline(patches, own.parents, own.back == 1, wholeExtent);
    else if (!directed && faces.size() <= FaceClusters::kMostFaces)
        clusters = FaceClusters(tree, faces, radiances());
}

// Computes a sphere that contains the source.
void MeshSource::boundSource(const std::vector<uint32_t>& parents) {
    Extent box;
    for (uint32_t index : parents) box.add(boxOf(patches, patches.parents[index]));
    centre = glm::vec3(box.middle());
    extent = float(0.5 * box.diagonal());
}

void MeshSource::collectFaces(const std::vector<uint32_t>& parents, uint32_t back) {
    auto add = [&](const LightFace& face) {
        if (!(face.strength * face.area() > 0)) return;
        faces.push_back(face);
        totalPower += face.area() * emissionOf(face.side);
    };
    for (uint32_t index : parents) {
        const Parent& parent = patches.parents[index];
        LightFace face{parent.origin,
                       parent.a,
                       parent.b,
                       back ? -parent.normal : parent.normal,
                       parent.isTriangle,
                       strength(emission),
                       2 * parent.firstPatch + back};
        if (!sideEmission) {
            add(face);
            continue;
        }
        for (uint32_t p = parent.firstPatch; p < parent.firstPatch + parent.patchCount(); ++p) {
            throwIfCancelledAt(p);
            face.origin = patches.point(p, {0, 0});
            face.a = patches.point(p, {1, 0}) - face.origin;
            face.b = patches.point(p, {0, 1}) - face.origin;
            face.side = 2 * p + back;
            face.strength = strength(emissionOf(face.side));
            add(face);
        }
    }
}

MeshSource::FaceShape MeshSource::shapeOf(const LightFace& face) const {
    const uint32_t index = patches.parentOf[patchOf(face.side)];
    const Parent& parent = patches.parents[index];
    const Plane plane(parent.origin, parent.a, parent.b, face.normal, wholeExtent);
    const float size = 0.5f * (glm::length(face.a) + glm::length(face.b));
    // The plane's half thickness is doubled because heights are computed in float; (x + y)^2 <= 2
    // x^2 + 2 y^2.
    const double most = 2 * plane.halfThicknessWithin(double(size));
    const double slope = 2 * (plane.halfThicknessWithin(1) - plane.halfThicknessWithin(0));
    return {plane,
            face.middle(),
            emissionOf(face.side) * glm::one_over_pi<float>(),
            face.area(),
            kNearFace * kNearFace * size * size,
            float(2 * most * most),
            float(2 * slope * slope),
            index};
}

std::vector<glm::vec3> MeshSource::radiances() const {
    std::vector<glm::vec3> result;
    for (const FaceShape& shape : shapes) result.push_back(shape.radiance);
    return result;
}

glm::vec3 MeshSource::irradianceOf(uint32_t index, const glm::vec3& point,
                                   const glm::vec3& receiver) const {
    const LightFace& face = faces[index];
    const FaceShape& shape = shapes[index];
    if (shape.plane.side(point) != PlaneSide::FRONT) return glm::vec3(0.0f);
    const glm::dvec3 o(face.origin), a(face.a), b(face.b);
    const std::array<glm::dvec3, 4> corners{o, o + a, face.isTriangle ? o + b : o + a + b, o + b};
    return shape.radiance *
           float(polygonIrradiance(point, receiver, corners.data(), face.isTriangle ? 3 : 4));
}

LightSample MeshSource::sample(const glm::vec3& point, const glm::vec3& receiver,
                               glm::vec2 uv) const {
    const LightTree::Choice choice = tree.choose(point, receiver, uv.x);
    if (!(choice.weight > 0)) return {};
    const LightFace& face = faces[choice.face];
    const FaceShape& shape = shapes[choice.face];
    const glm::vec3 d = shape.middle - point;
    const float distance2 = glm::dot(d, d);
    if (!shape.isBefore(point, -glm::dot(face.normal, d), distance2)) return {};
    const glm::vec2 own(choice.u, uv.y);
    const auto seen = distance2 <= shape.nearSquare ? directionTo(face, point, own) : std::nullopt;
    LightSample sample =
        seen ? LightSample{seen->direction, seen->distance,
                           shape.radiance * (seen->solidAngle * choice.weight *
                                             std::max(0.0f, glm::dot(receiver, seen->direction)))}
             : surfaceSample(point, receiver, pointOn(face, own), face.normal, shape.radiance,
                             shape.area * choice.weight);
    if (directed) sample.irradiance *= shareTowards(face.side, -sample.direction);
    sample.parent = shape.parent;
    sample.setMargin(face.normal, float(shape.plane.thickness));
    return sample;
}

glm::vec3 MeshSource::shareTowards(uint32_t side, const glm::vec3& direction) const {
    const glm::vec3 mean = emissionOf(side), more = directed->beyondMean(side, direction, mean);
    glm::vec3 share(1.0f);
    for (int c = 0; c < 3; ++c)
        if (mean[c] > 0) share[c] = std::max(0.0f, 1 + more[c] / mean[c]);
    return share;
}

std::optional<glm::vec3> MeshSource::irradiance(const glm::vec3& point,
                                                const glm::vec3& receiver) const {
    if (!clusters.isEmpty()) {
        const auto ofFace = [&](uint32_t face) { return irradianceOf(face, point, receiver); };
        // Passed by reference, since a std::function with all these captures would allocate memory
        // at every point.
        return clusters.irradiance(tree, point, receiver, std::cref(ofFace));
    }
    if (outline.isEmpty()) return std::nullopt;
    return emission * float(outline.irradiance(point, receiver) / glm::pi<double>());
}

bool MeshSource::isOutOfSight(const ReceiverPlace& place) const {
    if (glm::dot(place.normal, centre - place.middle) < -(place.reach(place.normal) + extent))
        return true;
    if (isEnclosed && whole.distance(glm::dvec3(place.middle)) > double(place.radius)) return true;
    const Plane* const plane = outline.plane();
    return plane && plane->height(place.middle) <
                        -(double(place.reach(glm::vec3(plane->normal))) + plane->thickness);
}

EmittedRay MeshSource::emit(const glm::vec4& r, float) const {
    EmittedRay ray;
    if (faces.empty()) return ray;
    const LightTree::Choice choice = tree.chooseByPower(double(r.x));
    const LightFace& face = faces[choice.face];
    // The face is chosen by the sum of the channels, so the weight corrects the share of each
    // channel.
    const glm::vec3 own = emissionOf(face.side);
    for (int c = 0; c < 3; ++c)
        if (totalPower[c] > 0)
            ray.weight[c] = own[c] / strength(own) * (strength(totalPower) / totalPower[c]);
    ray.origin = pointOn(face, {choice.u, r.y});
    ray.normal = face.normal;
    ray.direction = cosineDirection(ray.normal, {r.z, r.w});
    const uint32_t patch = sideEmission
                               ? patchOf(face.side)
                               : patches.patchAt(patches.parentOf[patchOf(face.side)], ray.origin);
    ray.side = sideOf(patch, isBack(face.side));
    return ray;
}

}  // namespace raybundle
