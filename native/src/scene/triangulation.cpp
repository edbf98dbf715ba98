// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/triangulation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace raybundle {

glm::dvec3 vectorArea(const std::vector<glm::dvec3>& points) {
    glm::dvec3 sum(0.0);
    for (size_t i = 1; i + 1 < points.size(); ++i)
        sum += glm::cross(points[i] - points[0], points[i + 1] - points[0]);
    return 0.5 * sum;
}

namespace {

// A corner counts as straight if its height above the line between its neighbours is at most
// kStraight times their distance, or at most kRounding times the largest coordinate, which is
// rounding error.
constexpr double kStraight = 1e-5;
constexpr double kRounding = 4 * double(std::numeric_limits<float>::epsilon());

}  // namespace

std::vector<std::array<int, 3>> triangulate(const std::vector<glm::dvec3>& points) {
    if (points.size() == 3) return {{0, 1, 2}};
    const glm::dvec3 normal = vectorArea(points);
    const double area = glm::length(normal);
    double rounding = 0;  // metres
    for (const glm::dvec3& p : points)
        rounding =
            std::max(rounding, kRounding * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}));
    // Returns a value that is positive if the corner b of a, b, c turns as the polygon does.
    auto turn = [&](int a, int b, int c) {
        return glm::dot(glm::cross(points[b] - points[a], points[c] - points[b]), normal);
    };
    // Returns whether the corner b turns as the polygon does by more than rounding turns a straight
    // corner. The triangle of a straight corner would have a random normal, or be left out for want
    // of area.
    auto isConvex = [&](int a, int b, int c) {
        const double diagonal = glm::length(points[c] - points[a]);
        return turn(a, b, c) > area * diagonal * std::max(kStraight * diagonal, rounding);
    };
    auto contains = [&](int a, int b, int c, int p) {
        return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
    };

    std::vector<int> ring(points.size());
    for (size_t i = 0; i < ring.size(); ++i) ring[i] = int(i);
    // Only a reflex or straight corner can lie inside an ear.
    std::vector<int> reflex;
    for (size_t i = 0, n = points.size(); i < n; ++i)
        if (!isConvex(int((i + n - 1) % n), int(i), int((i + 1) % n))) reflex.push_back(int(i));

    std::vector<std::array<int, 3>> triangles;
    triangles.reserve(points.size() - 2);
    while (ring.size() > 3) {
        const size_t n = ring.size();
        // Of all ears, cut the one with the shortest diagonal, which gives the fewest slivers.
        size_t best = n;
        double bestDiagonal = 0;
        for (size_t i = 0; i < n; ++i) {
            const int a = ring[(i + n - 1) % n], b = ring[i], c = ring[(i + 1) % n];
            if (!isConvex(a, b, c)) continue;
            bool ear = true;
            for (int p : reflex)
                if (p != a && p != b && p != c && points[p] != points[a] &&
                    points[p] != points[b] && points[p] != points[c] && contains(a, b, c, p)) {
                    ear = false;
                    break;
                }
            const glm::dvec3 diagonal = points[c] - points[a];
            const double length = glm::dot(diagonal, diagonal);
            if (ear && (best == n || length < bestDiagonal)) {
                best = i;
                bestDiagonal = length;
            }
        }
        if (best == n) break;
        triangles.push_back({ring[(best + n - 1) % n], ring[best], ring[(best + 1) % n]});
        ring.erase(ring.begin() + best);
    }
    for (size_t i = 1; i + 1 < ring.size(); ++i)
        triangles.push_back({ring[0], ring[i], ring[i + 1]});
    return triangles;
}

}  // namespace raybundle
