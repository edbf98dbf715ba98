// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/refined_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "job/cancellation.h"
#include "scene/rounded.h"
#include "scene/triangulation.h"

namespace raybundle {
namespace {

// The good triangles of a face are too many if an angle of its first triangulation is less than
// that of a rectangle that is this many times as long as wide.
constexpr double kThin = 10;
// Edges shorter than this share of the largest distance from an origin are not bisected.
constexpr double kLeastOfFarthest = 1e-6;
// Binary digits of squared lengths that are compared. Positions are floats.
constexpr int kLengthDigits = 18;
// Barycentric coordinates that differ by less are mere rounding errors. Of two triangles, the first
// then has a point that lies on the edge between them.
constexpr double kEqualShare = 1e-6;

}  // namespace

RefinedMesh::RefinedMesh(const Mesh& source, const glm::dmat4& toWorld)
    : source(source),
      hasDoubles(source.faceCount(), 0),
      isTouched(source.faceCount(), 0),
      isThin(source.faceCount(), 0),
      shortest(source.faceCount(), INFINITY) {
    // Vertices at the same position share a place.
    std::vector<uint32_t> order(source.vertices.size());
    for (uint32_t v = 0; v < order.size(); ++v) order[v] = v;
    auto key = [&](uint32_t v) {
        // Adding 0 makes -0 equal to 0.
        const glm::vec3 p = source.vertices[v] + 0.0f;
        return std::array<float, 3>{p.x, p.y, p.z};
    };
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return key(a) < key(b); });
    vertices.resize(order.size());
    for (size_t k = 0; k < order.size(); ++k) {
        throwIfCancelledAt(k);
        const glm::dvec3 position(source.vertices[order[k]]);
        if (k == 0 || key(order[k - 1]) != key(order[k]))
            places.push_back(toWorld * glm::dvec4(position, 1.0));
        vertices[order[k]] = {position, uint32_t(places.size() - 1)};
    }
    // Positions are floats both in the space of the source and in the world.
    double farthest = 0;
    for (const glm::dvec3& place : places) farthest = std::max(farthest, glm::length(place));
    for (const glm::vec3& v : source.vertices)
        farthest = std::max(farthest, glm::length(glm::dmat3(toWorld) * glm::dvec3(v)));
    leastEdge = kLeastOfFarthest * farthest;
    findDoubles();
    addFaces();
    linkRings();
    std::vector<uint32_t> inner;
    for (uint32_t t = 0; t < all.size(); ++t)
        for (uint32_t k = 0; k < 3; ++k)
            if (all[t].sourceEdge[k] < 0) inner.push_back(3 * t + k);
    flipAll(std::move(inner));
    noteThinFaces();
    noteShortestEdges(0);
}

std::vector<int32_t> RefinedMesh::cornersInOrder(int32_t face) const {
    std::vector<int32_t> corners;
    for (int32_t c = source.faceOffsets[size_t(face)]; c < source.faceOffsets[size_t(face) + 1];
         ++c)
        corners.push_back(c);
    const auto first = std::min_element(corners.begin(), corners.end(), [&](int32_t a, int32_t b) {
        return placeOf(a) < placeOf(b);
    });
    std::rotate(corners.begin(), first, corners.end());
    if (placeOf(corners.back()) < placeOf(corners[1]))
        std::reverse(corners.begin() + 1, corners.end());
    return corners;
}

