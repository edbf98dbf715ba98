// SPDX-License-Identifier: GPL-3.0-or-later
//
// The mesh of one instance while it is adapted to the light, and the error of its triangles: the
// difference between the light in a triangle and the linear function that is nearest to this light.
// It is measured at the tiles in the triangle, or where there are few, at points.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <tuple>
#include <vector>

#include "patches/refined_mesh.h"
#include "refinement/face_light.h"

namespace raybundle {

// The squared error of a triangle of one of several meshes, integrated over the triangle, relative
// to the mean square that is allowed in the scene, m^2.
struct TriangleError {
    double square;
    uint32_t mesh, triangle;

    // By decreasing error.
    bool operator<(const TriangleError& o) const {
        return std::tie(o.square, mesh, triangle) < std::tie(square, o.mesh, o.triangle);
    }
};

// A point at which the light of the sources is wanted.
struct LightQuery {
    uint32_t tile, point;
    std::optional<Receiver> receiver;  // empty: the light of the sources is not gathered there
};

class AdaptedMesh {
  public:
    // `meanSquare` is that of the light of the scene, summed over RGB, (W/m^2)^2. References must
    // outlive the object.
    AdaptedMesh(const KnownLight& known, uint32_t instance, const InstanceRange& range,
                double meanSquare);

    RefinedMesh& mesh() { return refined; }
    const RefinedMesh& mesh() const { return refined; }

    // Measures the error of new triangles, and returns those that want light at points.
    std::vector<uint32_t> measure();
    // Adds points to a triangle until it has enough of them, and a query for each.
    void addPoints(uint32_t triangle, std::vector<LightQuery>& queries);
    // Sets the light at the point of a query. `ofSources` is that of the sources, W/m^2, and
    // `variance` the variance of its brightest channel. Both count only if the query has a
    // receiver.
    void setLight(const LightQuery& query, const glm::vec3& ofSources, float variance);
    // Measures the error of a triangle from its points.
    void measureAtPoints(uint32_t triangle) { errors[triangle] = errorAtPoints(triangle); }

    // Appends the triangles that have an error; this mesh has the number `index`. Returns the sum
    // of their errors.
    double addErrors(uint32_t index, std::vector<TriangleError>& result) const;
    // Returns whether a sum of errors, that of all triangles, is more than an object may have.
    bool isTooMuch(double sum) const { return sum * ofScene > ofObject * light.exposedArea(); }
    // Returns whether a triangle may be divided: it is not far smaller than its tile.
    bool isDivisible(uint32_t triangle) const;

  private:
    void addTiles();
    // Sets the error of a triangle as its tiles show it. Returns whether points should show it.
    bool measureAtTiles(uint32_t index);
    double errorAtPoints(uint32_t index) const;
    // Returns the mean square difference of samples in a triangle from the linear function that is
    // nearest to them, without their noise, summed over RGB, (W/m^2)^2.
    double fitError(const RefinedMesh::Triangle& triangle,
                    const std::vector<uint32_t>& these) const;
    glm::dvec3 middle(const RefinedMesh::Triangle& triangle) const;
    double smallestShare(const RefinedMesh::Triangle& triangle, const glm::dvec3& place) const;

    const FaceLight light;
    RefinedMesh refined;
    // Mean square errors that are allowed: on average over the scene, and over this object. Summed
    // over RGB, (W/m^2)^2.
    double ofScene = 0, ofObject = 0;
    std::vector<FaceSample> samples;    // per point of `refined`; those of tiles come first
    std::vector<uint32_t> tileOfPoint;  // per point that stands for a tile
    std::vector<double> errors;         // per triangle: squared error, (W/m^2)^2 m^2
};

}  // namespace raybundle
