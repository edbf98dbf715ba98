// SPDX-License-Identifier: GPL-3.0-or-later
//
// Fuzz target that calls rb_new_subdivision and rb_new_simplification with arbitrary meshes. The
// functions must either reject a mesh with a message, or return faces with valid indices, and
// rb_new_subdivision also weights that sum to 1. Like api_fuzzer.cpp this is a target of libFuzzer.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "raybundle/raybundle.h"

namespace {

[[noreturn]] void die(const char* what) {
    std::fprintf(stderr, "%s: %s\n", what, rb_get_error_message());
    std::abort();
}

float numberOf(const uint8_t* bytes) {
    // Mostly a coordinate in the range of rooms, sometimes any float.
    if (bytes[0] < 220) return float(bytes[0]) / 50 + float(bytes[1]) / 5000;
    float value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

// Arrays of rb_add_mesh.
struct FuzzedMesh {
    size_t vertices = 0;
    std::vector<float> positions;
    std::vector<int32_t> corners, offsets{0};
};

// Returns whether a call has succeeded. Ends the program if it was refused without a reason.
bool isMade(rb_error error, const void* made) {
    if (error == RB_ERROR_NONE) return true;
    if (!*rb_get_error_message()) die("a refusal without a message");
    if (error == RB_ERROR_UNKNOWN || made) die("an error that is not known");
    return false;
}

void simplify(const FuzzedMesh& mesh, float distance) {
    // Each corner has its own value, so that some edges are features.
    std::vector<float> values;
    for (size_t c = 0; c < mesh.corners.size(); ++c) values.push_back(float(c % 7 / 5));
    const float tolerance = 0.5f;
    rb_simplification made = nullptr;
    if (!isMade(
            rb_new_simplification(mesh.positions.data(), mesh.vertices, mesh.corners.data(),
                                  mesh.corners.size(), mesh.offsets.data(), mesh.offsets.size() - 1,
                                  nullptr, nullptr, values.data(), &tolerance, 1, distance, &made),
            made))
        return;
    size_t cornerCount = 0, faceCount = 0;
    rb_get_simplification_size(made, &cornerCount, &faceCount);
    std::vector<int32_t> from(cornerCount), edges(cornerCount), offsets(faceCount + 1),
        faces(faceCount);
    float change = 0;
    if (rb_get_simplification(made, from.data(), edges.data(), cornerCount, offsets.data(),
                              faces.data(), faceCount, &change, 1) != RB_ERROR_NONE)
        die("no result");
    if (size_t(offsets.back()) != cornerCount) die("faces that do not end with the corners");
    for (size_t c = 0; c < cornerCount; ++c)
        if (from[c] < 0 || edges[c] < -1 ||
            size_t(std::max(from[c], edges[c])) >= mesh.corners.size())
            die("a corner that does not exist");
    for (int32_t face : faces)
        if (face < 0 || size_t(face) + 1 >= mesh.offsets.size()) die("a face that does not exist");
    if (!(change >= 0 && change <= tolerance)) die("a change beyond the tolerance");
    rb_release_simplification(made);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size < 3) return 0;
    FuzzedMesh mesh;
    const size_t vertices = mesh.vertices = data[0] % 16;
    const float maxEdge = data[1] < 250 ? float(data[1] + 10) / 100 : float(data[1] - 252);
    std::vector<float>& positions = mesh.positions;
    positions.resize(3 * vertices);
    size_t at = 2;
    for (float& value : positions) {
        if (at + 4 > size) return 0;
        value = numberOf(data + at);
        at += 4;
    }
    // One byte per corner; 255 ends a face.
    std::vector<int32_t>&corners = mesh.corners, &offsets = mesh.offsets;
    for (; at < size && corners.size() < 64; ++at) {
        if (data[at] < 255)
            corners.push_back(data[at] < 250 ? data[at] % 16 : int32_t(data[at]) - 252);
        else
            offsets.push_back(int32_t(corners.size()));
    }
    simplify(mesh, maxEdge);
    // Bisecting edges of 1e30 m down to centimetres would not end, so max_edge grows with the mesh.
    float longest = 0;
    for (float value : positions)
        if (std::isfinite(value)) longest = std::max(longest, std::abs(value));
    rb_subdivision made = nullptr;
    const rb_error error = rb_new_subdivision(positions.data(), vertices, corners.data(),
                                              corners.size(), offsets.data(), offsets.size() - 1,
                                              longest < 10 ? maxEdge : maxEdge * longest, &made);
    if (!isMade(error, made)) return 0;
    size_t vertexCount = 0, triangles = 0;
    rb_get_subdivision_size(made, &vertexCount, &triangles);
    std::vector<float> points(3 * vertexCount), weights(9 * triangles);
    std::vector<int32_t> indices(3 * triangles), faces(triangles), sources(9 * triangles);
    if (rb_get_subdivision(made, points.data(), vertexCount, indices.data(), faces.data(),
                           sources.data(), weights.data(), triangles) != RB_ERROR_NONE)
        die("no result");
    for (float value : points)
        if (!std::isfinite(value)) die("a vertex that is not finite");
    for (int32_t index : indices)
        if (index < 0 || size_t(index) >= vertexCount) die("a vertex that does not exist");
    for (int32_t face : faces)
        if (face < 0 || size_t(face) + 1 >= offsets.size()) die("a face that does not exist");
    for (size_t k = 0; k < 3 * triangles; ++k) {
        float sum = 0;
        for (size_t c = 3 * k; c < 3 * k + 3; ++c) {
            if (sources[c] < 0 || size_t(sources[c]) >= corners.size())
                die("a corner that does not exist");
            sum += weights[c];
        }
        if (!(std::abs(sum - 1) < 1e-4f)) die("weights that do not sum to 1");
    }
    rb_release_subdivision(made);
    return 0;
}