void RefinedMesh::findDoubles() {
    const int32_t count = int32_t(source.faceCount());
    std::vector<std::pair<uint64_t, int32_t>> order;  // a sum that does not depend on the order
    for (int32_t f = 0; f < count; ++f) {
        throwIfCancelledAt(size_t(f));
        uint64_t sum = 0;
        for (int32_t c = source.faceOffsets[size_t(f)]; c < source.faceOffsets[size_t(f) + 1]; ++c)
            sum += uint64_t(placeOf(c) + 1) * uint64_t(placeOf(c) + 7);
        order.emplace_back(sum, f);
        doubleOf.push_back(f);
    }
    std::sort(order.begin(), order.end());
    auto placesOf = [&](int32_t face) {
        std::vector<uint32_t> result;
        for (int32_t c : cornersInOrder(face)) result.push_back(placeOf(c));
        return result;
    };
    for (size_t begin = 0, end = 0; begin < order.size(); begin = end) {
        while (end < order.size() && order[end].first == order[begin].first) ++end;
        if (end == begin + 1) continue;
        std::map<std::vector<uint32_t>, int32_t> first;
        for (size_t k = begin; k < end; ++k) {
            const int32_t face = order[k].second;
            const int32_t same = first.try_emplace(placesOf(face), face).first->second;
            if (same == face) continue;
            doubleOf[size_t(face)] = same;
            hasDoubles[size_t(same)] = hasDoubles[size_t(face)] = 1;
        }
    }
}

// Triangles without three different places are left out: they have no area, and the edges beside
// them are one edge.
void RefinedMesh::addFaces() {
    for (size_t f = 0; f < source.faceCount(); ++f) {
        throwIfCancelledAt(f);
        firstOfFace.push_back(uint32_t(all.size()));
        const int32_t begin = source.faceOffsets[f], end = source.faceOffsets[f + 1];
        std::vector<int32_t> corners;
        bool isReversed = false;
        if (hasDoubles[f]) {
            corners = cornersInOrder(int32_t(f));
            isReversed = corners[1] != (corners[0] + 1 == end ? begin : corners[0] + 1);
        } else {
            for (int32_t c = begin; c < end; ++c) corners.push_back(c);
        }
        std::vector<glm::dvec3> polygon;
        for (int32_t c : corners)
            polygon.push_back(source.vertices[size_t(source.cornerVertices[size_t(c)])]);
        for (const std::array<int, 3>& of : triangulate(polygon)) {
            std::array<int32_t, 3> at{corners[size_t(of[0])], corners[size_t(of[1])],
                                      corners[size_t(of[2])]};
            if (isReversed) std::swap(at[1], at[2]);
            Triangle triangle;
            triangle.face = int32_t(f);
            for (size_t k = 0; k < 3; ++k) {
                triangle.vertex[k] = uint32_t(source.cornerVertices[size_t(at[k])]);
                triangle.place[k] = placeOf(at[k]);
                triangle.sourceEdge[k] =
                    at[next(k)] == (at[k] + 1 == end ? begin : at[k] + 1) ? at[k] : -1;
            }
            if (triangle.place[0] == triangle.place[1] || triangle.place[1] == triangle.place[2] ||
                triangle.place[2] == triangle.place[0])
                continue;
            add(triangle);
            sourceTriangles.push_back(at);
        }
    }
    firstOfFace.push_back(uint32_t(all.size()));
    made.clear();
}

// Links the edges between the same two places. Edges within a face are linked only to each other
// and to those of its doubles.
void RefinedMesh::linkRings() {
    struct Entry {
        uint32_t a, b;
        int32_t face;  // of an edge within a face; -1 for edges of the source
        uint32_t edge;
        bool operator<(const Entry& o) const {
            return std::tie(a, b, face, edge) < std::tie(o.a, o.b, o.face, o.edge);
        }
        bool isBeside(const Entry& o) const { return a == o.a && b == o.b && face == o.face; }
    };
    std::vector<Entry> entries;
    for (uint32_t t = 0; t < all.size(); ++t)
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t a = all[t].place[k], b = all[t].place[next(k)];
            entries.push_back({std::min(a, b), std::max(a, b),
                               all[t].sourceEdge[k] < 0 ? doubleOf[size_t(all[t].face)] : -1,
                               3 * t + k});
        }
    std::sort(entries.begin(), entries.end());
    std::vector<uint32_t> edges;
    for (size_t k = 0; k < entries.size(); ++k) {
        edges.push_back(entries[k].edge);
        if (k + 1 < entries.size() && entries[k].isBeside(entries[k + 1])) continue;
        link(edges);
        edges.clear();
    }
}

