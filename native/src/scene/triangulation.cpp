// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/triangulation.h"

namespace raybundle {

glm::dvec3 vectorArea(const std::vector<glm::dvec3>& points) {
    glm::dvec3 sum(0.0);
    for (size_t i = 1; i + 1 < points.size(); ++i)
        sum += glm::cross(points[i] - points[0], points[i + 1] - points[0]);
    return 0.5 * sum;
}

std::vector<std::array<int, 3>> triangulate(const std::vector<glm::dvec3>& points) {
    const glm::dvec3 normal = vectorArea(points);
    // Positive where the corner a, b, c turns as the polygon does.
    auto turn = [&](int a, int b, int c) {
        return glm::dot(glm::cross(points[b] - points[a], points[c] - points[b]), normal);
    };
    auto contains = [&](int a, int b, int c, int p) {
        return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
    };

    std::vector<int> ring(points.size());
    for (size_t i = 0; i < ring.size(); ++i) ring[i] = int(i);
    // Only a corner that turns the other way can lie inside an ear.
    std::vector<int> reflex;
    for (size_t i = 0, n = points.size(); i < n; ++i)
        if (turn(int((i + n - 1) % n), int(i), int((i + 1) % n)) <= 0) reflex.push_back(int(i));

    std::vector<std::array<int, 3>> triangles;
    triangles.reserve(points.size() - 2);
    while (ring.size() > 3) {
        const size_t n = ring.size();
        // Of all ears cut the best-shaped one: the shortest diagonal gives the fewest slivers.
        size_t best = n;
        double bestDiagonal = 0;
        for (size_t i = 0; i < n; ++i) {
            const int a = ring[(i + n - 1) % n], b = ring[i], c = ring[(i + 1) % n];
            if (turn(a, b, c) <= 0) continue;
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
