// SPDX-License-Identifier: GPL-3.0-or-later
//
// The irradiance that one side of a mesh of even emission gives without occluders, in closed form:
// Lambert's sum over the edges of each face that looks at the receiver. The edge between two such
// faces is passed once each way and cancels, so that only the outline of the mesh as it is seen
// from the receiver is left: of a bulb of hundreds of faces some dozens of edges.
//
// Sources: Lambert, "Photometria" (1760), for polygons; the silhouette of a mesh as the edges
// between faces that look at a point and faces that do not: Appel, "The Notion of Quantitative
// Invisibility and the Machine Rendering of Solids" (1967).
// Differs:
// - Faces of one plane that hang together are one facet, and edges in a line are one edge.
// - Faces that hide each other both count: what is seen of them is what shadow rays tell.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "patches/patches.h"
#include "patches/plane.h"

namespace raybundle {

class MeshOutline {
  public:
    MeshOutline() = default;
    // Of the fronts of parents (into Patches::parents) or of their backs. extent: radius of what
    // they are part of, metres: vertices are off by rounding in proportion to it.
    MeshOutline(const Patches& patches, const std::vector<uint32_t>& parents, bool ofBacks,
                double extent);

    // Whether there is no closed form: more facets or edges than sampling the mesh costs.
    bool isEmpty() const { return edges.empty(); }
    // The plane in which all of it lies, if it does, with its normal where the light goes; or null.
    const Plane* plane() const { return facets.size() == 1 ? &facets.front() : nullptr; }

    // Irradiance at a point with a unit normal from a radiance of 1. m^2 and sr cancel.
    double irradiance(const glm::dvec3& point, const glm::dvec3& normal) const;

    // Of more the sum takes longer than the samples that it saves.
    static constexpr size_t kMostFacets = 2048, kMostEdges = 3 * kMostFacets;

  private:
    struct Edge {
        glm::dvec3 from, to;
        // The facets for whose outline it runs that way and the other way; facets.size(): none.
        uint32_t along, against;
    };
    struct Facing;
    double clippedTerm(const Edge& edge, Facing& facing, const glm::dvec3& point,
                       const glm::dvec3& normal) const;

    glm::dvec3 centre{0.0};  // of a sphere around them
    double radius = 0;       // metres
    std::vector<Plane> facets;
    std::vector<Edge> edges;
};

// Irradiance at a point with a unit normal from a planar polygon of radiance 1 around it, by
// Lambert's formula after clipping at the horizon; the polygon's side does not matter. m^2 and sr
// cancel.
double polygonIrradiance(const glm::dvec3& point, const glm::dvec3& normal,
                         const glm::dvec3* polygon, int count);

}  // namespace raybundle