void RefinedMesh::noteThinFaces() {
    const double thin = std::cos(std::atan(1 / kThin));
    for (const Triangle& triangle : all)
        if (triangle.isAlive && !(smallestAngle(triangle).cosine < thin))
            isThin[size_t(triangle.face)] = 1;
}

glm::dvec3 RefinedMesh::areaVector(const Triangle& triangle) const {
    const glm::dvec3& a = position(triangle, 0);
    return glm::cross(position(triangle, 1) - a, position(triangle, 2) - a);
}

double RefinedMesh::area(const Triangle& triangle) const {
    return 0.5 * glm::length(areaVector(triangle));
}

glm::dvec3 RefinedMesh::sharesAt(const Triangle& triangle, const glm::dvec3& point) const {
    const glm::dvec3 &a = position(triangle, 0), &b = position(triangle, 1),
                     &c = position(triangle, 2);
    const glm::dvec3 normal = areaVector(triangle);
    const double scale = glm::dot(normal, normal);
    if (!(scale > 0)) return glm::dvec3(-INFINITY);
    return glm::dvec3(glm::dot(normal, glm::cross(c - b, point - b)),
                      glm::dot(normal, glm::cross(a - c, point - c)),
                      glm::dot(normal, glm::cross(b - a, point - a))) /
           scale;
}

double RefinedMesh::smallestShare(const Triangle& triangle, const glm::dvec3& point) const {
    const glm::dvec3 shares = sharesAt(triangle, point);
    return std::round(std::min({shares.x, shares.y, shares.z}) / kEqualShare) * kEqualShare;
}

double RefinedMesh::edgeLength2(const Triangle& triangle, size_t edge) const {
    // From the smaller place, so that both triangles of an edge find the same length.
    const uint32_t a = triangle.place[edge], b = triangle.place[next(edge)];
    const glm::dvec3 along = places[std::max(a, b)] - places[std::min(a, b)];
    return glm::dot(along, along);
}

double RefinedMesh::longestEdge(const Triangle& triangle) const {
    return std::sqrt(edgeLength2(triangle, longest(triangle)));
}

size_t RefinedMesh::longest(const Triangle& triangle) const {
    auto key = [&](size_t edge) {
        const uint32_t p = triangle.place[edge], q = triangle.place[next(edge)];
        return std::make_tuple(rounded(edgeLength2(triangle, edge), kLengthDigits), std::min(p, q),
                               std::max(p, q));
    };
    size_t best = 0;
    for (size_t k = 1; k < 3; ++k)
        if (key(best) < key(k)) best = k;
    return best;
}

uint32_t RefinedMesh::add(const Triangle& triangle) {
    all.push_back(triangle);
    const uint32_t index = uint32_t(all.size() - 1);
    for (uint32_t k = 0; k < 3; ++k) all.back().ring[k] = 3 * index + k;
    made.push_back(index);
    return index;
}

std::vector<uint32_t> RefinedMesh::ringOf(uint32_t edge) const {
    std::vector<uint32_t> ring{edge};
    for (uint32_t at = all[edge / 3].ring[edge % 3]; at != edge; at = all[at / 3].ring[at % 3])
        ring.push_back(at);
    return ring;
}

void RefinedMesh::link(const std::vector<uint32_t>& edges) {
    for (size_t k = 0; k < edges.size(); ++k)
        all[edges[k] / 3].ring[edges[k] % 3] = edges[k + 1 == edges.size() ? 0 : k + 1];
}

void RefinedMesh::replaceInRing(uint32_t old, uint32_t now) {
    std::vector<uint32_t> ring = ringOf(old);
    ring.front() = now;
    link(ring);
}

uint32_t RefinedMesh::addPoint(uint32_t triangle, const glm::dvec3& point) {
    points.push_back(point);
    all[triangle].points.push_back(uint32_t(points.size() - 1));
    return uint32_t(points.size() - 1);
}

