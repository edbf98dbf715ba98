// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/face_clusters.h"

#include <algorithm>
#include <cmath>

#include "transport/mesh_outline.h"

namespace raybundle {
namespace {

// A cluster is far at so many times its radius: what it gives is then off by less than 1 %, and all
// of them together by 0.1 %.
constexpr float kFar = 4;

glm::dmat3 square(const glm::dvec3& v) { return glm::outerProduct(v, v); }

// Mean product of what the points of a face are off its middle, m^2.
glm::dmat3 spreadOf(const LightFace& face) {
    const glm::dvec3 a(face.a), b(face.b);
    if (!face.isTriangle) return (square(a) + square(b)) / 12.0;
    return (square(a) + square(b) + square(a - b)) / 36.0;
}

}  // namespace

// The product of both cosines over the square of the distance, expanded about the middle.
float FaceClusters::DistantLight::irradiance(const glm::vec3& point,
                                             const glm::vec3& normal) const {
    const glm::vec3 d = middle - point, v = spread * d;
    const float perSquare = 1 / glm::dot(d, d);
    const float sent = -glm::dot(vector, d), received = glm::dot(normal, d);
    const float trace = spread[0][0] + spread[1][1] + spread[2][2];
    const float bent = bend[0][0] + bend[1][1] + bend[2][2];
    const float even = sent * received;
    const float ofBend = -(bent * received + glm::dot(d, bend * normal)) +
                         4 * perSquare * received * glm::dot(d, bend * d);
    const float ofSpread = -glm::dot(vector, spread * normal) -
                           4 * perSquare * glm::dot(sent * normal - received * vector, v) +
                           even * perSquare * (12 * perSquare * glm::dot(d, v) - 2 * trace);
    return std::max(0.0f, (even + ofBend + ofSpread) * perSquare * perSquare);
}

FaceClusters::FaceClusters(const std::vector<LightFace>& faces,
                           const std::vector<glm::vec3>& radiance,
                           const std::vector<Plane>& planes) {
    if (faces.empty()) return;
    for (size_t k = 0; k < faces.size(); ++k) {
        const LightFace& face = faces[k];
        const glm::dvec3 o(face.origin), a(face.a), b(face.b);
        Face shape{{o, o + a, o + b, o}, 3, radiance[k], planes[k]};
        if (!face.isTriangle) shape = {{o, o + a, o + a + b, o + b}, 4, radiance[k], planes[k]};
        shapes.push_back(shape);
    }
    nodes.reserve(2 * faces.size());
    build(faces, radiance, 0, uint32_t(faces.size()));
}

// Halves as LightTree has them, so that those of a cluster lie together.
void FaceClusters::build(const std::vector<LightFace>& faces,
                         const std::vector<glm::vec3>& radiance, uint32_t first, uint32_t count) {
    const uint32_t index = uint32_t(nodes.size());
    Node node{};
    glm::dvec3 low(INFINITY), high(-INFINITY), normals(0.0);
    // By channel, relative to `about`.
    struct Sum {
        double power = 0;
        glm::dvec3 vector{0.0}, place{0.0};
        glm::dmat3 squares{0.0}, products{0.0};
    };
    std::array<Sum, 3> sums;
    const glm::dvec3 about(faces[first].origin);
    for (uint32_t k = first; k < first + count; ++k) {
        for (int c = 0; c < shapes[k].count; ++c) {
            low = glm::min(low, shapes[k].corners[size_t(c)]);
            high = glm::max(high, shapes[k].corners[size_t(c)]);
        }
        normals += glm::dvec3(faces[k].normal);
        const glm::dvec3 normal(faces[k].normal), place = glm::dvec3(faces[k].middle()) - about;
        for (int c = 0; c < 3; ++c) {
            Sum& sum = sums[size_t(c)];
            const double own = double(radiance[k][c] * faces[k].area());
            sum.power += own;
            sum.vector += own * normal;
            sum.place += own * place;
            sum.squares += own * (square(place) + spreadOf(faces[k]));
            sum.products += own * glm::outerProduct(normal, place);
        }
    }
    node.centre = glm::vec3(0.5 * (low + high));
    node.radius = float(0.5 * glm::length(high - low));
    const bool hasAxis = glm::length(normals) > 1e-3 * double(count);
    node.axis = hasAxis ? glm::vec3(glm::normalize(normals)) : glm::vec3(0, 0, 1);
    node.cosine = 1;
    for (uint32_t k = first; k < first + count; ++k)
        node.cosine = std::min(node.cosine, glm::dot(node.axis, faces[k].normal));
    node.sine = node.cosine > 0 ? std::sqrt(std::max(0.0f, 1 - node.cosine * node.cosine)) : 1;
    node.face = count == 1 ? first : kNoFace;
    for (size_t c = 0; c < 3; ++c) {
        const Sum& sum = sums[c];
        if (!(sum.power > 0)) continue;
        const glm::dvec3 middle = sum.place / sum.power;
        node.light[c] = {glm::vec3(sum.vector), glm::vec3(about + middle),
                         glm::mat3(sum.squares / sum.power - square(middle)),
                         glm::mat3(sum.products - glm::outerProduct(sum.vector, middle))};
    }
    nodes.push_back(node);
    if (count > 1) {
        build(faces, radiance, first, count / 2);
        build(faces, radiance, first + count / 2, count - count / 2);
    }
    nodes[index].next = uint32_t(nodes.size());
}

glm::vec3 FaceClusters::irradiance(const glm::vec3& point, const glm::vec3& normal) const {
    glm::vec3 sum(0.0f);
    for (uint32_t k = 0; k < nodes.size();) {
        const Node& node = nodes[k];
        const glm::vec3 d = node.centre - point;
        const float height = glm::dot(d, normal), distance2 = glm::dot(d, d);
        const float distance = std::sqrt(distance2);
        // What its normals lack to a right angle to the receiver, less what cone and sphere take.
        const float slant = -glm::dot(node.axis, d), spread = node.sine * distance + node.radius;
        if (height <= -node.radius || slant <= -spread) {
            k = node.next;
            continue;
        }
        if (distance > kFar * node.radius && height > node.radius && slant > spread) {
            for (size_t c = 0; c < 3; ++c) sum[int(c)] += node.light[c].irradiance(point, normal);
            k = node.next;
            continue;
        }
        if (node.face != kNoFace) {
            const Face& face = shapes[node.face];
            if (face.plane.side(point) == PlaneSide::FRONT)
                sum += face.radiance *
                       float(polygonIrradiance(point, normal, face.corners.data(), face.count));
        }
        ++k;
    }
    return sum;
}

}  // namespace raybundle
