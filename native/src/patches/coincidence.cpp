// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/coincidence.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "patches/plane.h"

namespace raybundle {
namespace {

// Of two parts in the same place, relative.
constexpr double kSameVolume = 1e-4;
constexpr int32_t kOpen = -1;

}  // namespace

// By one of its vertices.
std::vector<int32_t> partsOfFaces(const Mesh& mesh) {
    std::vector<int32_t> above(mesh.vertices.size());
    std::iota(above.begin(), above.end(), 0);
    auto root = [&](int32_t v) {
        while (above[size_t(v)] != v) v = above[size_t(v)] = above[size_t(above[size_t(v)])];
        return v;
    };
    for (size_t f = 0; f < mesh.faceCount(); ++f) {
        const int32_t begin = mesh.faceOffsets[f], end = mesh.faceOffsets[f + 1];
        for (int32_t c = begin; c < end; ++c)
            above[size_t(root(mesh.cornerVertices[size_t(c)]))] =
                root(mesh.cornerVertices[size_t(begin)]);
    }
    std::vector<int32_t> parts(mesh.faceCount());
    for (size_t f = 0; f < mesh.faceCount(); ++f)
        parts[f] = root(mesh.cornerVertices[size_t(mesh.faceOffsets[f])]);
    return parts;
}

namespace {

// Per face: its part; kOpen where not each edge of the part has exactly two faces, which turn alike.
std::vector<int32_t> closedParts(const Mesh& mesh) {
    std::vector<int32_t> parts = partsOfFaces(mesh);
    struct Edge {
        uint64_t key;
        int32_t part;
        int turn;  // +1 from the smaller vertex to the larger, else -1
    };
    std::vector<Edge> edges;
    edges.reserve(mesh.cornerCount());
    for (size_t f = 0; f < mesh.faceCount(); ++f) {
        const int32_t begin = mesh.faceOffsets[f], end = mesh.faceOffsets[f + 1];
        for (int32_t c = begin; c < end; ++c) {
            const int32_t a = mesh.cornerVertices[size_t(c)];
            const int32_t b = mesh.cornerVertices[size_t(c + 1 < end ? c + 1 : begin)];
            edges.push_back({edgeKey(a, b), parts[f], a < b ? 1 : -1});
        }
    }
    std::sort(edges.begin(), edges.end(),
              [](const Edge& a, const Edge& b) { return a.key < b.key; });
    std::vector<bool> closed(mesh.vertices.size(), true);  // at the vertex that names a part
    for (size_t i = 0; i < edges.size();) {
        size_t end = i;
        int turns = 0;
        for (; end < edges.size() && edges[end].key == edges[i].key; ++end)
            turns += edges[end].turn;
        if (end - i != 2 || turns != 0) closed[size_t(edges[i].part)] = false;
        i = end;
    }
    for (int32_t& part : parts)
        if (!closed[size_t(part)]) part = kOpen;
    return parts;
}

// Where a part lies and what it encloses.
struct Part {
    glm::vec3 low{INFINITY}, high{-INFINITY};
    double volume = 0;  // negative: turned inwards
    double area = 0;
    bool isSolid = true;

    // Whether another part lies in the same place, within what rounding does to it.
    bool isWhere(const Part& other, double rounding) const {
        const glm::vec3 off = glm::max(glm::abs(other.low - low), glm::abs(other.high - high));
        return double(std::max({off.x, off.y, off.z})) <= rounding;
    }
    // Double: both sides of a slab.
    double thickness() const { return area > 0 ? 2 * std::abs(volume) / area : 0; }
};

// By the vertex that stands for the part.
std::map<int32_t, Part> measured(const Mesh& mesh, const glm::vec3* places,
                                 const std::vector<int32_t>& partOfFace) {
    std::map<int32_t, Part> parts;
    for (size_t f = 0; f < mesh.faceCount(); ++f) {
        if (partOfFace[f] == kOpen) continue;
        Part& part = parts[partOfFace[f]];
        const int32_t begin = mesh.faceOffsets[f], end = mesh.faceOffsets[f + 1];
        auto place = [&](int32_t c) { return places[mesh.cornerVertices[size_t(c)]]; };
        // From a place of the part: far from the origin digits would be lost.
        const glm::dvec3 origin(places[partOfFace[f]]), first(place(begin));
        glm::dvec3 doubled(0.0);
        for (int32_t c = begin; c < end; ++c) {
            part.low = glm::min(part.low, place(c));
            part.high = glm::max(part.high, place(c));
            if (c + 1 < end)
                doubled +=
                    glm::cross(glm::dvec3(place(c)) - first, glm::dvec3(place(c + 1)) - first);
        }
        part.area += glm::length(doubled) / 2;
        part.volume += glm::dot(first - origin, doubled) / 6;
    }
    return parts;
}

}  // namespace

std::vector<Shell> shellsOfFaces(const Mesh& mesh, const glm::vec3* places, double thinnest) {
    const std::vector<int32_t> partOfFace = closedParts(mesh);
    std::map<int32_t, Part> parts = measured(mesh, places, partOfFace);
    std::vector<Part*> byPlace;
    for (auto& [vertex, part] : parts) {
        part.isSolid = part.thickness() > thinnest;
        byPlace.push_back(&part);
    }
    std::sort(byPlace.begin(), byPlace.end(),
              [](const Part* a, const Part* b) { return a->low.x < b->low.x; });
    for (size_t i = 0; i < byPlace.size(); ++i) {
        Part& a = *byPlace[i];
        const double rounding =
            std::max(thinnest, Plane::kOfExtent * double(glm::length(a.high - a.low)));
        for (size_t k = i + 1; k < byPlace.size(); ++k) {
            Part& b = *byPlace[k];
            if (double(b.low.x - a.low.x) > rounding) break;
            if (a.isWhere(b, rounding) &&
                std::abs(a.volume + b.volume) < kSameVolume * std::abs(a.volume))
                a.isSolid = b.isSolid = false;
        }
    }
    std::vector<Shell> result(mesh.faceCount(), Shell::OPEN);
    for (size_t f = 0; f < mesh.faceCount(); ++f)
        if (partOfFace[f] != kOpen)
            if (const Part& part = parts.at(partOfFace[f]); part.isSolid)
                result[f] = part.volume > 0 ? Shell::OUTWARD : Shell::INWARD;
    return result;
}

}  // namespace raybundle
