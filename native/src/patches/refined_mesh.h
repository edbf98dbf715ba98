// SPDX-License-Identifier: GPL-3.0-or-later
//
// A triangle mesh on the faces of another mesh that can be refined wherever this is wanted, stays
// without T-junctions, and keeps its angles above about 20 degrees.
//
// Sources: Rivara, "New Longest-Edge Algorithms for the Refinement and/or Improvement of
// Unstructured Triangulations" (1997): a triangle is bisected after the longer edges beyond its
// longest edge, so that the edge that is bisected is the longest of all triangles that have it.
// Rivara, Hitschfeld and Simpson, "Terminal-Edges Delaunay (Small-Angle Based) Algorithm for the
// Quality Triangulation Problem" (2001): between the bisections, edges are flipped until the
// triangulation is Delaunay's, and triangles with small angles are refined too.
// Differs:
// - The triangles lie on the faces of a mesh in space. Only edges within a face are flipped, so
//   that every edge of the source remains. An edge of the source may have any number of triangles,
//   and its bisection divides all of them.
// - Vertices of the source at the same position count as one place: edges that Blender has split
//   are bisected together, so that no gap opens between them.
// - A small angle remains where the source has one: between two edges of the source, and in faces
//   that are more than kThin times as long as wide, whose good triangles would be too many.
// - Faces in the same place as another are divided as it is, so that they can still be recognised
//   as its doubles. Their edges are not flipped.
// - Lines on faces, across which values jump, become edges: Chew, "Constrained Delaunay
//   Triangulations" (1989). Where such an edge would leave an angle too small, it is given up.
// - Faces that no bisection has reached keep their polygons.
// CGAL's Mesh_2, which refines one plane at a time, cannot be used: it divides the border of one
// plane without that of the next.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "patches/finer_mesh.h"
#include "scene/scene.h"

namespace raybundle {

// A mesh that is being refined. Indices of triangles stay valid; triangles that are divided or
// flipped are replaced by new ones.
class RefinedMesh {
  public:
    // A line on a face of the source, across which values jump.
    struct Line {
        int32_t face = 0;
        std::vector<glm::dvec3> points;  // in the world, m
        double accuracy = 0;  // points that are nearer to a vertex or to an edge lie on it, m
    };

    // Triangulates the faces of `source`, which must outlive the object. `toWorld` maps its
    // vertices to the space in which lengths and angles are measured and points are given, m.
    RefinedMesh(const Mesh& source, const glm::dmat4& toWorld);

    struct Triangle {
        // Per corner: the place, and the vertex of the result.
        std::array<uint32_t, 3> place, vertex;
        // Per edge, from corner k to the next: the corner of the source at which the source's edge
        // begins that contains it, or -1 if it lies within the source's face.
        std::array<int32_t, 3> sourceEdge;
        // Per edge: whether values jump across it, because a line lies on it.
        std::array<bool, 3> isAbrupt{};
        // Per edge: the next in the ring of all edges between the same two places, as 3 * triangle
        // + k. An edge that no other triangle has refers to itself.
        std::array<uint32_t, 3> ring;
        int32_t face;  // of the source
        bool isAlive = true;
        std::vector<uint32_t> points;  // those of addPoint() that lie in the triangle
    };
    // Returns whether an edge is one of the source's, or lies on a line. It is never flipped.
    static bool isFixed(const Triangle& triangle, size_t edge) {
        return triangle.sourceEdge[edge] >= 0 || triangle.isAbrupt[edge];
    }
    // All triangles that have ever existed.
    const std::vector<Triangle>& triangles() const { return all; }
    // Returns the position of a corner of a triangle in the world, m.
    const glm::dvec3& position(const Triangle& triangle, size_t corner) const {
        return places[triangle.place[corner]];
    }
    // Returns the area of a triangle in the world, m^2.
    double area(const Triangle& triangle) const;
    // Returns the length of the longest edge of a triangle in the world, m.
    double longestEdge(const Triangle& triangle) const;
    // Returns the smallest barycentric coordinate of a point (m, in the world) in a triangle.
    double smallestShare(const Triangle& triangle, const glm::dvec3& point) const;
    // Returns all edges between the places of an edge, from the edge on, as 3 * triangle + k.
    std::vector<uint32_t> ringOf(uint32_t edge) const;
    // Returns the number of vertices of the result.
    size_t vertexCount() const { return vertices.size(); }

    // Makes lines edges of the triangles, as long as the result has at most `mostVertices`
    // vertices. Faces in the same place as others get none.
    void addLines(const std::vector<Line>& lines, size_t mostVertices);

    // Adds a point in a triangle (m, in the world) and returns its index, which counts from 0. It
    // is handed on to the triangles that replace the triangle.
    uint32_t addPoint(uint32_t triangle, const glm::dvec3& point);
    // Returns the position of a point, m.
    const glm::dvec3& point(uint32_t index) const { return points[index]; }

