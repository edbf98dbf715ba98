// SPDX-License-Identifier: GPL-3.0-or-later
//
// The irradiance that a mesh of even emission gives without occluders, in closed form: Lambert's
// sum over the edges of each face that looks at the receiver. The edge between two such faces is
// passed once each way and cancels, so that only the outline of the mesh as it is seen from the
// receiver is left: of a bulb of hundreds of faces some dozens of edges.
//
// Sources: Lambert, "Photometria" (1760), for polygons; the silhouette of a mesh as the edges
// between faces that look at a point and faces that do not: Appel, "The Notion of Quantitative
// Invisibility and the Machine Rendering of Solids" (1967).
// Differs:
// - Faces of one plane that hang together are one facet, and edges in a line are one edge.
// - Fronts and backs are summed apart, for their emission differs.
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
    // parents: into Patches::parents. extent: radius of a sphere around them, metres.
    MeshOutline(const Patches& patches, const std::vector<uint32_t>& parents, double extent);

    // Whether there is no closed form: more facets or edges than sampling the mesh costs.
    bool isEmpty() const { return edges.empty(); }
    // Whether all of it lies in one plane, with one front.
    bool isPlanar() const { return facets.size() == 1; }
    const Plane& plane(size_t facet) const { return facets[facet]; }

    // Irradiance at a point with a unit normal from a radiance of 1 of all fronts (x) and of all
    // backs (y). m^2 and sr cancel.
    glm::dvec2 irradiance(const glm::dvec3& point, const glm::dvec3& normal) const;

    // Of more the sum takes longer than the samples that it saves.
    static constexpr size_t kMostFacets = 2048, kMostEdges = 3 * kMostFacets;

  private:
    struct Edge {
        glm::dvec3 from, to;
        // The facets for whose outline it runs that way and the other way; facets.size(): none.
        uint32_t along, against;
    };
    struct Facing;
    void addClipped(const Edge& edge, const Facing& facing, const glm::dvec3& point,
                    const glm::dvec3& normal, glm::dvec2& sum) const;

    glm::dvec3 centre{0.0};
    double extent = 0;
    std::vector<Plane> facets;
    std::vector<Edge> edges;
};

// Irradiance at a point with a unit normal from a planar polygon of radiance 1 around it, by
// Lambert's formula after clipping at the horizon; the polygon's side does not matter. m^2 and sr
// cancel.
double polygonIrradiance(const glm::dvec3& point, const glm::dvec3& normal,
                         const glm::dvec3* polygon, int count);

}  // namespace raybundle
