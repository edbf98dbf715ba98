// SPDX-License-Identifier: GPL-3.0-or-later
//
// The steps that change a RefinedMesh: bisections, flips, and bisections for better angles. Their
// sources are named in patches/refined_mesh.h.
#include <algorithm>
#include <cmath>
#include <map>

#include "job/cancellation.h"
#include "patches/refined_mesh.h"

namespace raybundle {
namespace {

// Angles whose cosine is larger are too small: 20 degrees, and a little more because positions are
// stored as floats.
const double kSmall = std::cos(glm::radians(20.3));
// Edges are flipped only between triangles whose planes differ by less than this angle, radians.
constexpr double kSamePlane = 1e-3;
// Least gain of a flip, as the sine of the angle by which the sum of the two opposite angles
// exceeds 180 degrees.
constexpr double kLeastGain = 1e-7;
// Bisections for better angles, per triangle to be improved: at small angles of the source they
// may go on for long.
constexpr size_t kMostSteps = 30;
// Triangles with a shorter edge than this are not improved: the share of the shortest edge that a
// face has without improvements. It bounds what happens at small angles of the source.
constexpr double kShortest = 0.3;
// The same for triangles at lines, which are then given up.
constexpr double kShortestLine = 0.7;
// Sine of the angle to a line below which a point is on it. Points are rounded to floats.
constexpr double kOnLine = 1e-5;

// Returns whether a point lies on the side of a line from which `side` points away, by its position
// relative to a point of the line. A point on the line, where rounding would decide, does not.
bool isBefore(const glm::dvec3& side, const glm::dvec3& point) {
    return glm::dot(side, point) < -kOnLine * glm::length(side) * glm::length(point);
}

}  // namespace

void RefinedMesh::noteShortestEdges(size_t firstTriangle) {
    for (size_t t = firstTriangle; t < all.size(); ++t) {
        double& least = shortest[size_t(all[t].face)];
        for (size_t k = 0; k < 3; ++k) least = std::min(least, std::sqrt(edgeLength2(all[t], k)));
    }
    improvedFrom = all.size();
}

RefinedMesh::Angle RefinedMesh::smallestAngle(const Triangle& triangle) const {
    Angle result{-1, 0};
    for (size_t k = 0; k < 3; ++k) {
        const glm::dvec3 a = position(triangle, next(k)) - position(triangle, k);
        const glm::dvec3 b = position(triangle, last(k)) - position(triangle, k);
        const double cosine = glm::dot(a, b) / std::sqrt(glm::dot(a, a) * glm::dot(b, b));
        if (!(cosine <= result.cosine)) result = {cosine, k};
    }
    return result;
}

bool RefinedMesh::isTooShort(const Triangle& triangle, double share) const {
    const double least = share * shortest[size_t(triangle.face)];
    for (size_t k = 0; k < 3; ++k)
        if (edgeLength2(triangle, k) < least * least) return true;
    return false;
}

// Between two fixed edges, no bisection can enlarge an angle.
bool RefinedMesh::isPoor(const Triangle& triangle) const {
    const size_t face = size_t(triangle.face);
    if (!triangle.isAlive || !isTouched[face] || isThin[face] || hasDoubles[face]) return false;
    const auto [cosine, at] = smallestAngle(triangle);
    if (!(cosine > kSmall)) return false;
    return !isTooShort(triangle, kShortest) &&
           (!isFixed(triangle, at) || !isFixed(triangle, last(at)));
}

void RefinedMesh::bisect(const std::vector<uint32_t>& ring, double share) {
    const uint32_t edge = ring.front();
    const uint32_t end = all[edge / 3].place[edge % 3];  // the place at one end
    const uint32_t middle = uint32_t(places.size());
    places.push_back((1 - share) * places[end] +
                     share * places[all[edge / 3].place[next(edge % 3)]]);
    std::map<std::array<uint32_t, 2>, uint32_t> vertexBetween;
    std::vector<uint32_t> atEnd, beyond, outer;
    for (uint32_t one : ring) {
        const Triangle old = all[one / 3];
        const size_t k = one % 3, b = next(k), c = last(k);
        const bool beginsAtEnd = old.place[k] == end;
        const std::array<uint32_t, 2> ends{old.vertex[beginsAtEnd ? k : b],
                                           old.vertex[beginsAtEnd ? b : k]};
        const auto [found, isNew] = vertexBetween.try_emplace(ends, uint32_t(vertices.size()));
        if (isNew)
            vertices.push_back(
                {(1 - share) * vertices[ends[0]].position + share * vertices[ends[1]].position,
                 middle});
        const uint32_t vertex = found->second;
        Triangle half = old;
        half.points.clear();
        half.place = {old.place[k], middle, old.place[c]};
        half.vertex = {old.vertex[k], vertex, old.vertex[c]};
        half.sourceEdge = {old.sourceEdge[k], -1, old.sourceEdge[c]};
        half.isAbrupt = {old.isAbrupt[k], false, old.isAbrupt[c]};
        const uint32_t first = add(half);
        half.place = {middle, old.place[b], old.place[c]};
        half.vertex = {vertex, old.vertex[b], old.vertex[c]};
        half.sourceEdge = {old.sourceEdge[k], old.sourceEdge[b], -1};
        half.isAbrupt = {old.isAbrupt[k], old.isAbrupt[b], false};
        const uint32_t second = add(half);
        all[one / 3].isAlive = false;
        isTouched[size_t(old.face)] = 1;
        replaceInRing(3 * (one / 3) + uint32_t(c), 3 * first + 2);
        replaceInRing(3 * (one / 3) + uint32_t(b), 3 * second + 1);
        link({3 * first + 1, 3 * second + 2});
        (beginsAtEnd ? atEnd : beyond).push_back(3 * first);
        (beginsAtEnd ? beyond : atEnd).push_back(3 * second);
        outer.push_back(3 * first + 2);
        outer.push_back(3 * second + 1);
        const glm::dvec3 across = places[old.place[c]] - places[middle];
        const glm::dvec3 side = glm::cross(across, areaVector(old));
        for (uint32_t p : old.points) {
            // cross(across, normal) points away from the first half.
            const bool isFirst = isBefore(side, points[p] - places[middle]);
            all[isFirst ? first : second].points.push_back(p);
        }
        all[one / 3].points = {};
    }
    link(atEnd);
    link(beyond);
    flipAll(std::move(outer));
}

void RefinedMesh::flipAll(std::vector<uint32_t> stack) {
    while (!stack.empty()) {
        const uint32_t edge = stack.back();
        stack.pop_back();
        if (all[edge / 3].isAlive) flipIfBetter(edge, stack);
    }
}

// Delaunay's condition for two triangles abc and bad: the angles at c and d sum to at most 180
// degrees.
bool RefinedMesh::flipIfBetter(uint32_t edge, std::vector<uint32_t>& stack) {
    const uint32_t other = all[edge / 3].ring[edge % 3];
    if (other == edge || all[other / 3].ring[other % 3] != edge) return false;
    const size_t i = edge % 3, j = other % 3;
    const Triangle one = all[edge / 3], two = all[other / 3];
    if (isFixed(one, i) || one.face != two.face || one.vertex[i] != two.vertex[next(j)] ||
        one.vertex[next(i)] != two.vertex[j] || one.place[last(i)] == two.place[last(j)])
        return false;
    const glm::dvec3 a = position(one, i), b = position(one, next(i)), c = position(one, last(i)),
                     d = position(two, last(j));
    const glm::dvec3 first = areaVector(one), second = areaVector(two);
    const glm::dvec3 sum = first + second;
    const double size = glm::length(sum);
    if (!(size > 0)) return false;
    const glm::dvec3 normal = sum / size;
    // A triangle without area lies in any plane.
    auto isFlat = [&](const glm::dvec3& v) {
        return glm::dot(v, normal) >= 0 && glm::length(v - glm::dot(v, normal) * normal) <=
                                               kSamePlane * glm::length(v) + 1e-9 * size;
    };
    if (!isFlat(first) || !isFlat(second)) return false;
    auto sine = [](const glm::dvec3& u, const glm::dvec3& v) {
        return glm::length(glm::cross(u, v));
    };
    const double sinC = sine(a - c, b - c), cosC = glm::dot(a - c, b - c);
    const double sinD = sine(a - d, b - d), cosD = glm::dot(a - d, b - d);
    const double scale = std::sqrt(glm::dot(a - c, a - c) * glm::dot(b - c, b - c) *
                                   glm::dot(a - d, a - d) * glm::dot(b - d, b - d));
    if (!(sinC * cosD + cosC * sinD < -kLeastGain * scale)) return false;
    auto turned = [&](const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& r) {
        return glm::dot(glm::cross(q - p, r - p), normal);
    };
    if (!(turned(a, d, c) > 1e-9 * size) || !(turned(d, b, c) > 1e-9 * size)) return false;

    Triangle made = one;
    made.points.clear();
    made.place = {one.place[i], two.place[last(j)], one.place[last(i)]};
    made.vertex = {one.vertex[i], two.vertex[last(j)], one.vertex[last(i)]};
    made.sourceEdge = {two.sourceEdge[next(j)], -1, one.sourceEdge[last(i)]};
    made.isAbrupt = {two.isAbrupt[next(j)], false, one.isAbrupt[last(i)]};
    const uint32_t atA = add(made);
    made.place = {two.place[last(j)], one.place[next(i)], one.place[last(i)]};
    made.vertex = {two.vertex[last(j)], one.vertex[next(i)], one.vertex[last(i)]};
    made.sourceEdge = {two.sourceEdge[last(j)], one.sourceEdge[next(i)], -1};
    made.isAbrupt = {two.isAbrupt[last(j)], one.isAbrupt[next(i)], false};
    const uint32_t atB = add(made);
    const uint32_t t = 3 * (edge / 3), u = 3 * (other / 3);
    replaceInRing(u + uint32_t(next(j)), 3 * atA);
    replaceInRing(t + uint32_t(last(i)), 3 * atA + 2);
    replaceInRing(u + uint32_t(last(j)), 3 * atB);
    replaceInRing(t + uint32_t(next(i)), 3 * atB + 1);
    link({3 * atA + 1, 3 * atB + 2});
    const glm::dvec3 side = glm::cross(c - d, normal);  // points away from a
    for (const uint32_t triangle : {edge / 3, other / 3}) {
        for (uint32_t p : all[triangle].points) {
            const bool isAtA = isBefore(side, points[p] - d);
            all[isAtA ? atA : atB].points.push_back(p);
        }
        all[triangle].isAlive = false;
        all[triangle].points = {};
    }
    for (uint32_t changed : {3 * atA, 3 * atA + 2, 3 * atB, 3 * atB + 1}) stack.push_back(changed);
    return true;
}

void RefinedMesh::refine(uint32_t triangle, size_t mostVertices) {
    if (!(longestEdge(all[triangle]) > leastEdge)) return;
    while (all[triangle].isAlive) {
        uint32_t at = triangle;
        size_t edge = longest(all[at]);
        for (bool isLongest = false; !isLongest;) {
            isLongest = true;
            for (uint32_t beside : ringOf(3 * at + uint32_t(edge))) {
                const size_t longer = longest(all[beside / 3]);
                if (longer == beside % 3) continue;
                at = beside / 3;
                edge = longer;
                isLongest = false;
                break;
            }
        }
        const std::vector<uint32_t> ring = ringOf(3 * at + uint32_t(edge));
        // At most one vertex for each triangle of the ring.
        if (ring.size() > mostVertices - std::min(mostVertices, vertexCount())) return;
        bisect(ring);
    }
}

bool RefinedMesh::giveUpLine(uint32_t triangle) {
    const Triangle& one = all[triangle];
    const size_t face = size_t(one.face);
    if (!one.isAlive || isThin[face]) return false;
    const auto [cosine, at] = smallestAngle(one);
    if (!(cosine > kSmall)) return false;
    const bool isBetween = isFixed(one, at) && isFixed(one, last(at));
    std::vector<uint32_t> freed;
    for (size_t edge = 0; edge < 3; ++edge)
        if (one.isAbrupt[edge] &&
            (isTooShort(one, kShortestLine) || (isBetween && edge != next(at))))
            for (const uint32_t same : ringOf(3 * triangle + uint32_t(edge))) freed.push_back(same);
    if (freed.empty()) return false;
    for (const uint32_t edge : freed) {
        all[edge / 3].isAbrupt[edge % 3] = false;
        made.push_back(edge / 3);  // it may be improved now
    }
    flipAll(std::move(freed));
    return true;
}

void RefinedMesh::improve(size_t mostVertices) {
    noteShortestEdges(improvedFrom);
    std::vector<uint32_t> pending;
    auto take = [&] {
        for (size_t k = 0; k < made.size(); ++k)  // lines that are given up make more triangles
            if (!giveUpLine(made[k]) && isPoor(all[made[k]])) pending.push_back(made[k]);
        made.clear();
    };
    take();
    for (size_t steps = kMostSteps * pending.size(), k = 0; k < pending.size() && steps > 0; ++k) {
        throwIfCancelledAt(k);
        if (!isPoor(all[pending[k]])) continue;
        if (vertexCount() >= mostVertices) break;
        refine(pending[k], mostVertices);
        --steps;
        take();
    }
    improvedFrom = all.size();
}

}  // namespace raybundle
