// SPDX-License-Identifier: GPL-3.0-or-later
//
// Lines on faces that become edges of a RefinedMesh: their points become vertices, and where the
// edge between two of them is missing, so does its middle. The sources are named in
// patches/refined_mesh.h.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "job/cancellation.h"
#include "patches/refined_mesh.h"
#include "patches/segment.h"

namespace raybundle {
namespace {

// Longest of the two parts of a line that is divided in its middle, as a share of its length, if a
// place close to the middle is taken.
constexpr double kMostOfHalves = 0.8;

}  // namespace

// The living triangles of faces, also those that were made since the last call.
class RefinedMesh::FaceTriangles {
  public:
    explicit FaceTriangles(const RefinedMesh& mesh) : mesh(mesh) {}

    const std::vector<uint32_t>& of(int32_t face) {
        for (; seen < mesh.all.size(); ++seen) ofFace[mesh.all[seen].face].push_back(seen);
        std::vector<uint32_t>& triangles = ofFace[face];
        triangles.erase(std::remove_if(triangles.begin(), triangles.end(),
                                       [&](uint32_t t) { return !mesh.all[t].isAlive; }),
                        triangles.end());
        return triangles;
    }

  private:
    const RefinedMesh& mesh;
    std::map<int32_t, std::vector<uint32_t>> ofFace;
    uint32_t seen = 0;  // number of triangles that are in the lists
};

void RefinedMesh::addLines(const std::vector<Line>& lines, size_t mostVertices) {
    FaceTriangles triangles(*this);
    for (size_t k = 0; k < lines.size(); ++k) {
        throwIfCancelledAt(k);
        const Line& line = lines[k];
        if (hasDoubles[size_t(line.face)]) continue;
        std::optional<uint32_t> before;
        for (const glm::dvec3& point : line.points) {
            const std::optional<uint32_t> place = placeAt(line, point, triangles, mostVertices);
            if (before && place && *before != *place)
                connect(line, *before, *place, triangles, mostVertices);
            before = place;
        }
    }
}

std::optional<uint32_t> RefinedMesh::placeAt(const Line& line, const glm::dvec3& point,
                                             FaceTriangles& triangles, size_t mostVertices) {
    const std::vector<uint32_t>& ofFace = triangles.of(line.face);
    const double accuracy = std::max(line.accuracy, leastEdge);
    auto cornerAt = [&](const glm::dvec3& at) -> std::optional<uint32_t> {
        for (const uint32_t t : ofFace)
            for (const uint32_t place : all[t].place)
                if (glm::distance(places[place], at) <= accuracy) return place;
        return {};
    };
    if (const auto corner = cornerAt(point)) return corner;
    // The triangle that contains the point, and the nearest of its edges and all fixed edges.
    uint32_t nearest = 0, inside = UINT32_MAX;
    double distance = INFINITY, most = 0;
    auto consider = [&](uint32_t t, uint32_t k) {
        const double off = distanceToSegment(point, position(all[t], k), position(all[t], next(k)));
        if (!(off < distance)) return;
        nearest = 3 * t + k;
        distance = off;
    };
    for (const uint32_t t : ofFace) {
        for (uint32_t k = 0; k < 3; ++k)
            if (isFixed(all[t], k)) consider(t, k);
        if (const double share = smallestShare(all[t], point); share > most) {
            inside = t;
            most = share;
        }
    }
    for (uint32_t k = 0; k < 3 && inside != UINT32_MAX && distance > accuracy; ++k)
        consider(inside, k);
    if (distance <= accuracy) {
        const glm::dvec3 &from = position(all[nearest / 3], nearest % 3),
                         &to = position(all[nearest / 3], next(nearest % 3));
        const double share = nearestShare(point, from, to);
        if (const auto corner = cornerAt(glm::mix(from, to, share))) return corner;
        const std::vector<uint32_t> ring = ringOf(nearest);
        if (vertexCount() + ring.size() > mostVertices) return {};
        bisect(ring, share);
    } else if (inside != UINT32_MAX && vertexCount() < mostVertices) {
        divide(inside, sharesAt(all[inside], point));
    } else {
        return {};
    }
    return uint32_t(places.size() - 1);
}

void RefinedMesh::divide(uint32_t triangle, const glm::dvec3& shares) {
    const Triangle old = all[triangle];
    const uint32_t place = uint32_t(places.size()), vertex = uint32_t(vertices.size());
    glm::dvec3 there(0.0), inSource(0.0);
    for (size_t k = 0; k < 3; ++k) {
        there += shares[int(k)] * position(old, k);
        inSource += shares[int(k)] * vertices[old.vertex[k]].position;
    }
    places.push_back(there);
    vertices.push_back({inSource, place});
    std::array<uint32_t, 3> parts{};
    std::vector<uint32_t> outer;
    for (size_t k = 0; k < 3; ++k) {
        Triangle part = old;
        part.points.clear();
        part.place = {old.place[k], old.place[next(k)], place};
        part.vertex = {old.vertex[k], old.vertex[next(k)], vertex};
        part.sourceEdge = {old.sourceEdge[k], -1, -1};
        part.isAbrupt = {old.isAbrupt[k], false, false};
        parts[k] = add(part);
        replaceInRing(3 * triangle + uint32_t(k), 3 * parts[k]);
        outer.push_back(3 * parts[k]);
    }
    for (size_t k = 0; k < 3; ++k) link({3 * parts[k] + 1, 3 * parts[next(k)] + 2});
    for (uint32_t p : old.points) {
        const uint32_t part =
            *std::max_element(parts.begin(), parts.end(), [&](uint32_t a, uint32_t b) {
                return smallestShare(all[a], points[p]) < smallestShare(all[b], points[p]);
            });
        all[part].points.push_back(p);
    }
    all[triangle].isAlive = false;
    all[triangle].points = {};
    isTouched[size_t(old.face)] = 1;
    flipAll(std::move(outer));
}

void RefinedMesh::connect(const Line& line, uint32_t from, uint32_t to, FaceTriangles& triangles,
                          size_t mostVertices) {
    for (const uint32_t t : triangles.of(line.face))
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t a = all[t].place[k], b = all[t].place[next(k)];
            if (std::minmax(a, b) != std::minmax(from, to)) continue;
            for (const uint32_t edge : ringOf(3 * t + k)) all[edge / 3].isAbrupt[edge % 3] = true;
            isTouched[size_t(line.face)] = 1;
            return;
        }
    const double length = glm::distance(places[from], places[to]);
    if (length <= 2 * std::max(line.accuracy, leastEdge)) return;
    const std::optional<uint32_t> middle =
        placeAt(line, 0.5 * (places[from] + places[to]), triangles, mostVertices);
    if (!middle || *middle == from || *middle == to) return;
    // In a face that is not flat, the place may be far from the line.
    if (std::max(glm::distance(places[from], places[*middle]),
                 glm::distance(places[*middle], places[to])) > kMostOfHalves * length)
        return;
    connect(line, from, *middle, triangles, mostVertices);
    connect(line, *middle, to, triangles, mostVertices);
}

}  // namespace raybundle
