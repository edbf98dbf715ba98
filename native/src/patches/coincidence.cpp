// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/coincidence.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "job/cancellation.h"
#include "patches/plane.h"

namespace raybundle {
namespace {

// Relative difference of the volumes up to which two surfaces are taken for one.
constexpr double kSameVolume = 1e-4;

// Bounds and measures of a closed surface.
struct Part {
    glm::vec3 low{INFINITY}, high{-INFINITY};
    double volume = 0;             // m^3; negative if the fronts look inwards
    double area = 0;               // m^2
    uint32_t instance = 0;         // instance of the first face
    uint32_t vertex = UINT32_MAX;  // first vertex; UINT32_MAX if the surface is not closed
    bool isSolid = false;

    // Returns whether the bounding boxes coincide within `rounding`, m.
    bool isWhere(const Part& other, double rounding) const {
        const glm::vec3 off = glm::max(glm::abs(other.low - low), glm::abs(other.high - high));
        return double(std::max({off.x, off.y, off.z})) <= rounding;
    }
    // Returns the mean thickness, m. It is twice the volume over the area, because a slab has its
    // area on both sides.
    double thickness() const { return area > 0 ? 2 * std::abs(volume) / area : 0; }
};

// Returns the measures of each surface. Surfaces that are not closed keep the default values.
std::vector<Part> measured(const WeldedFaces& faces, const std::vector<glm::vec3>& places,
                           const std::vector<bool>& closed) {
    std::vector<Part> parts(faces.surfaceCount);
    for (size_t f = 0; f < faces.count(); ++f) {
        throwIfCancelledAt(f);
        if (!closed[faces.surface[f]]) continue;
        Part& part = parts[faces.surface[f]];
        const size_t begin = faces.offsets[f], end = faces.offsets[f + 1];
        auto place = [&](size_t c) { return places[faces.vertices[c]]; };
        if (part.vertex == UINT32_MAX) {
            part.vertex = faces.vertices[begin];
            part.instance = faces.instance[f];
        }
        // Measure the volume from a vertex of the surface: from a far origin, differences would
        // lose their digits.
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
        throwIfCancelledAt(f);
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

std::vector<Shell> shellsOfFaces(const WeldedFaces& faces, const std::vector<bool>& closed,
                                 const std::vector<glm::vec3>& places,
                                 const std::function<double(uint32_t)>& thinnest) {
    std::vector<Part> parts = measured(faces, places, closed);
    std::vector<Part*> byPlace;
    for (Part& part : parts) {
        if (part.vertex == UINT32_MAX) continue;
        part.isSolid = part.thickness() > thinnest(part.vertex);
        byPlace.push_back(&part);
    }
    std::sort(byPlace.begin(), byPlace.end(), [](const Part* a, const Part* b) {
        return std::tie(a->instance, a->low.x) < std::tie(b->instance, b->low.x);
    });
    for (size_t i = 0; i < byPlace.size(); ++i) {
        Part& a = *byPlace[i];
        const double rounding =
            std::max(thinnest(a.vertex), Plane::kOfExtent * double(glm::length(a.high - a.low)));
        for (size_t k = i + 1; k < byPlace.size() && byPlace[k]->instance == a.instance; ++k) {
            Part& b = *byPlace[k];
            if (double(b.low.x - a.low.x) > rounding) break;
            if (a.isWhere(b, rounding) &&
                std::abs(a.volume + b.volume) < kSameVolume * std::abs(a.volume))
                a.isSolid = b.isSolid = false;
        }
    }
    std::vector<Shell> result(faces.count(), Shell::OPEN);
    for (size_t f = 0; f < faces.count(); ++f)
        if (const Part& part = parts[faces.surface[f]]; part.isSolid)
            result[f] = part.volume > 0 ? Shell::OUTWARD : Shell::INWARD;
    return result;
}

}  // namespace raybundle
