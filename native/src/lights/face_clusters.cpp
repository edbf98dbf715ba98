// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/face_clusters.h"

#include <algorithm>
#include <cmath>

#include "job/cancellation.h"

namespace raybundle {
namespace {

// A cluster counts as far from this number of its radii on. The error of its irradiance is then
// below 1 %, and that of all clusters together about 0.1 %.
constexpr float kFarFromCluster = 4;

glm::dmat3 square(const glm::dvec3& v) { return glm::outerProduct(v, v); }

// Returns the mean outer product of the offset of a face's points from its middle with itself, m^2.
glm::dmat3 spreadOf(const LightFace& face) {
    const glm::dvec3 a(face.a), b(face.b);
    if (!face.isTriangle) return (square(a) + square(b)) / 12.0;
    return (square(a) + square(b) + square(a - b)) / 36.0;
}

}  // namespace

// Expands the product of both cosines over the squared distance to second order about the middle.
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

FaceClusters::FaceClusters(const LightTree& tree, const std::vector<LightFace>& faces,
                           const std::vector<glm::vec3>& radiance) {
    // Sums over the faces of a cluster. Places are relative to the first face, to keep precision.
    struct Sum {
        double power = 0;
        glm::dvec3 vector{0.0}, place{0.0};
        glm::dmat3 squares{0.0}, products{0.0};
    };
    for (const LightTree::Node& node : tree.clusters()) {
        std::array<Sum, 3> sums;
        const glm::dvec3 about(faces[node.first].origin);
        for (uint32_t k = node.first; k < node.first + node.count; ++k) {
            throwIfCancelledAt(k);
            const LightFace& face = faces[k];
            const glm::dvec3 normal(face.normal), place = glm::dvec3(face.middle()) - about;
            const glm::dmat3 products = glm::outerProduct(normal, place);
            const glm::dmat3 squares = square(place) + spreadOf(face);
            for (int c = 0; c < 3; ++c) {
                Sum& sum = sums[size_t(c)];
                const double own = double(radiance[k][c] * face.area());
                sum.power += own;
                sum.vector += own * normal;
                sum.place += own * place;
                sum.squares += own * squares;
                sum.products += own * products;
            }
        }
        std::array<DistantLight, 3>& own = light.emplace_back();
        for (size_t c = 0; c < 3; ++c) {
            const Sum& sum = sums[c];
            if (!(sum.power > 0)) continue;
            const glm::dvec3 middle = sum.place / sum.power;
            own[c] = {glm::vec3(sum.vector), glm::vec3(about + middle),
                      glm::mat3(sum.squares / sum.power - square(middle)),
                      glm::mat3(sum.products - glm::outerProduct(sum.vector, middle))};
        }
    }
}

glm::vec3 FaceClusters::irradiance(const LightTree& tree, const glm::vec3& point,
                                   const glm::vec3& normal,
                                   const std::function<glm::vec3(uint32_t)>& ofFace) const {
    const std::vector<LightTree::Node>& nodes = tree.clusters();
    glm::vec3 sum(0.0f);
    for (size_t k = 0; k < nodes.size();) {
        const LightTree::Node& node = nodes[k];
        // Index after this cluster and all clusters within it.
        const size_t next = k + 2 * node.count - 1;
        const glm::vec3 d = node.centre - point;
        const float distance = glm::length(d), height = glm::dot(d, normal);
        // In a cone wider than half a turn, the normals may point in any direction.
        const float opening = node.cosine > 0 ? node.sine : 1;
        const float slant = -glm::dot(node.axis, d), spread = opening * distance + node.radius;
        if (height <= -node.radius || slant <= -spread) {
            k = next;
        } else if (distance > kFarFromCluster * node.radius && height > node.radius &&
                   slant > spread) {
            for (size_t c = 0; c < 3; ++c) sum[int(c)] += light[k][c].irradiance(point, normal);
            k = next;
        } else {
            if (node.count == 1) sum += ofFace(node.first);
            ++k;
        }
    }
    return sum;
}

}  // namespace raybundle
