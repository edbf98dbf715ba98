// SPDX-License-Identifier: GPL-3.0-or-later
#include "api/border.h"
#include "patches/conforming_subdivision.h"

using namespace raybundle;

namespace {

using Subdivisions = Handles<rb_subdivision, ConformingSubdivision>;
using HeldSubdivision = Held<rb_subdivision, ConformingSubdivision>;

}  // namespace

rb_error rb_new_subdivision(const float* vertices, size_t vertex_count,
                            const int32_t* corner_vertices, size_t corner_count,
                            const int32_t* face_offsets, size_t face_count, float max_edge,
                            rb_subdivision* subdivision) {
    return guarded([&] {
        need(subdivision, "subdivision");
        if (!(max_edge > 0)) throw invalidArgument("max_edge must be positive");
        // Scene::addMesh checks the mesh.
        Scene scene;
        const int32_t mesh = scene.addMesh(makeMesh("", vertices, vertex_count, corner_vertices,
                                                    corner_count, face_offsets, face_count));
        *subdivision = Subdivisions::add(std::make_unique<ConformingSubdivision>(
            subdivideConforming(scene.meshes[size_t(mesh)], max_edge)));
    });
}

void rb_release_subdivision(rb_subdivision subdivision) { Subdivisions::release(subdivision); }

rb_error rb_get_subdivision_size(rb_subdivision subdivision, size_t* vertex_count,
                                 size_t* triangle_count) {
    return guarded([&] {
        const HeldSubdivision held(subdivision, "subdivision");
        need(vertex_count, "vertex_count");
        need(triangle_count, "triangle_count");
        *vertex_count = held->vertices.size();
        *triangle_count = held->triangles.size();
    });
}

rb_error rb_get_subdivision(rb_subdivision subdivision, float* vertices, size_t vertex_count,
                            int32_t* triangles, int32_t* source_faces, int32_t* source_corners,
                            float* source_weights, size_t triangle_count) {
    return guarded([&] {
        const HeldSubdivision held(subdivision, "subdivision");
        const ConformingSubdivision& s = *held;
        needCount(vertex_count, s.vertices.size(), "vertex_count");
        needCount(triangle_count, s.triangles.size(), "triangle_count");
        copyArray(s.vertices, vertices, "vertices");
        copyArray(s.triangles, triangles, "triangles");
        copyArray(s.sourceFaces, source_faces, "source_faces");
        copyArray(s.sourceCorners, source_corners, "source_corners");
        copyArray(s.sourceWeights, source_weights, "source_weights");
    });
}
