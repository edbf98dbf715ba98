// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/light_tree.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace raybundle {
namespace {

// A cluster is flat if the cosine of its cone of normals is at least kFlatNode. It is far from
// kFarFromNode radii on. The receiver is clear of the cluster's horizon if the sine of its
// elevation over it exceeds kClear times the sine of the cone.
constexpr float kFlatNode = 0.999f, kFarFromNode = 2, kClear = 2;

float sineOf(float cosine) { return std::sqrt(std::max(0.0f, 1 - cosine * cosine)); }

struct Angle {
    float cosine, sine;
};

// Returns max(x - y, 0) of two angles up to half a turn.
Angle rest(const Angle& x, const Angle& y) {
    if (x.cosine >= y.cosine) return {1, 0};
    return {x.cosine * y.cosine + x.sine * y.sine, x.sine * y.cosine - x.cosine * y.sine};
}

// Returns the axes of a face as the rows of a matrix: along the first edge, across it, and the
// normal.
glm::mat3 axesOf(const LightFace& face) {
    const glm::vec3 along = glm::normalize(face.a);
    const glm::vec3 normal = glm::normalize(glm::cross(face.a, face.b));
    return glm::transpose(glm::mat3(along, glm::cross(normal, along), normal));
}

}  // namespace

LightTree::LightTree(std::vector<LightFace>& faces) {
    nodes.reserve(2 * faces.size());
    if (!faces.empty()) {
        axes = axesOf(*std::max_element(
            faces.begin(), faces.end(),
            [](const LightFace& a, const LightFace& b) { return a.area() < b.area(); }));
        build(faces, 0, uint32_t(faces.size()));
    }
    powerBefore.push_back(0);
    for (const LightFace& face : faces) {
        const double power = double(face.strength * face.area());
        powerBefore.push_back(powerBefore.back() + power);
        perPower.push_back(1 / power);
    }
    sharesPerPower = double(faces.size()) / powerBefore.back();
    uint32_t face = 0;
    for (size_t k = 0; k < faces.size(); ++k) {
        while (powerBefore[face + 1] * sharesPerPower <= double(k)) ++face;
        faceAt.push_back(face);
    }
}

uint32_t LightTree::build(std::vector<LightFace>& faces, uint32_t first, uint32_t count) {
    glm::vec3 low(INFINITY), high(-INFINITY), middleLow(INFINITY), middleHigh(-INFINITY), sum(0.0f);
    double power = 0;
    for (uint32_t k = first; k < first + count; ++k) {
        const LightFace& face = faces[k];
        const glm::vec3 across = face.origin + face.a + face.b;
        for (const glm::vec3& corner : {face.origin, face.origin + face.a, face.origin + face.b,
                                        face.isTriangle ? face.origin : across}) {
            low = glm::min(low, axes * corner);
            high = glm::max(high, axes * corner);
        }
        const glm::vec3 middle = axes * face.middle();
        middleLow = glm::min(middleLow, middle);
        middleHigh = glm::max(middleHigh, middle);
        sum += face.normal;
        power += double(face.strength * face.area());
    }
    Node node{};
    node.centre = glm::transpose(axes) * (0.5f * (low + high));
    node.half = 0.5f * (high - low);
    node.radius = glm::length(node.half);
    node.axis = glm::length(sum) > 1e-3f * float(count) ? glm::normalize(sum) : glm::vec3(0, 0, 1);
    node.depth = glm::dot(glm::abs(axes * node.axis), node.half);
    node.cosine = 1;
    for (uint32_t k = first; k < first + count; ++k)
        node.cosine = std::min(node.cosine, glm::dot(node.axis, faces[k].normal));
    node.sine = sineOf(node.cosine);
    node.power = float(power);
    node.first = first;
    node.count = count;
    const uint32_t index = uint32_t(nodes.size());
    nodes.push_back(node);
    if (count == 1) return index;

    const glm::vec3 size = middleHigh - middleLow;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    // Sort by place, then by normal, so that the order of the faces in the mesh does not matter.
    auto key = [&](const LightFace& face) {
        const glm::vec3 at = axes * face.middle(), n = axes * face.normal;
        return std::array<float, 6>{at[axis], at.x, at.y, n.x, n.y, n.z};
    };
    const auto begin = faces.begin() + first;
    std::nth_element(begin, begin + count / 2, begin + count,
                     [&](const LightFace& a, const LightFace& b) { return key(a) < key(b); });
    build(faces, first, count / 2);
    nodes[index].second = build(faces, first + count / 2, count - count / 2);
    return index;
}

