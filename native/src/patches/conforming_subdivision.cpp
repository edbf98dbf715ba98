// SPDX-License-Identifier: GPL-3.0-or-later
//
// Longest-edge bisection on OpenMesh's half-edges.
//
// Source: the rule of OpenMesh's Subdivider::Uniform::LongestEdgeT.
// Differs:
// - Faces keep their source triangle through the splits.
// - Edges with more than two faces, which OpenMesh cannot store, are cut open. Their sides may then
//   be bisected differently.
// - Slivers are removed first. A sliver is a triangle that is flat except for a rounding error, as
//   booleans leave it and as T-junctions are filled. Its shortest edge is collapsed if it is short
//   enough. Otherwise its longest edge is flipped, so that the triangle beyond that edge gets the
//   sliver's third vertex.
// - Of several faces with the same corners, only one is kept.
#include "patches/conforming_subdivision.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Utils/PropertyManager.hh>
#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <set>

#include "job/error.h"
#include "scene/triangulation.h"

namespace raybundle {
namespace {

struct Traits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
};
using TriMesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;

// Largest number of triangles.
constexpr size_t kMaxTriangles = size_t(1) << 26;
// A triangle is a sliver if its height is less than this share of its longest edge. The value is
// several times the rounding error of a triangle that is ten times its edge length from the origin.
constexpr double kFlat = 1e-5;
// Flips and collapses per sliver, at most: connected slivers may turn into each other without end.
constexpr size_t kMostSteps = 16;

// A triangle of the source mesh before any bisection.
struct SourceTriangle {
    int32_t face;
    std::array<int32_t, 3> corner;
};

OpenMesh::Vec3d point(const Mesh& mesh, int32_t corner) {
    const glm::vec3& p = mesh.vertices[size_t(mesh.cornerVertices[size_t(corner)])];
    return {p.x, p.y, p.z};
}

// Returns the barycentric coordinates of a point in a triangle.
std::array<float, 3> barycentric(const OpenMesh::Vec3d& p,
                                 const std::array<OpenMesh::Vec3d, 3>& t) {
    const OpenMesh::Vec3d normal = (t[1] - t[0]) % (t[2] - t[0]);
    const double scale = normal | normal;
    const double b = (normal | ((t[2] - p) % (t[0] - p))) / scale;
    const double c = (normal | ((t[0] - p) % (t[1] - p))) / scale;
    if (!std::isfinite(b) || !std::isfinite(c)) return {1, 0, 0};
    // The point is in the triangle: coordinates outside are rounding errors, which are unbounded
    // where edges are long.
    const double second = std::clamp(b, 0.0, 1.0), third = std::clamp(c, 0.0, 1.0);
    const double first = std::max(1 - second - third, 0.0), sum = first + second + third;
    return {float(first / sum), float(second / sum), float(third / sum)};
}

using SourceOf = OpenMesh::FProp<int>;  // index of the face's SourceTriangle

// The longest and the shortest edge of a face, and whether the face is a sliver.
struct Shape {
    TriMesh::HalfedgeHandle longest, shortest;
    // `hasPoint`: the shortest edge is no longer than a sliver is high, so that it can be
    // collapsed.
    bool isSliver, hasPoint;

