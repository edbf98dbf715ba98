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

// Distance by which rounding to float separates vertices in the same place, relative to their
// largest coordinate. Vertices of meshes, transforms and their sum are rounded.
constexpr double kRounding = 4 * double(FLT_EPSILON);

// Returns the edgeKey() of each edge of a mesh that belongs to one face only.
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

// Returns the distance by which rounding separates vertices at a place, m.
double roundingAt(const glm::dvec3& place) {
    const glm::dvec3 far = glm::abs(place);
    return kRounding * std::max({far.x, far.y, far.z});
}

// A spatial hash of the vertices that were added so far. The edge of a cell is some tens of the
// rounding error at its place, rounded to a power of 2.
class Places {
  public:
    // `near` is per vertex: other vertices within this distance are in the same place, m. Keeps
    // references to both arguments.
    Places(const std::vector<glm::dvec3>& places, const std::vector<double>& near)
        : places(places), near(near), before(places.size(), kNone) {
        lastIn.reserve(places.size());
    }

    // Returns the first vertex added that is in the same place as `vertex`. If there is none, adds
    // `vertex` and returns it.
    uint32_t firstAt(uint32_t vertex) {
        const glm::dvec3& place = places[vertex];
        const double off = roundingAt(place);
        const int level = std::ilogb(std::max(off, DBL_MIN));
        // The other vertex may have cells of half or twice the edge, if a power of 2 lies between
        // both.
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
    // Returns the hash of a cell. Different cells may have equal hashes.
    static uint64_t keyOf(const glm::dvec3& cell, int level) {
        uint64_t key = uint64_t(uint32_t(level));
        for (int axis = 0; axis < 3; ++axis) key = mixBits(key ^ uint64_t(int64_t(cell[axis])));
        return key;
    }
    // Returns the first vertex added to a cell that is in the same place as `vertex`, or kNone.
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
    std::unordered_map<uint64_t, uint32_t> lastIn;  // by cell: the last vertex added to it
    // Per vertex added: the vertex added before it to its cell.
    std::vector<uint32_t> before;
};

}  // namespace

std::vector<uint32_t> weldedVertices(const Scene& scene, const std::vector<glm::dvec3>& places,
                                     const std::vector<size_t>& firstVertex) {
    std::vector<uint32_t> first(places.size());
    std::iota(first.begin(), first.end(), 0u);
    std::vector<std::vector<uint64_t>> open;  // per mesh
    for (const Mesh& mesh : scene.meshes) open.push_back(openEdges(mesh));
    std::vector<double> near(places.size(), -1);  // see Places; -1 on no open edge
    for (size_t i = 0; i < scene.instances.size(); ++i)
        for (uint64_t edge : open[size_t(scene.instances[i].mesh)]) {
            const size_t a = firstVertex[i] + (edge >> 32), b = firstVertex[i] + uint32_t(edge);
            // Keeps the ends of an edge separate, however large rounding errors are.
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
    // Surfaces are sets of vertices that faces connect.
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
