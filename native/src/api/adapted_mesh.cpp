// SPDX-License-Identifier: GPL-3.0-or-later
#include "api/border.h"
#include "bake/bake.h"

using namespace raybundle;

rb_error rb_get_adapted_mesh_size(rb_bake bake, int32_t instance, size_t* vertex_count,
                                  size_t* corner_count, size_t* face_count) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        need(vertex_count, "vertex_count");
        need(corner_count, "corner_count");
        need(face_count, "face_count");
        const FinerMesh& mesh = held->adaptedMesh(instance);
        *vertex_count = mesh.vertices.size();
        *corner_count = mesh.cornerVertices.size();
        *face_count = mesh.faceCount();
    });
}

rb_error rb_get_adapted_mesh(rb_bake bake, int32_t instance, float* vertices, size_t vertex_count,
                             int32_t* corner_vertices, int32_t* source_corners,
                             float* source_weights, int32_t* source_edges, size_t corner_count,
                             int32_t* face_offsets, int32_t* source_faces, size_t face_count) {
    return guarded([&] {
        const HeldBake held(bake, "bake");
        const FinerMesh& mesh = held->adaptedMesh(instance);
        needCount(vertex_count, mesh.vertices.size(), "vertex_count");
        needCount(corner_count, mesh.cornerVertices.size(), "corner_count");
        needCount(face_count, mesh.faceCount(), "face_count");
        copyArray(mesh.vertices, vertices, "vertices");
        copyArray(mesh.cornerVertices, corner_vertices, "corner_vertices");
        copyArray(mesh.sourceCorners, source_corners, "source_corners");
        copyArray(mesh.sourceWeights, source_weights, "source_weights");
        copyArray(mesh.sourceEdges, source_edges, "source_edges");
        copyArray(mesh.faceOffsets, face_offsets, "face_offsets");
        copyArray(mesh.sourceFaces, source_faces, "source_faces");
    });
}