    Shape(const TriMesh& mesh, TriMesh::FaceHandle face) {
        double most = -1, least = INFINITY;
        std::array<OpenMesh::Vec3d, 3> corners;
        size_t k = 0;
        for (const auto edge : mesh.fh_range(face)) {
            const double length = mesh.calc_edge_length(edge);
            if (length > most) {
                most = length;
                longest = edge;
            }
            if (length < least) {
                least = length;
                shortest = edge;
            }
            corners[k++] = mesh.point(mesh.from_vertex_handle(edge));
        }
        const double across = ((corners[1] - corners[0]) % (corners[2] - corners[0])).norm();
        isSliver = across <= kFlat * most * most;
        hasPoint = least <= kFlat * most;
    }
};

// Removes slivers by flips and collapses, and deletes those for which neither works.
void takeOutSlivers(TriMesh& mesh, SourceOf& sourceTriangle) {
    std::vector<TriMesh::FaceHandle> pending;
    for (const auto face : mesh.faces())
        if (Shape(mesh, face).isSliver) pending.push_back(face);
    if (pending.empty()) return;
    mesh.request_face_status();
    mesh.request_edge_status();
    mesh.request_vertex_status();
    mesh.request_halfedge_status();
    size_t steps = kMostSteps * pending.size();
    while (!pending.empty()) {
        const TriMesh::FaceHandle face = pending.back();
        pending.pop_back();
        if (mesh.status(face).deleted()) continue;
        const Shape shape(mesh, face);
        if (!shape.isSliver) continue;
        const TriMesh::EdgeHandle edge = mesh.edge_handle(shape.longest);
        const bool mayTurn = steps > 0;
        steps -= mayTurn;
        if (mayTurn && shape.hasPoint && mesh.is_collapse_ok(shape.shortest)) {
            mesh.collapse(shape.shortest);
        } else if (mayTurn && !shape.hasPoint && mesh.is_flip_ok(edge)) {
            const TriMesh::FaceHandle beyond = mesh.opposite_face_handle(shape.longest);
            sourceTriangle[face] = sourceTriangle[beyond];
            mesh.flip(edge);
            pending.insert(pending.end(), {face, beyond});
        } else {
            mesh.delete_face(face, true);
        }
    }
    mesh.garbage_collection();
}

// Finds faces that repeat an earlier face: the same corners in the same order around, as in copies
// of faces with split edges. They would be cut differently from each other, and their pieces would
// overlap.
class Doubles {
  public:
    explicit Doubles(const Mesh& mesh) : mesh(mesh) {
        std::map<std::array<float, 3>, int32_t> firstAt;
        for (const glm::vec3& v : mesh.vertices)
            place.push_back(
                firstAt.emplace(std::array<float, 3>{v.x, v.y, v.z}, int32_t(place.size()))
                    .first->second);
    }

    // Returns whether no face with these corners has come before. Call it once for each face.
    bool isFirst(size_t face) {
        std::vector<int32_t> around;
        for (int32_t c = mesh.faceOffsets[face]; c < mesh.faceOffsets[face + 1]; ++c)
            around.push_back(place[size_t(mesh.cornerVertices[size_t(c)])]);
        std::rotate(around.begin(), std::min_element(around.begin(), around.end()), around.end());
        return met.insert(std::move(around)).second;
    }

  private:
    const Mesh& mesh;
    std::vector<int32_t> place;  // per vertex: the first vertex at its position
    std::set<std::vector<int32_t>> met;
};

// The triangles of a mesh, and the source triangle that each is cut from.
struct Triangles {
    TriMesh mesh;
    SourceOf sourceTriangle{mesh};
    std::vector<SourceTriangle> sourceTriangles;

