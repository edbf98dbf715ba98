// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/smooth_regions.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "job/cancellation.h"
#include "scene/disjoint_sets.h"

namespace raybundle {
namespace {

// Shading normals count as equal if their cosine is at least this, an angle of about 1 degree.
constexpr float kSameNormal = 0.99985f;

// A directed edge of a cell, which is paired with that of the neighbour.
struct HalfEdge {
    uint64_t key;
    uint32_t cell;
    int32_t from, to;  // corners of the mesh
    bool ascending;    // from the smaller index of a vertex to the larger
    bool isParted;     // whether a wall stands on the edge
};

// Returns the position of a corner of a cell.
glm::vec3 placeOf(const Cell& cell, int32_t corner) {
    int k = 0;
    while (cell.corner[size_t(k)] != corner) ++k;
    return cell.position(k);
}

}  // namespace

SmoothRegions smoothRegions(const Mesh& mesh, const std::vector<Cell>& cells, uint32_t first,
                            uint32_t last) {
    std::vector<HalfEdge> halfEdges;
    for (uint32_t c = first; c < last; ++c) {
        throwIfCancelledAt(c);
        const int n = cells[c].cornerCount();
        for (int k = 0; k < n; ++k) {
            const int32_t from = cells[c].corner[k], to = cells[c].corner[(k + 1) % n];
            const int32_t a = mesh.cornerVertices[from], b = mesh.cornerVertices[to];
            halfEdges.push_back(
                {edgeKey(a, b), c, from, to, a < b, (cells[c].parted >> k & 1) != 0});
        }
    }
    std::sort(halfEdges.begin(), halfEdges.end(), [](const HalfEdge& a, const HalfEdge& b) {
        return std::make_pair(a.key, a.from) < std::make_pair(b.key, b.from);
    });

    auto normalAt = [&](uint32_t cell, int32_t corner) {
        if (!mesh.cornerNormals.empty()) return glm::vec3(mesh.cornerNormals[corner]);
        return glm::vec3(cells[cell].normal());
    };
    // The normal of a sliver is mere rounding. The normal of the cell beyond the sliver's longest
    // edge, at a corner of that cell, is used as well.
    auto isLongest = [&](const HalfEdge& e) {
        const Cell& cell = cells[e.cell];
        const float length = glm::distance(placeOf(cell, e.from), placeOf(cell, e.to));
        return length >=
               std::max({glm::length(cell.a), glm::length(cell.b), glm::distance(cell.a, cell.b)});
    };
    std::map<uint32_t, glm::vec3> beyond;  // per sliver
    for (size_t i = 0; i + 1 < halfEdges.size(); ++i)
        for (size_t k : {i, i + 1}) {
            const HalfEdge &e = halfEdges[k], &f = halfEdges[2 * i + 1 - k];
            if (!cells[e.cell].hasPatches && cells[f.cell].hasPatches && e.key == f.key &&
                isLongest(e))
                beyond[e.cell] = normalAt(f.cell, f.from);
        }
    auto joins = [&](const HalfEdge& e, int32_t corner, const HalfEdge& f, int32_t other) {
        auto normalOf = [&](const HalfEdge& edge, int32_t at) {
            const auto found = beyond.find(edge.cell);
            return found != beyond.end() ? found->second : normalAt(edge.cell, at);
        };
        return glm::dot(normalAt(e.cell, corner), normalAt(f.cell, other)) >= kSameNormal ||
               glm::dot(normalOf(e, corner), normalOf(f, other)) >= kSameNormal;
    };

    SmoothRegions regions;
    DisjointSets joined(mesh.cornerCount());
    for (size_t i = 0; i < halfEdges.size();) {
        size_t end = i + 1;
        while (end < halfEdges.size() && halfEdges[end].key == halfEdges[i].key) ++end;
        const HalfEdge& e = halfEdges[i];
        const HalfEdge& f = halfEdges[end - 1];
        const bool joinable =
            end - i == 2 && !e.isParted && !f.isParted &&
            !std::binary_search(mesh.sharpEdges.begin(), mesh.sharpEdges.end(), e.key) &&
            e.ascending != f.ascending &&
            mesh.faceMaterials[cells[e.cell].face] == mesh.faceMaterials[cells[f.cell].face];
        i = end;
        if (!joinable) continue;
        const bool start = joins(e, e.from, f, f.to), finish = joins(e, e.to, f, f.from);
        if (start) joined.join(uint32_t(e.from), uint32_t(f.to));
        if (finish) joined.join(uint32_t(e.to), uint32_t(f.from));
        if (start && finish)
            regions.edges.push_back({{e.cell, f.cell}, {e.from, e.to, f.to, f.from}});
    }

    regions.nodeOf.resize(mesh.cornerCount());
    std::vector<uint32_t> nodeOfRoot(mesh.cornerCount(), UINT32_MAX);
    for (uint32_t c = 0; c < mesh.cornerCount(); ++c) {
        uint32_t& node = nodeOfRoot[joined.root(c)];
        if (node == UINT32_MAX) node = regions.nodeCount++;
        regions.nodeOf[c] = node;
    }
    return regions;
}

}  // namespace raybundle
