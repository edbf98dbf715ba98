// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/simplification.h"

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <numeric>
#include <queue>

#include "refinement/collapsing_mesh.h"

namespace raybundle {
namespace {

using Triangle = CollapsingTriangle;
using VertexHandle = CollapsingMesh::Mesh3::VertexHandle;
using HalfedgeHandle = CollapsingMesh::Mesh3::HalfedgeHandle;

// Least cosine between the normals of a triangle before and after a collapse.
constexpr double kLeastTurn = 0.5;
// Least height of a triangle over its longest edge, unless triangles were thinner before.
constexpr double kThin = 0.05;
// Weight of the length of the collapsed edge, relative to the largest extent of the mesh, in the
// order of the collapses. Among those that change nothing, short edges come first.
constexpr float kByLength = 0.01f;

// Returns the point of a triangle that is nearest to a point, by the weights of its corners.
// Source: Ericson, "Real-Time Collision Detection" (2005), section 5.1.5.
glm::dvec3 nearestIn(const std::array<glm::dvec3, 3>& t, const glm::dvec3& p) {
    const glm::dvec3 ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
    const glm::dvec3 bp = p - t[1];
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return {d3 / (d3 - d1), d1 / (d1 - d3), 0};
    const glm::dvec3 cp = p - t[2];
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return {d6 / (d6 - d2), 0, d2 / (d2 - d6)};
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) {
        const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {0, 1 - w, w};
    }
    return glm::dvec3(va, vb, vc) / (va + vb + vc);
}

// Returns the height of a triangle over its longest edge.
double shapeOf(const std::array<glm::dvec3, 3>& t) {
    const double across = glm::length(glm::cross(t[1] - t[0], t[2] - t[0]));
    const double longest =
        std::max({glm::dot(t[1] - t[0], t[1] - t[0]), glm::dot(t[2] - t[0], t[2] - t[0]),
                  glm::dot(t[2] - t[1], t[2] - t[1])});
    return longest > 0 ? across / longest : 0;
}

class Simplifier {
  public:
    Simplifier(const Mesh& source, const SimplificationLimits& limits)
        : source(source), limits(limits), surface(source, limits) {}

    void run();
    SimplifiedMesh result() const;

  private:
    // The triangles on one side of a collapse, between two features or all around.
    struct Side {
        std::vector<int32_t> changing;   // get the other end of the edge
        std::vector<int32_t> vanishing;  // beside the edge
        // Of the vertex that is removed, and of the one that stays.
        int32_t corner = -1, other = -1;

        void clear() {
            changing.clear();
            vanishing.clear();
        }
    };
    // An edge that may be collapsed, from the vertex that is removed.
    struct Entry {
        float priority;
        HalfedgeHandle edge;
        uint32_t version;
        bool operator<(const Entry& e) const {
            return priority != e.priority ? priority > e.priority : edge.idx() > e.edge.idx();
        }
    };
    // The nearest place among triangles: its squared distance and weights.
    struct Place {
        double distance2 = INFINITY;
        size_t triangle = 0;
        glm::dvec3 weights{0.0};
    };

    std::array<int32_t, 3> cornersAfter(const Side& side, int32_t triangle, int32_t vertex) const;

    // Finds the sides of a collapse. Returns false if features forbid it.
    bool findSides(HalfedgeHandle edge);
    bool mayCollapse(HalfedgeHandle edge) const;
    // Returns the largest change by a collapse relative to its limit, or a negative number if it
    // must not be made. `all`: as in changeOn().
    float changeBy(HalfedgeHandle edge, bool all);
    // Returns the largest change on one side relative to its limit, or a negative number if it is
    // beyond. `all`: at all vertices removed so far, and not only at `vertex`.
    float changeOn(const Side& side, int32_t vertex, bool all);
    Place nearest(const std::vector<std::array<glm::dvec3, 3>>& triangles,
                  const glm::dvec3& p) const;
    // Returns the change of a value at a corner of the source that lies at a place of a triangle.
    double changeOf(size_t value, int32_t corner, const std::array<int32_t, 3>& corners,
                    const Place& place) const;
    float changeAt(int32_t corner, const std::array<int32_t, 3>& corners, const Place& place) const;
    void queueEdgesFrom(VertexHandle vertex);
    void collapse(HalfedgeHandle edge);