    // Adds a triangle. If OpenMesh refuses it because an edge would have more than two faces, the
    // triangle gets vertices of its own.
    void add(const std::array<TriMesh::VertexHandle, 3>& v, const SourceTriangle& source) {
        TriMesh::FaceHandle face = mesh.add_face(v[0], v[1], v[2]);
        if (!face.is_valid()) {
            // Copy the points first: adding a vertex moves them.
            const std::array<OpenMesh::Vec3d, 3> p{mesh.point(v[0]), mesh.point(v[1]),
                                                   mesh.point(v[2])};
            face =
                mesh.add_face(mesh.add_vertex(p[0]), mesh.add_vertex(p[1]), mesh.add_vertex(p[2]));
        }
        sourceTriangle[face] = int(sourceTriangles.size());
        sourceTriangles.push_back(source);
    }
};

// Adds the triangles of all faces except doubles.
void addFaces(const Mesh& source, Triangles& triangles) {
    std::vector<TriMesh::VertexHandle> handles;
    for (const glm::vec3& v : source.vertices)
        handles.push_back(triangles.mesh.add_vertex({v.x, v.y, v.z}));
    Doubles doubles(source);
    for (size_t f = 0; f < source.faceCount(); ++f) {
        if (!doubles.isFirst(f)) continue;
        std::vector<glm::dvec3> points;
        for (int32_t c = source.faceOffsets[f]; c < source.faceOffsets[f + 1]; ++c)
            points.push_back(source.vertices[size_t(source.cornerVertices[size_t(c)])]);
        for (const std::array<int, 3>& t : triangulate(points)) {
            SourceTriangle triangle{int32_t(f), {}};
            std::array<TriMesh::VertexHandle, 3> v;
            for (int k = 0; k < 3; ++k) {
                triangle.corner[size_t(k)] = source.faceOffsets[f] + t[size_t(k)];
                v[size_t(k)] =
                    handles[size_t(source.cornerVertices[size_t(triangle.corner[size_t(k)])])];
            }
            if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
            triangles.add(v, triangle);
        }
    }
}

// Bisects the longest edge until none is longer than `maxEdge`.
void bisectEdges(const Mesh& source, float maxEdge, TriMesh& mesh) {
    using Entry = std::pair<double, int>;  // squared length, edge index
    std::priority_queue<Entry> queue;
    const double enough = double(maxEdge) * maxEdge;
    auto push = [&](TriMesh::EdgeHandle edge) {
        const double length2 = mesh.calc_edge_sqr_length(edge);
        if (length2 > enough) queue.emplace(length2, edge.idx());
    };
    for (auto edge : mesh.edges()) push(edge);
    while (!queue.empty()) {
        const auto [length2, index] = queue.top();
        queue.pop();
        const TriMesh::EdgeHandle edge(index);
        // Edges that were split after they were queued have another length.
        if (mesh.calc_edge_sqr_length(edge) != length2) continue;
        const TriMesh::VertexHandle middle = mesh.add_vertex(mesh.calc_edge_midpoint(edge));
        mesh.split_copy(edge, middle);
        for (auto spoke : mesh.voh_range(middle)) push(mesh.edge_handle(spoke));
        if (mesh.n_faces() > kMaxTriangles)
            throw invalidArgument("mesh \"" + source.name + "\": edges of at most " +
                                  std::to_string(maxEdge) + " need more than " +
                                  std::to_string(kMaxTriangles) + " triangles; allow longer edges");
    }
}

}  // namespace

ConformingSubdivision subdivideConforming(const Mesh& source, float maxEdge) {
    omerr().disable();  // its messages are of no use to the caller
    Triangles triangles;
    addFaces(source, triangles);
    TriMesh& mesh = triangles.mesh;
    takeOutSlivers(mesh, triangles.sourceTriangle);
    bisectEdges(source, maxEdge, mesh);

    ConformingSubdivision result;
    for (auto v : mesh.vertices()) {
        const OpenMesh::Vec3d& p = mesh.point(v);
        result.vertices.emplace_back(float(p[0]), float(p[1]), float(p[2]));
    }
    for (auto face : mesh.faces()) {
        const SourceTriangle& origin =
            triangles.sourceTriangles[size_t(triangles.sourceTriangle[face])];
        const std::array<OpenMesh::Vec3d, 3> corners{point(source, origin.corner[0]),
                                                     point(source, origin.corner[1]),
                                                     point(source, origin.corner[2])};
        std::array<int32_t, 3> triangle;
        size_t k = 0;
        for (auto v : mesh.fv_range(face)) {
            triangle[k++] = v.idx();
            result.sourceCorners.push_back(origin.corner);
            result.sourceWeights.push_back(barycentric(mesh.point(v), corners));
        }
        result.triangles.push_back(triangle);
        result.sourceFaces.push_back(origin.face);
    }
    return result;
}

}  // namespace raybundle