// Barycentric coordinates in the triangle of the face's own triangulation that contains the
// position, or that is nearest to containing it.
void RefinedMesh::locate(int32_t face, const glm::dvec3& position, std::array<int32_t, 3>& corners,
                         std::array<float, 3>& weights) const {
    double best = -INFINITY;
    for (uint32_t t = firstOfFace[size_t(face)]; t < firstOfFace[size_t(face) + 1]; ++t) {
        std::array<glm::dvec3, 3> at;
        for (size_t k = 0; k < 3; ++k)
            at[k] = source.vertices[size_t(source.cornerVertices[size_t(sourceTriangles[t][k])])];
        const glm::dvec3 normal = glm::cross(at[1] - at[0], at[2] - at[0]);
        const double scale = glm::dot(normal, normal);
        if (!(scale > 0) && std::isfinite(best)) continue;
        std::array<double, 3> w{1, 0, 0};
        if (scale > 0) {
            w[1] = glm::dot(normal, glm::cross(at[2] - position, at[0] - position)) / scale;
            w[2] = glm::dot(normal, glm::cross(at[0] - position, at[1] - position)) / scale;
            w[0] = 1 - w[1] - w[2];
        }
        const double least = std::min({w[0], w[1], w[2]});
        if (!(least > best)) continue;
        best = least;
        corners = sourceTriangles[t];
        double sum = 0;
        for (double& weight : w) sum += weight = std::max(weight, 0.0);
        for (size_t k = 0; k < 3; ++k) weights[k] = float(w[k] / sum);
    }
}

FinerMesh RefinedMesh::result() const {
    FinerMesh mesh;
    mesh.sourceCornerCount = source.cornerCount();
    for (const Vertex& vertex : vertices) mesh.vertices.emplace_back(vertex.position);
    auto addCorner = [&](uint32_t vertex, int32_t sourceEdge, bool isAbrupt) {
        mesh.cornerVertices.push_back(int32_t(vertex));
        mesh.sourceEdges.push_back(sourceEdge);
        mesh.isAbrupt.push_back(isAbrupt);
        mesh.sourceCorners.emplace_back();
        mesh.sourceWeights.emplace_back();
    };
    auto endFace = [&](int32_t face) {
        mesh.faceOffsets.push_back(int32_t(mesh.cornerVertices.size()));
        mesh.sourceFaces.push_back(face);
    };
    std::vector<std::vector<uint32_t>> living(source.faceCount());
    for (uint32_t t = 0; t < all.size(); ++t)
        if (all[t].isAlive) living[size_t(all[t].face)].push_back(t);
    for (int32_t f = 0; f < int32_t(source.faceCount()); ++f) {
        throwIfCancelledAt(size_t(f));
        const int32_t begin = source.faceOffsets[size_t(f)],
                      end = source.faceOffsets[size_t(f) + 1];
        if (!isTouched[size_t(f)]) {
            for (int32_t c = begin; c < end; ++c) {
                addCorner(uint32_t(source.cornerVertices[size_t(c)]), c, false);
                mesh.sourceCorners.back() = {c, c, c};
                mesh.sourceWeights.back() = {1, 0, 0};
            }
            endFace(f);
            continue;
        }
        std::map<uint32_t, int32_t> cornerOf;  // of the source's vertices
        for (int32_t c = begin; c < end; ++c)
            cornerOf.emplace(uint32_t(source.cornerVertices[size_t(c)]), c);
        for (uint32_t t : living[size_t(f)]) {
            for (size_t k = 0; k < 3; ++k) {
                addCorner(all[t].vertex[k], all[t].sourceEdge[k], all[t].isAbrupt[k]);
                if (const auto own = cornerOf.find(all[t].vertex[k]); own != cornerOf.end()) {
                    mesh.sourceCorners.back() = {own->second, own->second, own->second};
                    mesh.sourceWeights.back() = {1, 0, 0};
                } else {
                    locate(f, vertices[all[t].vertex[k]].position, mesh.sourceCorners.back(),
                           mesh.sourceWeights.back());
                }
            }
            endFace(f);
        }
    }
    return mesh;
}

}  // namespace raybundle
