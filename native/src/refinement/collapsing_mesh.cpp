// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/collapsing_mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "job/error.h"
#include "scene/triangulation.h"

namespace raybundle {
namespace {

using Vertex = CollapsingMesh::Mesh3::VertexHandle;

// Values on both sides of an edge that differ by less than this share of their tolerance are equal.
constexpr float kSameValue = 1e-3f;

void check(const Mesh& source, const SimplificationLimits& limits) {
    const auto need = [](bool isRight, const char* what) {
        if (!isRight) throw invalidArgument(what);
    };
    need(limits.distance > 0 && std::isfinite(limits.distance), "the distance must be positive");
    for (float tolerance : limits.tolerances)
        need(tolerance > 0 && std::isfinite(tolerance), "all tolerances must be positive");
    need(limits.faceKinds.empty() || limits.faceKinds.size() == source.faceCount(),
         "there must be a kind per face");
    need(limits.keptEdges.empty() || limits.keptEdges.size() == source.cornerCount(),
         "there must be a mark per corner");
    need(limits.values.size() == source.cornerCount() * limits.tolerances.size(),
         "there must be as many values per corner as tolerances");
    need(std::all_of(limits.values.begin(), limits.values.end(),
                     [](float value) { return std::isfinite(value); }),
         "all values must be finite");
}

}  // namespace

CollapsingMesh::CollapsingMesh(const Mesh& source, const SimplificationLimits& limits)
    : source(source), limits(limits) {
    check(source, limits);
    cutIntoTriangles();
    keepWhatCannotBeStored();
    addVertices();
    addFaces();
    findFeatures();
}

void CollapsingMesh::cutIntoTriangles() {
    for (size_t f = 0; f < source.faceCount(); ++f) {
        std::vector<glm::dvec3> points;
        for (int32_t c = source.faceOffsets[f]; c < source.faceOffsets[f + 1]; ++c)
            points.push_back(positionOf(c));
        for (const std::array<int, 3>& t : triangulate(points)) {
            CollapsingTriangle triangle{int32_t(f), {-1, -1, -1}, {}};
            for (size_t k = 0; k < 3; ++k) triangle.corner[k] = source.faceOffsets[f] + t[k];
            triangles.push_back(std::move(triangle));
        }
    }
}

// Finds the faces at edges that have more than two triangles, or two that run the same way.
void CollapsingMesh::keepWhatCannotBeStored() {
    struct Use {
        uint64_t key;
        bool isForward;
        int32_t face;
    };
    std::vector<Use> uses;
    isKept.resize(source.faceCount());
    for (const CollapsingTriangle& t : triangles)
        for (size_t k = 0; k < 3; ++k) {
            const int32_t a = source.cornerVertices[size_t(t.corner[k])],
                          b = source.cornerVertices[size_t(t.corner[(k + 1) % 3])];
            if (a == b) isKept[size_t(t.face)] = true;
            uses.push_back({edgeKey(a, b), a < b, t.face});
        }
    std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) { return a.key < b.key; });
    for (size_t k = 0, end; k < uses.size(); k = end) {
        for (end = k + 1; end < uses.size() && uses[end].key == uses[k].key;) ++end;
        if (end - k == 1 || (end - k == 2 && uses[k].isForward != uses[k + 1].isForward)) continue;
        for (; k < end; ++k) isKept[size_t(uses[k].face)] = true;
    }
}

