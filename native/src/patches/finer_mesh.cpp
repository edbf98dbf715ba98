// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/finer_mesh.h"

#include <algorithm>

namespace raybundle {

FinerMesh FinerMesh::of(const Mesh& source) {
    FinerMesh mesh;
    mesh.vertices = source.vertices;
    mesh.cornerVertices = source.cornerVertices;
    mesh.faceOffsets = source.faceOffsets;
    mesh.sourceCornerCount = source.cornerCount();
    for (int32_t f = 0; f < int32_t(source.faceCount()); ++f) mesh.sourceFaces.push_back(f);
    for (int32_t c = 0; c < int32_t(source.cornerCount()); ++c) {
        mesh.sourceCorners.push_back({c, c, c});
        mesh.sourceWeights.push_back({1, 0, 0});
        mesh.sourceEdges.push_back(c);
        mesh.isAbrupt.push_back(0);
    }
    return mesh;
}

Mesh FinerMesh::withAttributesOf(const Mesh& source) const {
    Mesh mesh;
    mesh.name = source.name;
    mesh.vertices = vertices;
    mesh.cornerVertices = cornerVertices;
    mesh.faceOffsets = faceOffsets;
    if (!source.faceMaterials.empty())
        for (int32_t face : sourceFaces)
            mesh.faceMaterials.push_back(source.faceMaterials[size_t(face)]);
    for (size_t c = 0; c < cornerVertices.size(); ++c) {
        if (!source.cornerNormals.empty()) {
            const glm::vec3 normal = interpolate(c, source.cornerNormals);
            const float length = glm::length(normal);
            mesh.cornerNormals.push_back(
                length > 0 ? normal / length : source.cornerNormals[size_t(sourceCorners[c][0])]);
        }
        if (!source.uvs.empty()) mesh.uvs.push_back(interpolate(c, source.uvs));
        if (!source.cornerColors.empty())
            mesh.cornerColors.push_back(interpolate(c, source.cornerColors));
    }
    auto isSharp = [&](int32_t face, int32_t from) {
        const int32_t end = source.faceOffsets[size_t(face) + 1];
        const int32_t to = from + 1 == end ? source.faceOffsets[size_t(face)] : from + 1;
        return std::binary_search(
            source.sharpEdges.begin(), source.sharpEdges.end(),
            edgeKey(source.cornerVertices[size_t(from)], source.cornerVertices[size_t(to)]));
    };
    for (size_t f = 0; f < faceCount(); ++f) {
        const int32_t begin = faceOffsets[f], end = faceOffsets[f + 1];
        for (int32_t c = begin; c < end; ++c) {
            const int32_t from = sourceEdges[size_t(c)];
            if (isAbrupt[size_t(c)] || (from >= 0 && isSharp(sourceFaces[f], from)))
                mesh.sharpEdges.push_back(
                    edgeKey(cornerVertices[size_t(c)],
                            cornerVertices[size_t(c + 1 == end ? begin : c + 1)]));
        }
    }
    std::sort(mesh.sharpEdges.begin(), mesh.sharpEdges.end());
    mesh.sharpEdges.erase(std::unique(mesh.sharpEdges.begin(), mesh.sharpEdges.end()),
                          mesh.sharpEdges.end());
    return mesh;
}

}  // namespace raybundle
