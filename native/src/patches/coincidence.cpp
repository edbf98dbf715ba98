// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/coincidence.h"

#include <algorithm>
#include <numeric>

namespace raybundle {

std::vector<bool> closedFaces(const Mesh& mesh) {
    // Parts are sets of vertices joined by faces.
    std::vector<int32_t> part(mesh.vertices.size());
    std::iota(part.begin(), part.end(), 0);
    auto root = [&](int32_t v) {
        while (part[size_t(v)] != v) v = part[size_t(v)] = part[size_t(part[size_t(v)])];
        return v;
    };
    struct Edge {
        uint64_t key;
        int32_t vertex;
        int turn;  // +1 from the smaller vertex to the larger, else -1
    };
    std::vector<Edge> edges;
    edges.reserve(mesh.cornerCount());
    for (size_t f = 0; f < mesh.faceCount(); ++f) {
        const int32_t begin = mesh.faceOffsets[f], end = mesh.faceOffsets[f + 1];
        for (int32_t c = begin; c < end; ++c) {
            const int32_t a = mesh.cornerVertices[size_t(c)];
            const int32_t b = mesh.cornerVertices[size_t(c + 1 < end ? c + 1 : begin)];
            edges.push_back({edgeKey(a, b), a, a < b ? 1 : -1});
            part[size_t(root(a))] = root(b);
        }
    }
    std::sort(edges.begin(), edges.end(),
              [](const Edge& a, const Edge& b) { return a.key < b.key; });
    std::vector<bool> closed(mesh.vertices.size(), true);  // at the root of a part
    for (size_t i = 0; i < edges.size();) {
        size_t end = i;
        int turns = 0;
        for (; end < edges.size() && edges[end].key == edges[i].key; ++end)
            turns += edges[end].turn;
        if (end - i != 2 || turns != 0) closed[size_t(root(edges[i].vertex))] = false;
        i = end;
    }
    std::vector<bool> result(mesh.faceCount());
    for (size_t f = 0; f < mesh.faceCount(); ++f)
        result[f] = closed[size_t(root(mesh.cornerVertices[size_t(mesh.faceOffsets[f])]))];
    return result;
}

}  // namespace raybundle
