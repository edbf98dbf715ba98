// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/simplification.h"

#include "api/border.h"

using namespace raybundle;

namespace {

using Simplifications = Handles<rb_simplification, SimplifiedMesh>;
using HeldSimplification = Held<rb_simplification, SimplifiedMesh>;

}  // namespace

rb_error rb_new_simplification(const float* vertices, size_t vertex_count,
                               const int32_t* corner_vertices, size_t corner_count,
                               const int32_t* face_offsets, size_t face_count,
                               const int32_t* face_kinds, const int32_t* kept_edges,
                               const float* values, const float* tolerances, size_t value_count,
                               float distance, rb_simplification* simplification) {
    return guarded([&] {
        need(simplification, "simplification");
        // Scene::addMesh checks the mesh.
        Scene scene;
        const int32_t mesh = scene.addMesh(makeMesh("", vertices, vertex_count, corner_vertices,
                                                    corner_count, face_offsets, face_count));
        if (corner_count > 0 && value_count > SIZE_MAX / sizeof(float) / corner_count)
            throw invalidArgument("there are too many values");
        needArray(values, corner_count * value_count, "values");
        needArray(tolerances, value_count, "tolerances");
        SimplificationLimits limits;
        limits.values.assign(values, values + corner_count * value_count);
        limits.tolerances.assign(tolerances, tolerances + value_count);
        limits.distance = distance;
        if (face_kinds) limits.faceKinds.assign(face_kinds, face_kinds + face_count);
        if (kept_edges)
            for (size_t c = 0; c < corner_count; ++c)
                limits.keptEdges.push_back(kept_edges[c] != 0);
        *simplification = Simplifications::add(
            std::make_unique<SimplifiedMesh>(simplify(scene.meshes[size_t(mesh)], limits)));
    });
}

void rb_release_simplification(rb_simplification simplification) {
    Simplifications::release(simplification);
}

rb_error rb_get_simplification_size(rb_simplification simplification, size_t* corner_count,
                                    size_t* face_count) {
    return guarded([&] {
        const HeldSimplification held(simplification, "simplification");
        need(corner_count, "corner_count");
        need(face_count, "face_count");
        *corner_count = held->sourceCorners.size();
        *face_count = held->sourceFaces.size();
    });
}

rb_error rb_get_simplification(rb_simplification simplification, int32_t* source_corners,
                               int32_t* source_edges, size_t corner_count, int32_t* face_offsets,
                               int32_t* source_faces, size_t face_count, float* changes,
                               size_t value_count) {
    return guarded([&] {
        const HeldSimplification held(simplification, "simplification");
        const SimplifiedMesh& made = *held;
        needCount(corner_count, made.sourceCorners.size(), "corner_count");
        needCount(face_count, made.sourceFaces.size(), "face_count");
        needCount(value_count, made.changes.size(), "value_count");
        copyArray(made.sourceCorners, source_corners, "source_corners");
        copyArray(made.sourceEdges, source_edges, "source_edges");
        copyArray(made.faceOffsets, face_offsets, "face_offsets");
        copyArray(made.sourceFaces, source_faces, "source_faces");
        copyArray(made.changes, changes, "changes");
    });
}