// Adds a vertex for each fan of triangles around a vertex of the source. Vertices with several fans
// and those of kept faces are locked.
void CollapsingMesh::addVertices() {
    std::vector<uint32_t> root(3 * triangles.size());  // union of the corners of a fan
    std::iota(root.begin(), root.end(), 0u);
    auto rootOf = [&](uint32_t k) {
        while (root[k] != k) k = root[k] = root[root[k]];
        return k;
    };
    std::unordered_map<uint64_t, uint32_t> metAt;  // by directed pair: corner where the edge begins
    auto vertexAt = [&](uint32_t n) {
        return source.cornerVertices[size_t(triangles[n / 3].corner[n % 3])];
    };
    auto directed = [&](uint32_t from, uint32_t to) {
        return uint64_t(uint32_t(vertexAt(from))) << 32 | uint32_t(vertexAt(to));
    };
    std::vector<uint8_t> isAtKept(source.vertices.size());
    for (uint32_t t = 0; t < triangles.size(); ++t)
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t from = 3 * t + k, to = 3 * t + (k + 1) % 3;
            if (isKept[size_t(triangles[t].face)]) {
                isAtKept[size_t(vertexAt(from))] = true;
                continue;
            }
            metAt[directed(from, to)] = from;
            const auto other = metAt.find(directed(to, from));
            if (other == metAt.end()) continue;
            const uint32_t begin = other->second, end = begin - begin % 3 + (begin + 1) % 3;
            root[rootOf(to)] = rootOf(begin);
            root[rootOf(from)] = rootOf(end);
        }
    std::vector<int32_t> vertexOf(root.size(), -1), firstOf(source.vertices.size(), -1);
    for (uint32_t t = 0; t < triangles.size(); ++t) {
        if (isKept[size_t(triangles[t].face)]) continue;
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t fan = rootOf(3 * t + k);
            if (vertexOf[fan] < 0) {
                const glm::vec3& p = source.vertices[size_t(vertexAt(fan))];
                vertexOf[fan] = mesh.add_vertex({p.x, p.y, p.z}).idx();
                int32_t& first = firstOf[size_t(vertexAt(fan))];
                isLocked.push_back(first >= 0 || isAtKept[size_t(vertexAt(fan))]);
                if (first >= 0) isLocked[size_t(first)] = true;
                if (first < 0) first = vertexOf[fan];
            }
            triangles[t].vertex[k] = vertexOf[fan];
        }
    }
}

void CollapsingMesh::addFaces() {
    for (uint32_t t = 0; t < triangles.size(); ++t) {
        CollapsingTriangle& triangle = triangles[t];
        if (isKept[size_t(triangle.face)]) continue;
        const auto& v = triangle.vertex;
        if (mesh.add_face(Vertex(v[0]), Vertex(v[1]), Vertex(v[2])).is_valid())
            triangleOf.push_back(int32_t(t));
        else
            for (int32_t vertex : v) isLocked[size_t(vertex)] = true;
    }
    glm::vec3 low(INFINITY), high(-INFINITY);
    for (const glm::vec3& p : source.vertices) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    extent = std::max({high.x - low.x, high.y - low.y, high.z - low.z, 1e-30f});
}

bool CollapsingMesh::differ(int32_t a, int32_t b) const {
    const size_t width = limits.tolerances.size();
    for (size_t k = 0; k < width; ++k)
        if (!(std::abs(limits.values[size_t(a) * width + k] -
                       limits.values[size_t(b) * width + k]) <= kSameValue * limits.tolerances[k]))
            return true;
    return false;
}

void CollapsingMesh::findFeatures() {
    featureCounts.resize(mesh.n_vertices());
    for (const auto edge : mesh.edges()) {
        bool isOne = edge.is_boundary();
        int32_t beginsAt = -1;
        std::array<std::array<int32_t, 2>, 2> corners{};  // of both triangles, at both ends
        const int32_t a = edge.v0().idx(), b = edge.v1().idx();
        std::array<int32_t, 2> kind{};
        for (unsigned n = 0; n < 2; ++n) {
            const auto face = edge.h(n).face();
            if (!face.is_valid()) continue;
            const CollapsingTriangle& t = triangles[size_t(triangleOf[size_t(face.idx())])];
            corners[n] = {t.corner[size_t(t.at(a))], t.corner[size_t(t.at(b))]};
            if (!limits.faceKinds.empty()) kind[n] = limits.faceKinds[size_t(t.face)];
            // The edges of the source's face run from each corner to the next.
            const int32_t first = source.faceOffsets[size_t(t.face)],
                          last = source.faceOffsets[size_t(t.face) + 1];
            const int32_t from = corners[n][edge.h(n).from().idx() == a ? 0 : 1],
                          to = corners[n][edge.h(n).from().idx() == a ? 1 : 0];
            if (to != (from + 1 == last ? first : from + 1)) continue;
            beginsAt = from;
            isOne = isOne || (!limits.keptEdges.empty() && limits.keptEdges[size_t(from)]);
        }
        if (!edge.is_boundary())
            isOne = isOne || kind[0] != kind[1] || differ(corners[0][0], corners[1][0]) ||
                    differ(corners[0][1], corners[1][1]);
        if (!isOne) continue;
        features[edgeKey(a, b)] = beginsAt;
        ++featureCounts[size_t(a)];
        ++featureCounts[size_t(b)];
    }
}

}  // namespace raybundle
