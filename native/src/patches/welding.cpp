// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/welding.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "job/cancellation.h"
#include "sampling/mix_bits.h"
#include "scene/disjoint_sets.h"

namespace raybundle {
namespace {

// What is left between vertices in the same place by rounding to float, of their farthest
// coordinate: those of a mesh, of its matrix and of their sum.
constexpr double kRounding = 4 * double(FLT_EPSILON);

// The edges of a mesh that one face has alone, by their keys.
std::vector<uint64_t> openEdges(const Mesh& mesh) {
    std::vector<uint64_t> edges;
    edges.reserve(mesh.cornerCount());
    for (size_t f = 0; f < mesh.faceCount(); ++f) {
        throwIfCancelledAt(f);
        const int32_t begin = mesh.faceOffsets[f], end = mesh.faceOffsets[f + 1];
        for (int32_t c = begin; c < end; ++c)
            edges.push_back(edgeKey(mesh.cornerVertices[size_t(c)],
                                    mesh.cornerVertices[size_t(c + 1 < end ? c + 1 : begin)]));
    }
    std::sort(edges.begin(), edges.end());
    std::vector<uint64_t> open;
    for (size_t i = 0; i < edges.size();) {
        size_t end = i + 1;
        while (end < edges.size() && edges[end] == edges[i]) ++end;
        if (end == i + 1) open.push_back(edges[i]);
        i = end;
    }
    return open;
}

double roundingAt(const glm::dvec3& place) {
    const glm::dvec3 far = glm::abs(place);
    return kRounding * std::max({far.x, far.y, far.z});
}

// Vertices that have been met, by the cell that they lie in. Cells are as large as rounding is
// there: some tens of it, by powers of two.
class Places {
  public:
    // near: per vertex, within which others are in the same place, metres.
    Places(const std::vector<glm::dvec3>& places, const std::vector<double>& near)
        : places(places), near(near), before(places.size(), kNone) {
        lastIn.reserve(places.size());
    }

    // The first vertex met that lies where this one does, else itself.
    uint32_t firstAt(uint32_t vertex) {
        const glm::dvec3& place = places[vertex];
        const double off = roundingAt(place);
        const int level = std::ilogb(std::max(off, DBL_MIN));
        // Beside a power of two the other may have cells of half or twice the edge.
        for (int at = level - 1; at <= level + 1; ++at) {
            const glm::dvec3 low = cellOf(place - off, at), high = cellOf(place + off, at);
            for (double x = low.x; x <= high.x; ++x)
                for (double y = low.y; y <= high.y; ++y)
                    for (double z = low.z; z <= high.z; ++z)
                        if (const uint32_t other = firstIn(keyOf({x, y, z}, at), vertex);
                            other != kNone)
                            return other;
        }
        uint32_t& last =
            lastIn.try_emplace(keyOf(cellOf(place, level), level), kNone).first->second;
        before[vertex] = last;
        last = vertex;
        return vertex;
    }

  private:
    static glm::dvec3 cellOf(const glm::dvec3& place, int level) {
        return glm::floor(place * std::ldexp(1.0, -level - 6));
    }
    // Other cells may have the same.
    static uint64_t keyOf(const glm::dvec3& cell, int level) {
        uint64_t key = uint64_t(uint32_t(level));
        for (int axis = 0; axis < 3; ++axis) key = mixBits(key ^ uint64_t(int64_t(cell[axis])));
        return key;
    }
    // The first met in a cell that lies where a vertex does; kNone.
    uint32_t firstIn(uint64_t key, uint32_t vertex) const {
        const auto last = lastIn.find(key);
        uint32_t first = kNone;
        for (uint32_t other = last == lastIn.end() ? kNone : last->second; other != kNone;
             other = before[other])
            if (glm::distance(places[other], places[vertex]) <= std::min(near[vertex], near[other]))
                first = other;
        return first;
    }

    static constexpr uint32_t kNone = UINT32_MAX;
    const std::vector<glm::dvec3>& places;
    const std::vector<double>& near;
    std::unordered_map<uint64_t, uint32_t> lastIn;  // of those met, by cell
    std::vector<uint32_t> before;  // per vertex met: the one met before in its cell
};

}  // namespace

std::vector<uint32_t> weldedVertices(const Scene& scene, const std::vector<glm::dvec3>& places,
                                     const std::vector<size_t>& firstVertex) {
    std::vector<uint32_t> first(places.size());
    std::iota(first.begin(), first.end(), 0u);
    std::vector<std::vector<uint64_t>> open;  // per mesh
    for (const Mesh& mesh : scene.meshes) open.push_back(openEdges(mesh));
    std::vector<double> near(places.size(), -1);  // see Places; -1: on no open edge
    for (size_t i = 0; i < scene.instances.size(); ++i)
        for (uint64_t edge : open[size_t(scene.instances[i].mesh)]) {
            const size_t a = firstVertex[i] + (edge >> 32), b = firstVertex[i] + uint32_t(edge);
            // The ends of an edge stay two, however far away.
            const double length = glm::distance(places[a], places[b]);
            for (size_t v : {a, b}) {
                if (near[v] < 0) near[v] = roundingAt(places[v]);
                near[v] = std::min(near[v], length / 4);
            }
        }
    Places met(places, near);
    for (uint32_t vertex = 0; vertex < places.size(); ++vertex)
        if (near[vertex] >= 0) first[vertex] = met.firstAt(vertex);
    return first;
}

WeldedFaces weldedFaces(const Scene& scene, const std::vector<uint32_t>& welded,
                        const std::vector<size_t>& firstVertex) {
    WeldedFaces faces;
    for (size_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const Mesh& mesh = scene.meshes[size_t(instance.mesh)];
        const bool mirrored = instance.isMirrored();
        faces.firstFace.push_back(faces.count());
        for (size_t f = 0; f < mesh.faceCount(); ++f) {
            throwIfCancelledAt(f);
            const size_t first = faces.vertices.size();
            for (int32_t c = mesh.faceOffsets[f]; c < mesh.faceOffsets[f + 1]; ++c)
                faces.vertices.push_back(
                    welded[firstVertex[i] + size_t(mesh.cornerVertices[size_t(c)])]);
            if (mirrored)
                std::reverse(faces.vertices.begin() + ptrdiff_t(first), faces.vertices.end());
            faces.offsets.push_back(faces.vertices.size());
            faces.instance.push_back(uint32_t(i));
        }
    }
    // Surfaces are sets of vertices joined by faces.
    DisjointSets joined(welded.size());
    for (size_t f = 0; f < faces.count(); ++f)
        for (size_t c = faces.offsets[f] + 1; c < faces.offsets[f + 1]; ++c)
            joined.join(faces.vertices[c - 1], faces.vertices[c]);
    std::vector<uint32_t> number(welded.size(), UINT32_MAX);
    struct Piece {
        uint32_t instance, piece;
    };
    std::vector<Piece> last;  // per surface; faces are in the order of their instances
    for (size_t f = 0; f < faces.count(); ++f) {
        throwIfCancelledAt(f);
        uint32_t& surface = number[joined.root(faces.vertices[faces.offsets[f]])];
        if (surface == UINT32_MAX) {
            surface = faces.surfaceCount++;
            last.push_back({UINT32_MAX, 0});
        }
        if (last[surface].instance != faces.instance[f])
            last[surface] = {faces.instance[f], faces.pieceCount++};
        faces.surface.push_back(surface);
        faces.piece.push_back(last[surface].piece);
    }
    return faces;
}

}  // namespace raybundle