// Returns about the irradiance from the cluster at a point with a unit normal. The cosines are
// upper bounds, so the result is 0 only if the cluster gives no light.
float LightTree::importance(const Node& node, const glm::vec3& point, const glm::vec3& normal,
                            const glm::vec3& boxNormal) const {
    const glm::vec3 d = node.centre - point;
    const float r2 = node.radius * node.radius, distance2 = glm::dot(d, d);
    float received = 1, emitted = 1;
    if (distance2 > r2) {
        const float distance = std::sqrt(distance2);
        const glm::vec3 towards = d / distance;
        // Half the angle under which the sphere is seen.
        const float sinSphere = node.radius / distance;
        const Angle sphere{sineOf(sinSphere), sinSphere};
        const float c = glm::dot(normal, towards);
        received = rest({c, sineOf(c)}, sphere).cosine;
        // The angle from the cone's axis to the receiver, less the cone, less the sphere.
        const float e = -glm::dot(node.axis, towards);
        emitted = rest(rest({e, sineOf(e)}, {node.cosine, node.sine}), sphere).cosine;
        if (received <= 0 || emitted <= 0) return 0;
    }
    // The cosine at a face is at most the height of the receiver over the face, divided by the
    // distance. The cosine at the receiver is at most the height of the face over the receiver,
    // divided by the distance.
    const glm::vec3 away = axes * d;
    const float nearest = glm::length(glm::max(glm::abs(away) - node.half, 0.0f));
    if (nearest > 0) {
        const float before = glm::dot(glm::abs(boxNormal), node.half) + glm::dot(normal, d);
        received = std::min(received, before / nearest);
        if (node.cosine > 0) {
            const float height = -glm::dot(node.axis, d) + node.depth;
            const float above = height * (height > 0 ? 1 : node.cosine) +
                                node.sine * (std::sqrt(distance2) + node.radius);
            emitted = std::min(emitted, above / nearest);
        }
        if (received <= 0 || emitted <= 0) return 0;
    }
    return node.power * emitted * received / std::max({distance2, r2, 1e-30f});
}

bool LightTree::isEven(const Node& node, const glm::vec3& point, const glm::vec3& normal) {
    const glm::vec3 d = node.centre - point;
    const float distance2 = glm::dot(d, d);
    if (node.cosine < kFlatNode ||
        distance2 < kFarFromNode * kFarFromNode * node.radius * node.radius)
        return false;
    const float height = -glm::dot(node.axis, d), horizon = kClear * node.sine;
    return glm::dot(normal, d) > node.radius && height > 0 &&
           height * height > horizon * horizon * distance2;
}

LightTree::Choice LightTree::chosen(uint32_t face, double at, double all) const {
    const double own = perPower[face];
    return {face, float(all * own),
            std::clamp(float((at - powerBefore[face]) * own), 0.0f, 0.9999999f)};
}

LightTree::Choice LightTree::chooseByPower(double u) const {
    const double at = u * powerBefore.back();
    const uint32_t last = uint32_t(faceAt.size()) - 1;
    uint32_t face = faceAt[std::min(uint32_t(at * sharesPerPower), last)];
    // On average, one more face begins within a share.
    while (face < last && powerBefore[face + 1] <= at) ++face;
    return chosen(face, at, powerBefore.back());
}

LightTree::Choice LightTree::byPower(const Node& node, double u, double weight) const {
    const double all = powerBefore[node.first + node.count] - powerBefore[node.first];
    const double at = powerBefore[node.first] + u * all;
    const auto begin = powerBefore.begin() + node.first + 1;
    const auto after = std::upper_bound(begin, begin + node.count - 1, at);
    return chosen(uint32_t(after - powerBefore.begin()) - 1, at, weight * all);
}

LightTree::Choice LightTree::chooseOfMany(const glm::vec3& point, const glm::vec3& normal,
                                          float u) const {
    if (nodes.empty()) return {0, 0, u};
    const glm::vec3 boxNormal = axes * normal;
    uint32_t index = 0;
    double left = double(u), weight = 1;
    while (nodes[index].count > 1) {
        if (isEven(nodes[index], point, normal))
            return index == 0 ? chooseByPower(left) : byPower(nodes[index], left, weight);
        const uint32_t first = index + 1, second = nodes[index].second;
        const double a = double(importance(nodes[first], point, normal, boxNormal));
        const double b = double(importance(nodes[second], point, normal, boxNormal));
        if (!(a + b > 0)) return {0, 0, u};
        const double at = left * (a + b);
        const bool isFirst = at < a || !(b > 0);
        const double own = 1 / (isFirst ? a : b);
        index = isFirst ? first : second;
        weight *= (a + b) * own;
        left = (isFirst ? at : at - a) * own;
    }
    return {nodes[index].first, float(weight), std::clamp(float(left), 0.0f, 0.9999999f)};
}

}  // namespace raybundle
