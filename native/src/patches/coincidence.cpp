// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/coincidence.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace raybundle {
namespace {

// Of two parts in the same place, relative.
constexpr double kSameVolume = 1e-4;

// Where a closed surface lies and what it encloses.
struct Part {
    glm::vec3 low{INFINITY}, high{-INFINITY};
    double volume = 0;  // negative: turned inwards
    double area = 0;
    uint32_t instance = 0;         // of its first face
    uint32_t vertex = UINT32_MAX;  // its first
    bool isSolid = false;

    auto place() const {
        return std::make_tuple(instance, low.x, low.y, low.z, high.x, high.y, high.z);
    }
    // Double: both sides of a slab.
    double thickness() const { return area > 0 ? 2 * std::abs(volume) / area : 0; }
};

// Per surface; those that are not closed stay empty.
std::vector<Part> measured(const WeldedFaces& faces, const std::vector<glm::vec3>& places,
                           const std::vector<bool>& closed) {
    std::vector<Part> parts(faces.surfaceCount);
    for (size_t f = 0; f < faces.count(); ++f) {
        if (!closed[faces.surface[f]]) continue;
        Part& part = parts[faces.surface[f]];
        const size_t begin = faces.offsets[f], end = faces.offsets[f + 1];
        auto place = [&](size_t c) { return places[faces.vertices[c]]; };
        if (part.vertex == UINT32_MAX) {
            part.vertex = faces.vertices[begin];
            part.instance = faces.instance[f];
        }
        // From a place of the part: far from the origin digits would be lost.
        const glm::dvec3 origin(places[part.vertex]), first(place(begin));
        glm::dvec3 doubled(0.0);
        for (size_t c = begin; c < end; ++c) {
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

std::vector<bool> closedSurfaces(const WeldedFaces& faces) {
    struct Edge {
        uint64_t key;
        uint32_t surface;
        int turn;  // +1 from the smaller vertex to the larger, else -1
    };
    std::vector<Edge> edges;
    edges.reserve(faces.vertices.size());
    for (size_t f = 0; f < faces.count(); ++f) {
        const size_t begin = faces.offsets[f], end = faces.offsets[f + 1];
        for (size_t c = begin; c < end; ++c) {
            const uint32_t a = faces.vertices[c], b = faces.vertices[c + 1 < end ? c + 1 : begin];
            edges.push_back({uint64_t(std::min(a, b)) << 32 | std::max(a, b), faces.surface[f],
                             a < b ? 1 : -1});
        }
    }
    std::sort(edges.begin(), edges.end(),
              [](const Edge& a, const Edge& b) { return a.key < b.key; });
    std::vector<bool> closed(faces.surfaceCount, true);
    for (size_t i = 0; i < edges.size();) {
        size_t end = i;
        int turns = 0;
        for (; end < edges.size() && edges[end].key == edges[i].key; ++end)
            turns += edges[end].turn;
        if (turns != 0) closed[edges[i].surface] = false;
        i = end;
    }
    return closed;
}

std::vector<bool> solidFaces(const WeldedFaces& faces, const std::vector<bool>& closed,
                             const std::vector<glm::vec3>& places,
                             const std::function<double(uint32_t)>& thinnest) {
    std::vector<Part> parts = measured(faces, places, closed);
    std::map<decltype(Part().place()), std::vector<Part*>> byPlace;
    for (Part& part : parts) {
        if (part.vertex == UINT32_MAX) continue;
        part.isSolid = part.thickness() > thinnest(part.vertex);
        byPlace[part.place()].push_back(&part);
    }
    for (auto& [place, there] : byPlace)
        for (size_t k = 1; k < there.size(); ++k)
            if (const double sum = there[0]->volume + there[k]->volume;
                std::abs(sum) < kSameVolume * std::abs(there[0]->volume))
                there[0]->isSolid = there[k]->isSolid = false;
    std::vector<bool> result(faces.count());
    for (size_t f = 0; f < faces.count(); ++f) result[f] = parts[faces.surface[f]].isSolid;
    return result;
}

}  // namespace raybundle
