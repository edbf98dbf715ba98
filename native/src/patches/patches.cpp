// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/patches.h"

#include <algorithm>
#include <cmath>

namespace raybundle {

namespace {

// An element of a regular grid over the unit square or the unit triangle, and a place in the
// element. `inside` holds affine coordinates of the element, as (s, t) are those of the parent.
struct GridPlace {
    uint32_t index;
    glm::vec2 inside;
};

// Returns the element of a grid at affine coordinates, which are clamped to the grid.
GridPlace placeAt(bool isTriangle, int countA, int countB, glm::vec2 st) {
    const glm::vec2 at = st * glm::vec2(countA, countB);
    const int row = int(std::clamp(at.y, 0.0f, float(countB - 1)));
    // Row r of a triangle has n - r upright triangles, with n - r - 1 upside-down ones between
    // them.
    const int columns = isTriangle ? countA - row : countA;
    const int column = int(std::clamp(at.x, 0.0f, float(columns - 1)));
    const glm::vec2 inside = at - glm::vec2(column, row);
    if (!isTriangle) return {uint32_t(row * countA + column), inside};
    const bool upsideDown = inside.x + inside.y > 1.0f && column < columns - 1;
    return {uint32_t(row * (2 * countA - row) + 2 * column + (upsideDown ? 1 : 0)),
            upsideDown ? 1.0f - inside : inside};
}

// Returns the affine coordinates of a place in a grid, the inverse of placeAt().
glm::vec2 pointAt(bool isTriangle, int countA, int countB, const GridPlace& place) {
    const uint32_t index = place.index;
    if (!isTriangle)
        return {(index % countA + place.inside.x) / countA,
                (index / countA + place.inside.y) / countB};
    const int n = countA;
    // Find the largest row with row * (2n - row) <= index. The loops correct the rounding of sqrt.
    int row = int(n - std::sqrt(std::max(0.0, double(n) * n - index)));
    while (row > 0 && uint32_t(row * (2 * n - row)) > index) --row;
    while (uint32_t((row + 1) * (2 * n - row - 1)) <= index) ++row;
    const int inRow = int(index) - row * (2 * n - row);
    const glm::vec2 base(inRow / 2, row);
    return (inRow % 2 ? base + 1.0f - place.inside : base + place.inside) / float(n);
}

}  // namespace

uint32_t Parent::tileOf(uint32_t patchInParent) const {
    if (!cut) return patchInParent;
    const auto& first = cut->first;
    return uint32_t(std::upper_bound(first.begin(), first.end(), patchInParent) - first.begin()) -
           1;
}

uint32_t Parent::patchAt(float s, float t) const {
    const GridPlace tile = placeAt(isTriangle, countA, countB, {s, t});
    if (!cut) return tile.index;
    const int n = 1 << cut->level[tile.index];
    const uint32_t first = cut->first[tile.index];
    return n == 1 ? first : first + placeAt(isTriangle, n, n, tile.inside).index;
}

glm::vec2 Parent::pointOn(uint32_t patchInParent, glm::vec2 uv) const {
    // Fold the unit square onto the lower triangle.
    if (isTriangle && uv.x + uv.y > 1.0f) uv = 1.0f - uv;
    if (!cut) return pointAt(isTriangle, countA, countB, {patchInParent, uv});
    const uint32_t tile = tileOf(patchInParent);
    const int n = 1 << cut->level[tile];
    if (n > 1) uv = pointAt(isTriangle, n, n, {patchInParent - cut->first[tile], uv});
    return pointAt(isTriangle, countA, countB, {tile, uv});
}

namespace {

// Returns s and t such that s a + t b is the projection of d on the plane of a and b, by the dual
// basis. In double precision, because the fourth power of a length underflows in float at 1e-10 m,
// and because the difference keeps no digit for slivers 4000 times as long as wide.
std::pair<float, float> affine(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& d) {
    const double aa = glm::dot(a, a), ab = glm::dot(a, b), bb = glm::dot(b, b);
    const double det = aa * bb - ab * ab;
    return {float((bb * glm::dot(d, a) - ab * glm::dot(d, b)) / det),
            float((aa * glm::dot(d, b) - ab * glm::dot(d, a)) / det)};
}

}  // namespace

glm::vec2 Parent::affineAt(const glm::dvec3& point) const {
    const auto [s, t] = affine(a, b, point - glm::dvec3(origin));
    return {s, t};
}

std::array<float, 4> Cell::weights(const glm::vec3& point) const {
    const auto [s, t] = affine(a, b, glm::dvec3(point) - glm::dvec3(origin));
    if (isTriangle()) return {1 - s - t, s, t, 0};
    return {(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t};
}

glm::vec3 Patches::point(uint32_t patch, glm::vec2 uv) const {
    const Parent& parent = parents[parentOf[patch]];
    return parent.position(parent.pointOn(patch - parent.firstPatch, uv));
}

uint32_t Patches::patchAt(uint32_t parentIndex, const glm::vec3& point) const {
    const Parent& parent = parents[parentIndex];
    const glm::vec2 st = parent.affineAt(glm::dvec3(point));
    return parent.firstPatch + parent.patchAt(st.x, st.y);
}

}  // namespace raybundle