    const Mesh& source;
    const SimplificationLimits& limits;
    CollapsingMesh surface;
    CollapsingMesh::Mesh3& mesh = surface.mesh;
    std::vector<Triangle>& triangles = surface.triangles;
    // Of the collapse that is looked at: its sides, the last of which may be empty, and the triangles
    // of one side afterwards.
    std::array<Side, 2> sides;
    std::vector<std::array<glm::dvec3, 3>> after;
    std::vector<std::array<int32_t, 3>> cornersThere;
    std::vector<uint32_t> version;  // per vertex: of the entries of its edges
    std::priority_queue<Entry> queue;
};

bool Simplifier::findSides(HalfedgeHandle edge) {
    const VertexHandle v0 = mesh.from_vertex_handle(edge), v1 = mesh.to_vertex_handle(edge);
    const int32_t count = surface.featureCounts[size_t(v0.idx())];
    const bool isAlong = count == 2 && surface.isFeature(v0.idx(), v1.idx());
    if (surface.isLocked[size_t(v0.idx())] || (count != 0 && !isAlong)) return false;
    for (Side& side : sides) side.clear();
    // Around the vertex, from the edge to the left until the next feature, and to the right.
    for (const bool isLeft : {true, false}) {
        Side& side = sides[isLeft ? 0 : 1];
        HalfedgeHandle spoke = edge;
        for (;;) {
            const HalfedgeHandle inside = isLeft ? spoke : mesh.opposite_halfedge_handle(spoke);
            const auto face = mesh.face_handle(inside);
            if (!face.is_valid()) break;
            const int32_t t = surface.triangleOf[size_t(face.idx())];
            spoke = isLeft ? mesh.opposite_halfedge_handle(mesh.prev_halfedge_handle(inside))
                           : mesh.next_halfedge_handle(inside);
            if (side.vanishing.empty()) {
                const Triangle& triangle = triangles[size_t(t)];
                side.corner = triangle.corner[size_t(triangle.at(v0.idx()))];
                side.other = triangle.corner[size_t(triangle.at(v1.idx()))];
            }
            const bool isBeside = side.vanishing.empty() || spoke == edge;
            (isBeside ? side.vanishing : side.changing).push_back(t);
            const int32_t end = mesh.to_vertex_handle(spoke).idx();
            if (spoke == edge || surface.isFeature(v0.idx(), end)) break;
        }
        if (side.vanishing.empty()) continue;  // beyond the border of the mesh
        if (side.changing.empty()) return false;
        if (count == 0) break;  // all around
    }
    return true;
}

std::array<int32_t, 3> Simplifier::cornersAfter(const Side& side, int32_t triangle,
                                                int32_t vertex) const {
    const Triangle& t = triangles[size_t(triangle)];
    std::array<int32_t, 3> corners = t.corner;
    corners[size_t(t.at(vertex))] = side.other;
    return corners;
}

Simplifier::Place Simplifier::nearest(const std::vector<std::array<glm::dvec3, 3>>& candidates,
                                      const glm::dvec3& p) const {
    Place place;
    for (size_t n = 0; n < candidates.size(); ++n) {
        const auto& t = candidates[n];
        const glm::dvec3 weights = nearestIn(t, p);
        const glm::dvec3 off = weights[0] * t[0] + weights[1] * t[1] + weights[2] * t[2] - p;
        const double distance2 = glm::dot(off, off);
        if (distance2 < place.distance2) place = {distance2, n, weights};
    }
    return place;
}

double Simplifier::changeOf(size_t value, int32_t corner, const std::array<int32_t, 3>& corners,
                            const Place& place) const {
    const auto at = [&](int32_t c) {
        return double(limits.values[size_t(c) * limits.tolerances.size() + value]);
    };
    return place.weights[0] * at(corners[0]) + place.weights[1] * at(corners[1]) +
           place.weights[2] * at(corners[2]) - at(corner);
}

// Returns the largest change at a corner of the source, relative to its limit.
float Simplifier::changeAt(int32_t corner, const std::array<int32_t, 3>& corners,
                           const Place& place) const {
    float most = float(std::sqrt(place.distance2)) / limits.distance;
    for (size_t k = 0; k < limits.tolerances.size(); ++k)
        most = std::max(
            most, float(std::abs(changeOf(k, corner, corners, place))) / limits.tolerances[k]);
    return most;
}

float Simplifier::changeOn(const Side& side, int32_t vertex, bool all) {
    after.clear();
    cornersThere.clear();
    double thinnest = 1;
    for (int32_t t : side.changing) {
        cornersThere.push_back(cornersAfter(side, t, vertex));
        after.push_back(surface.pointsOf(cornersThere.back()));
        const std::array<glm::dvec3, 3> before = surface.pointsOf(triangles[size_t(t)].corner);
        thinnest = std::min(thinnest, shapeOf(before));
        const glm::dvec3 was = glm::cross(before[1] - before[0], before[2] - before[0]),
                         is = glm::cross(after.back()[1] - after.back()[0],
                                         after.back()[2] - after.back()[0]);
        if (glm::dot(was, is) < kLeastTurn * glm::length(was) * glm::length(is)) return -1;
    }
    for (const auto& t : after)
        if (const double shape = shapeOf(t); shape <= 0 || shape < std::min(kThin, thinnest))
            return -1;
    float most = 0;
    auto test = [&](int32_t corner) {
        const Place place = nearest(after, surface.positionOf(corner));
        most = std::max(most, changeAt(corner, cornersThere[place.triangle], place));
        return most <= 1;
    };
    if (!test(side.corner)) return -1;
    if (!all) return most;
    for (const std::vector<int32_t>* these : {&side.changing, &side.vanishing})
        for (int32_t t : *these)
            for (int32_t corner : triangles[size_t(t)].removed)
                if (!test(corner)) return -1;
    return most;
}

// Returns whether the surface stays one: no two of its faces meet.
bool Simplifier::mayCollapse(HalfedgeHandle edge) const {
    if (!mesh.is_collapse_ok(edge)) return false;
    const HalfedgeHandle back = mesh.opposite_halfedge_handle(edge);
    if (mesh.is_boundary(edge) || mesh.is_boundary(back)) return true;
    const VertexHandle left = mesh.to_vertex_handle(mesh.next_halfedge_handle(edge)),
                       right = mesh.to_vertex_handle(mesh.next_halfedge_handle(back));
    return mesh.valence(left) > 3 || mesh.valence(right) > 3 ||
           !mesh.find_halfedge(left, right).is_valid();
}

float Simplifier::changeBy(HalfedgeHandle edge, bool all) {
    if (!findSides(edge)) return -1;
    float most = 0;
    for (const Side& side : sides) {
        if (side.changing.empty()) continue;
        const float change = changeOn(side, mesh.from_vertex_handle(edge).idx(), all);
        if (change < 0) return -1;
        most = std::max(most, change);
    }
    return mayCollapse(edge) ? most : -1;
}

// Queues the edges from a vertex along which it may be removed. Their order follows from what
// happens at this vertex. What happens at vertices that were removed before is tested later, for
// the few edges whose turn comes.
void Simplifier::queueEdgesFrom(VertexHandle vertex) {
    const uint32_t now = ++version[size_t(vertex.idx())];
    for (const auto edge : mesh.voh_range(vertex)) {
        const float change = changeBy(edge, false);
        if (change < 0) continue;
        const float length = float(mesh.calc_edge_length(edge)) / surface.extent;
        queue.push({change + kByLength * length, edge, now});
    }
}

void Simplifier::collapse(HalfedgeHandle edge) {
    const int32_t v0 = mesh.from_vertex_handle(edge).idx(), v1 = mesh.to_vertex_handle(edge).idx();
    findSides(edge);
    if (surface.featureCounts[size_t(v0)] > 0) {
        int32_t next = -1;
        for (const auto other : mesh.vv_range(VertexHandle(v0)))
            if (other.idx() != v1 && surface.isFeature(v0, other.idx())) next = other.idx();
        const int32_t beginsAt = surface.features[edgeKey(v0, next)];
        surface.features.erase(edgeKey(v0, next));
        surface.features.erase(edgeKey(v0, v1));
        surface.features[edgeKey(v1, next)] = beginsAt;
    }
    for (const Side& side : sides) {
        if (side.changing.empty()) continue;
        std::vector<int32_t> removed = {side.corner};
        for (const std::vector<int32_t>* these : {&side.changing, &side.vanishing})
            for (int32_t t : *these) {
                std::vector<int32_t>& own = triangles[size_t(t)].removed;
                removed.insert(removed.end(), own.begin(), own.end());
                own.clear();
            }
        after.clear();
        for (int32_t t : side.changing) {
            Triangle& triangle = triangles[size_t(t)];
            triangle.corner = cornersAfter(side, t, v0);
            triangle.vertex[size_t(triangle.at(v0))] = v1;
            triangle.isChanged = true;
            after.push_back(surface.pointsOf(triangle.corner));
        }
        for (int32_t t : side.vanishing) triangles[size_t(t)].isRemoved = true;
        for (int32_t corner : removed)
            triangles[size_t(side.changing[nearest(after, surface.positionOf(corner)).triangle])]
                .removed.push_back(corner);
    }
    mesh.collapse(edge);
    queueEdgesFrom(VertexHandle(v1));
    for (const auto other : mesh.vv_range(VertexHandle(v1))) queueEdgesFrom(other);
}

void Simplifier::run() {
    mesh.request_vertex_status();
    mesh.request_edge_status();
    mesh.request_halfedge_status();
    mesh.request_face_status();
    version.resize(mesh.n_vertices());
    for (const auto vertex : mesh.vertices()) queueEdgesFrom(vertex);
    while (!queue.empty()) {
        const Entry next = queue.top();
        queue.pop();
        // Entries of vertices that were removed, or around which anything has changed, are old.
        if (mesh.status(next.edge).deleted() ||
            next.version != version[size_t(mesh.from_vertex_handle(next.edge).idx())])
            continue;
        if (changeBy(next.edge, true) >= 0) collapse(next.edge);
    }
}

SimplifiedMesh Simplifier::result() const {
    SimplifiedMesh made;
    std::vector<std::vector<const Triangle*>> ofFace(source.faceCount());
    for (const Triangle& t : triangles) ofFace[size_t(t.face)].push_back(&t);
    std::vector<double> squares(limits.tolerances.size());
    size_t removed = 0;
    auto addFace = [&](int32_t face, const auto& corners, const auto& edges) {
        made.sourceCorners.insert(made.sourceCorners.end(), corners.begin(), corners.end());
        made.sourceEdges.insert(made.sourceEdges.end(), edges.begin(), edges.end());
        made.faceOffsets.push_back(int32_t(made.sourceCorners.size()));
        made.sourceFaces.push_back(face);
    };
    for (size_t f = 0; f < ofFace.size(); ++f) {
        const bool isWhole =
            std::none_of(ofFace[f].begin(), ofFace[f].end(),
                         [](const Triangle* t) { return t->isChanged || t->isRemoved; });
        if (isWhole) {
            std::vector<int32_t> corners(size_t(source.faceOffsets[f + 1] - source.faceOffsets[f]));
            std::iota(corners.begin(), corners.end(), source.faceOffsets[f]);
            addFace(int32_t(f), corners, corners);
            continue;
        }
        for (const Triangle* t : ofFace[f]) {
            if (t->isRemoved) continue;
            std::array<int32_t, 3> edges;
            for (size_t k = 0; k < 3; ++k) {
                const auto feature =
                    surface.features.find(edgeKey(t->vertex[k], t->vertex[(k + 1) % 3]));
                edges[k] = feature == surface.features.end() ? -1 : feature->second;
            }
            addFace(int32_t(f), t->corner, edges);
            for (int32_t corner : t->removed) {
                const Place place =
                    nearest({surface.pointsOf(t->corner)}, surface.positionOf(corner));
                ++removed;
                for (size_t k = 0; k < squares.size(); ++k)
                    squares[k] += std::pow(changeOf(k, corner, t->corner, place), 2);
            }
        }
    }
    std::vector<int32_t> kept;
    for (int32_t corner : made.sourceCorners) kept.push_back(source.cornerVertices[size_t(corner)]);
    std::sort(kept.begin(), kept.end());
    const size_t count = size_t(std::unique(kept.begin(), kept.end()) - kept.begin()) + removed;
    for (double sum : squares)
        made.changes.push_back(float(std::sqrt(sum / double(std::max<size_t>(1, count)))));
    return made;
}

}  // namespace

SimplifiedMesh simplify(const Mesh& source, const SimplificationLimits& limits) {
    // Its messages are of no use to the caller. Several threads may simplify at once.
    static const bool isQuiet = (omerr().disable(), true);
    static_cast<void>(isQuiet);
    Simplifier simplifier(source, limits);
    simplifier.run();
    return simplifier.result();
}

}  // namespace raybundle
