// SPDX-License-Identifier: GPL-3.0-or-later
//
// The irradiance without occluders from one side of a mesh of even emission, in closed form:
// Lambert's sum over the edges of all faces that are turned towards the receiver. An edge between
// two of these faces is traversed once in each direction and cancels. Only the outline of the mesh
// as seen from the receiver remains. For a bulb of hundreds of faces it has a few dozen edges.
//
// Sources: Lambert, "Photometria" (1760), for polygons; Appel, "The Notion of Quantitative
// Invisibility and the Machine Rendering of Solids" (1967), for the silhouette of a mesh as the
// edges between faces turned towards a point and faces turned away.
// Differs:
// - Connected faces of one plane form one facet, and edges in a line form one edge.
// - Faces that hide each other are both counted. Shadow rays find what is visible of them.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "patches/patches.h"
#include "patches/plane.h"

namespace raybundle {

// The outline of one side of a mesh. Empty if default-constructed.
class MeshOutline {
  public:
    MeshOutline() = default;
    // Uses the fronts of `parents` (indices into Patches::parents), or their backs if `ofBacks`.
    // `extent` is the radius of the object that they are part of, in metres; rounding errors of
    // vertices are proportional to it.
    MeshOutline(const Patches& patches, const std::vector<uint32_t>& parents, bool ofBacks,
                double extent);

    // Returns whether there is no closed form, because the mesh has so many facets or edges that
    // sampling it is faster.
    bool isEmpty() const { return edges.empty(); }
    // Returns the plane of the mesh, with its normal on the side of the light, or null if the mesh
    // is not planar.
    const Plane* plane() const { return facets.size() == 1 ? &facets.front() : nullptr; }

    // Returns the irradiance at a point with a unit normal from a mesh of radiance 1, in units of
    // that radiance (m^2 and sr cancel).
    double irradiance(const glm::dvec3& point, const glm::dvec3& normal) const;

    // Limits above which the sum takes longer than the samples that it saves.
    static constexpr size_t kMostFacets = 2048, kMostEdges = 3 * kMostFacets;

  private:
    struct Edge {
        glm::dvec3 from, to;
        // The facets whose outline contains the edge in the direction from `from` to `to`, and in
        // the opposite direction. facets.size() if there is none.
        uint32_t along, against;
    };
    // The facets as a receiver sees them.
    struct Facing;
    // Returns the term of an edge, and of the cuts that it makes, if the receiver's horizon cuts
    // the mesh.
    double clippedTerm(const Edge& edge, Facing& facing, const glm::dvec3& point,
                       const glm::dvec3& normal) const;

    glm::dvec3 centre{0.0};  // centre of a sphere around the mesh
    double radius = 0;       // metres
    std::vector<Plane> facets;
    std::vector<Edge> edges;
};

// Returns the irradiance at a point with a unit normal from a planar polygon of radiance 1, in
// units of that radiance (m^2 and sr cancel). Uses Lambert's formula after clipping at the horizon.
// The polygon's orientation does not matter. `count` is the number of corners.
double polygonIrradiance(const glm::dvec3& point, const glm::dvec3& normal,
                         const glm::dvec3* polygon, int count);

}  // namespace raybundle