    // Divides a triangle, and before it those beyond its longest edge whose own longest edge is
    // longer. Does nothing if the triangle is not alive, or as small as rounding errors. Stops
    // before the result has more than `mostVertices` vertices.
    void refine(uint32_t triangle, size_t mostVertices = SIZE_MAX);
    // Refines triangles with angles below 20 degrees in faces that bisections have reached, up to
    // `mostVertices` vertices.
    void improve(size_t mostVertices);

    // Returns the mesh as it is now.
    FinerMesh result() const;

  private:
    // The corners, or edges, of a triangle that follow and precede number k.
    static size_t next(size_t k) { return k == 2 ? 0 : k + 1; }
    static size_t last(size_t k) { return k == 0 ? 2 : k - 1; }

    struct Vertex {
        glm::dvec3 position;  // in the source's space
        uint32_t place;
    };

    // Returns the corners of a face from its smallest place on, towards the smaller of the two
    // places beside it, so that faces in the same place have the same places in this order.
    std::vector<int32_t> cornersInOrder(int32_t face) const;
    uint32_t placeOf(int32_t corner) const {
        return vertices[size_t(source.cornerVertices[size_t(corner)])].place;
    }
    void findDoubles();
    void addFaces();
    void linkRings();
    void noteThinFaces();
    // Notes the shortest edges of the faces, of the triangles from `firstTriangle` on.
    void noteShortestEdges(size_t firstTriangle);
    glm::dvec3 areaVector(const Triangle& triangle) const;
    // Returns the barycentric coordinates of a point.
    glm::dvec3 sharesAt(const Triangle& triangle, const glm::dvec3& point) const;
    double edgeLength2(const Triangle& triangle, size_t edge) const;
    // Returns the longest edge of a triangle, 0 to 2. Among equal edges it is the same one for all
    // triangles that have them.
    size_t longest(const Triangle& triangle) const;
    struct Angle {
        double cosine;
        size_t corner;  // of the triangle, 0 to 2
    };
    Angle smallestAngle(const Triangle& triangle) const;
    bool isPoor(const Triangle& triangle) const;
    // Returns whether an edge of a triangle is shorter than a share of the shortest that its face
    // has without improvements.
    bool isTooShort(const Triangle& triangle, double share) const;
    uint32_t add(const Triangle& triangle);
    void replaceInRing(uint32_t old, uint32_t now);
    void link(const std::vector<uint32_t>& edges);
    // Divides the triangles of a ring at a share of its first edge, from that edge's corner on.
    void bisect(const std::vector<uint32_t>& ring, double share = 0.5);
    // Divides a triangle at a point inside it, given by its barycentric coordinates.
    void divide(uint32_t triangle, const glm::dvec3& shares);
    class FaceTriangles;
    // Returns the place at a point of a line, which is made if there is none. Empty if the point is
    // not on the face.
    std::optional<uint32_t> placeAt(const Line& line, const glm::dvec3& point,
                                    FaceTriangles& triangles, size_t mostVertices);
    // Makes edges of the straight line between two places, as far as this is possible.
    void connect(const Line& line, uint32_t from, uint32_t to, FaceTriangles& triangles,
                 size_t mostVertices);
    // Lets edges of lines be flipped that form a small angle of the triangle with a fixed edge, or
    // beside which the triangle has become too short. Returns whether there was one.
    bool giveUpLine(uint32_t triangle);
    // Flips edges until those on the stack and all that their flips change are Delaunay's.
    void flipAll(std::vector<uint32_t> stack);
    bool flipIfBetter(uint32_t edge, std::vector<uint32_t>& stack);
    void locate(int32_t face, const glm::dvec3& position, std::array<int32_t, 3>& corners,
                std::array<float, 3>& weights) const;

    const Mesh& source;
    std::vector<Triangle> all;
    std::vector<glm::dvec3> places, points;  // m
    std::vector<Vertex> vertices;
    // Per face of the source, the first face in the same place.
    std::vector<int32_t> doubleOf;
    std::vector<uint8_t> hasDoubles;  // per face of the source
    // Per face of the source, and one more at the end: the first triangle of its triangulation.
    std::vector<uint32_t> firstOfFace;
    std::vector<std::array<int32_t, 3>> sourceTriangles;  // corners of the source, face by face
    std::vector<uint8_t> isTouched, isThin;               // per face of the source
    std::vector<double> shortest;  // per face: shortest edge without improvements, m
    double leastEdge = 0;          // no edge shorter than this is bisected, m
    size_t improvedFrom = 0;       // number of triangles when improve() ended last
    std::vector<uint32_t> made;    // triangles made since the last improve()
};

}  // namespace raybundle
