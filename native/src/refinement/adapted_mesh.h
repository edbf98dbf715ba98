// SPDX-License-Identifier: GPL-3.0-or-later
//
// The mesh of one instance while it is adapted to the light, and the error of its triangles: the
// difference between the light in a triangle and the linear function that is nearest to this light.
// It is measured at the tiles in the triangle, or where there are few, at points.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <tuple>
#include <unordered_map>
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

// A line on a face across which the light of the sources jumps.
struct DiscontinuityLine : RefinedMesh::Line {
    double jump = 0;   // largest difference across it, W/m^2
    double width = 0;  // mean width over which the light changes, m

    double length() const;
    // Returns the squared error that remains if the light changes in a line without a width,
    // integrated over the face, (W/m^2)^2 m^2.
    double square() const { return jump * jump * width / 12 * length(); }
};

class AdaptedMesh {
  public:
    // `meanSquare` is that of the light of the scene, summed over RGB, (W/m^2)^2. The light jumps
    // across `lines`, which become edges while the mesh has at most `mostVertices` vertices.
    // References must outlive the object.
    AdaptedMesh(const KnownLight& known, uint32_t instance, const InstanceRange& range,
                double meanSquare, const std::vector<DiscontinuityLine>& lines = {},
                size_t mostVertices = SIZE_MAX);

    const FaceLight& faceLight() const { return light; }
    // Returns the mean square error that is allowed on average over the scene, summed over RGB,
    // (W/m^2)^2.
    double allowedSquare() const { return ofScene; }
    // Returns the measured mean square error of a triangle, summed over RGB, (W/m^2)^2.
    double meanSquareError(uint32_t triangle) const;
    RefinedMesh& mesh() { return refined; }
    const RefinedMesh& mesh() const { return refined; }

    // Adds a query for each tile that a line passes through or close to. The light at its centroid
    // stands for that of the tile.
    void addMixedTiles(std::vector<LightQuery>& queries) const;
    // Measures the error of new triangles, and returns those that want light at points.
    std::vector<uint32_t> measure();
    // Adds points to a triangle until it has enough of them, and a query for each.
    void addPoints(uint32_t triangle, std::vector<LightQuery>& queries);
    // Sets the light at the point of a query. `ofSources` is that of the sources, W/m^2, and
    // `variance` the variance of its brightest channel. Both count only if the query has a
    // receiver.
    void setLight(const LightQuery& query, const glm::vec3& ofSources, float variance);
    // Measures the error of a triangle from its points.
    void measureAtPoints(uint32_t triangle);

    // Appends the triangles that have an error; this mesh has the number `index`. Returns the sum
    // of their errors.
    double addErrors(uint32_t index, std::vector<TriangleError>& result) const;
    // Returns the squared error that this object may have if it has all that of a scene with an
    // exposed area, integrated over its surface, (W/m^2)^2 m^2.
    double allowedSum(double areaOfScene) const {
        return std::min(ofScene * areaOfScene, ofObject * light.exposedArea());
    }
    // Returns whether a sum of errors, that of all triangles, is more than an object may have.
    bool isTooMuch(double sum) const { return sum * ofScene > ofObject * light.exposedArea(); }
    // Returns whether a triangle may be divided: it is not far smaller than its tile.
    bool isDivisible(uint32_t triangle) const;

  private:
    void noteLines(const std::vector<DiscontinuityLine>& lines);
    void addTiles();
    bool isBesideLine(const RefinedMesh::Triangle& triangle, const glm::dvec3& point) const;
    // Sets the error of a triangle as its tiles show it. Returns whether points should show it.
    bool measureAtTiles(uint32_t index);
    // Returns for each triangle the number of its corners at which a line ends.
    std::vector<uint8_t> lineEnds() const;
    // The linear function that is nearest to samples in a triangle.
    struct Fit {
        double meanSquare = 0;  // difference of the samples, without noise, (W/m^2)^2
        bool isKnown = false;
        std::array<glm::vec3, 3> corner{};  // W/m^2
        double variance = 0;                // at corners by the noise of the samples, (W/m^2)^2
    };
    // Squares are sums over RGB.
    Fit fit(const RefinedMesh::Triangle& triangle, const std::vector<uint32_t>& these) const;
    // Returns for each triangle the squared difference between its own linear function and the one
    // that it shows, because it shares its corners with others, integrated over it.
    std::vector<double> unevenness() const;
    glm::dvec3 middle(const RefinedMesh::Triangle& triangle) const;

    const FaceLight light;
    RefinedMesh refined;
    // Of the lines of a face: the largest distance from one within which it does not show the
    // light, m, and the largest jump of the light, W/m^2.
    struct FaceLines {
        double reach = 0, jump = 0;
    };
    std::unordered_map<int32_t, FaceLines> linesOf;  // per face with lines
    std::vector<uint8_t> isMixed;  // per tile: whether a line passes through it or close to it
    // Mean square errors that are allowed: on average over the scene, and over this object. Summed
    // over RGB, (W/m^2)^2.
    double ofScene = 0, ofObject = 0;
    std::vector<FaceSample> samples;    // per point of `refined`; those of tiles come first
    std::vector<uint32_t> tileOfPoint;  // per point that stands for a tile
    std::vector<Fit> fits;              // per triangle
    std::vector<double> errors;         // per triangle: squared error, (W/m^2)^2 m^2
};

}  // namespace raybundle
