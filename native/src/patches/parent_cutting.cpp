// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/parent_cutting.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

#include "scene/triangulation.h"

namespace raybundle {
namespace {

// A triangle is bisected at its longest edge while that edge is longer than this many times the
// height, and longer than two patches. A grid of n^2 slivers would waste patches.
constexpr double kMaxElongation = 4.0;
// Triangles elongated by more than this factor are cut across instead, into as many pieces as they
// are elongated. Bisections would give the elongation to the power of 1.6 as the number of pieces,
// each as long as the triangle.
constexpr double kNeedle = 16.0;
// Faces are left out if their height is less than kFlat times their longest edge. They are also
// left out if their height is less than the rounding error of their coordinates (kFlatEpsilons
// epsilons) and less than kSliver times their longest edge, because their normals would be only
// rounding error. The second condition keeps small well-shaped faces of large scenes.
constexpr double kFlat = 1e-7;
constexpr double kFlatEpsilons = 4, kSliver = 1e-2;
// Distance of the fourth corner of a parallelogram from its exact place, relative to the longer
// edge.
constexpr double kParallelogramTolerance = 1e-4;
// Largest number of tiles along an edge.
constexpr int kMaxGrid = 4096;

// Returns the number of patches of about `size` along a length.
uint16_t gridCount(double length, double size) {
    // The slack of a hundredth of a patch makes a length of exactly n patches give n.
    return uint16_t(std::clamp(int(std::ceil(length / size - 0.01)), 1, kMaxGrid));
}

// Returns whether both halves of an edge are certain to be shorter than the edge. The middle is
// rounded by half an epsilon of its coordinates, and without this check pieces of pieces might not
// become smaller.
bool hasMiddle(const glm::vec3& a, const glm::vec3& b) {
    const glm::vec3 most = glm::max(glm::abs(a), glm::abs(b));
    return glm::distance(a, b) > 16 * FLT_EPSILON * std::max({most.x, most.y, most.z});
}

}  // namespace

bool isParallelogram(const std::vector<glm::dvec3>& p) {
    const double longest = std::max(glm::length(p[1] - p[0]), glm::length(p[3] - p[0]));
    const double off = glm::length(p[0] - p[1] + p[2] - p[3]);
    return off <= kParallelogramTolerance * longest && !isFlat(p[0], p[1], p[3]);
}

bool isFlat(const glm::dvec3& p0, const glm::dvec3& p1, const glm::dvec3& p2) {
    const double longest =
        std::max({glm::length(p1 - p0), glm::length(p2 - p1), glm::length(p0 - p2)});
    const double height = glm::length(glm::cross(p1 - p0, p2 - p0)) / longest;
    const glm::dvec3 most = glm::max(glm::abs(p0), glm::max(glm::abs(p1), glm::abs(p2)));
    const double rounding =
        kFlatEpsilons * double(FLT_EPSILON) * std::max({most.x, most.y, most.z});
    return !(height > std::max(kFlat * longest, std::min(rounding, kSliver * longest)));
}

// Returns a parent of a cell with three of its corners, without a grid and vertices.
Parent ParentCutting::makeParent(uint32_t cell, const std::array<uint32_t, 3>& corners) const {
    const Cell& of = patches.cells[cell];
    const glm::dvec3 p0(patches.vertices[corners[0]]), pa(patches.vertices[corners[1]]),
        pb(patches.vertices[corners[2]]);
    Parent parent;
    parent.origin = glm::vec3(p0);
    parent.a = glm::vec3(pa - p0);
    parent.b = glm::vec3(pb - p0);
    // Use the normal of the cell: that of a tiny piece would be only rounding error.
    parent.normal = glm::vec3(of.normal());
    parent.instance = of.instance;
    parent.face = of.face;
    parent.cell = cell;
    parent.vertex = {0, 0, 0, 0};
    return parent;
}

void ParentCutting::addParallelogram(uint32_t cell, const std::vector<uint32_t>& v, double size) {
    Parent parent = makeParent(cell, {v[0], v[1], v[3]});
    std::copy(v.begin(), v.end(), parent.vertex.begin());
    parent.isTriangle = false;
    parent.countA = gridCount(glm::length(parent.a), size);
    parent.countB = gridCount(glm::length(parent.b), size);
    patches.parents.push_back(parent);
}

void ParentCutting::addPolygon(uint32_t cell, const std::vector<uint32_t>& v, double size) {
    std::vector<glm::dvec3> points;
    for (uint32_t vertex : v) points.push_back(patches.vertices[vertex]);
    for (const std::array<int, 3>& t : triangulate(points)) {
        double longest = 0;
        for (size_t k = 0; k < 3; ++k)
            longest = std::max(longest,
                               glm::distance(points[size_t(t[k])], points[size_t(t[(k + 1) % 3])]));
        cutTriangle(cell, {v[size_t(t[0])], v[size_t(t[1])], v[size_t(t[2])]},
                    std::max(size, longest / kMaxGrid));
    }
}

void ParentCutting::cutTriangle(uint32_t cell, const Triangle& v, double size) {
    const glm::dvec3 p[3] = {patches.vertices[v[0]], patches.vertices[v[1]],
                             patches.vertices[v[2]]};
    int longest = 0;
    double length[3];
    for (int k = 0; k < 3; ++k) {
        length[k] = glm::length(p[(k + 1) % 3] - p[k]);
        if (length[k] > length[longest]) longest = k;
    }
    const double doubleArea = glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
    const double height = doubleArea / length[longest];
    if (length[longest] > kMaxElongation * height && length[longest] > 2 * size &&
        hasMiddle(p[longest], p[(longest + 1) % 3])) {
        const uint32_t v0 = v[longest], v1 = v[(longest + 1) % 3], v2 = v[(longest + 2) % 3];
        const double after = length[(longest + 1) % 3], before = length[(longest + 2) % 3];
        const glm::dvec3 edge = p[(longest + 1) % 3] - p[longest];
        const double along =
            glm::dot(p[(longest + 2) % 3] - p[longest], edge) / (length[longest] * length[longest]);
        const glm::vec3 foot(p[longest] + along * edge);
        if (length[longest] < kNeedle * height) {
            const uint32_t middle = middleVertex(v0, v1);
            cutTriangle(cell, {v0, middle, v2}, size);
            cutTriangle(cell, {middle, v1, v2}, size);
        } else if (std::min(after, before) > std::max(2 * size, 2 * height) &&
                   foot != patches.vertices[v0] && foot != patches.vertices[v1]) {
            // The triangle is obtuse: cut it at its height, into two needles.
            patches.vertices.push_back(foot);
            const uint32_t v3 = uint32_t(patches.vertices.size()) - 1;
            cutTriangle(cell, {v0, v3, v2}, size);
            cutTriangle(cell, {v3, v1, v2}, size);
        } else if (after < before) {
            cutNeedle(cell, {v0, v1, v2}, size);
        } else {
            cutNeedle(cell, {v1, v2, v0}, size);
        }
        return;
    }
    addTriangle(cell, v, std::sqrt(0.5 * doubleArea), length[longest], size);
}

// Cuts a triangle with a sharp point at v[0] and a short edge opposite.
void ParentCutting::cutNeedle(uint32_t cell, const Triangle& v, double size) {
    const uint32_t right = middleVertex(v[0], v[1]), left = middleVertex(v[0], v[2]);
    cutTriangle(cell, {v[0], right, left}, size);
    cutStrip(cell, {right, v[1]}, {left, v[2]}, size);
}

// Cuts the strip between two edges that are almost parallel and much longer than their distance.
// `top` lies to the left of `bottom`, and both run in the same direction.
void ParentCutting::cutStrip(uint32_t cell, const std::array<uint32_t, 2>& bottom,
                             const std::array<uint32_t, 2>& top, double size) {
    auto isLong = [&](const std::array<uint32_t, 2>& edge) {
        const glm::vec3 &a = patches.vertices[edge[0]], &b = patches.vertices[edge[1]];
        return glm::distance(a, b) > 2 * size && hasMiddle(a, b);
    };
    if (!isLong(bottom) && !isLong(top)) {
        cutTriangle(cell, {bottom[0], bottom[1], top[1]}, size);
        cutTriangle(cell, {bottom[0], top[1], top[0]}, size);
        return;
    }
    const uint32_t low = middleVertex(bottom[0], bottom[1]);
    const uint32_t high = middleVertex(top[0], top[1]);
    cutStrip(cell, {bottom[0], low}, {top[0], high}, size);
    cutStrip(cell, {low, bottom[1]}, {high, top[1]}, size);
}

void ParentCutting::addTriangle(uint32_t cell, const Triangle& v, double edge, double longest,
                                double size) {
    if (!(edge > 0)) return;  // rounding left no area
    Parent parent = makeParent(cell, v);
    std::copy(v.begin(), v.end(), parent.vertex.begin());
    // As many patches as squares of the patch size cover the area, but with edges of about 2 `size`
    // at most.
    parent.countA = parent.countB = gridCount(std::max(edge / size, longest / (2.0 * size)), 1.0);
    patches.parents.push_back(parent);
}

uint32_t ParentCutting::middleVertex(uint32_t v0, uint32_t v1) {
    const auto key = std::minmax(v0, v1);
    const auto found = middles.find(key);
    if (found != middles.end()) return found->second;
    patches.vertices.push_back(0.5f * (patches.vertices[v0] + patches.vertices[v1]));
    const uint32_t middle = uint32_t(patches.vertices.size()) - 1;
    middles.emplace(key, middle);
    return middle;
}

}  // namespace raybundle
