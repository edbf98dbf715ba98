// SPDX-License-Identifier: GPL-3.0-or-later
//
// Small scenes and closed forms that several tests use.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "bundles/line_counts.h"
#include "bundles/projector.h"
#include "patches/patches.h"
#include "scene/scene.h"

namespace raybundle::test {

constexpr double kPi = 3.14159265358979323846;
constexpr size_t kMany = 10000000;  // a limit of patches that no test reaches
// Tolerance in stated standard errors. An unbiased value exceeds it by chance once in 16000 checks.
constexpr double kSigmas = 4;
// Coordinates of points inside a patch, away from its edges, where rounding decides which patch is
// hit.
constexpr glm::vec2 kInside[] = {
    {0.33f, 0.33f}, {0.1f, 0.1f}, {0.8f, 0.1f}, {0.1f, 0.8f}, {0.8f, 0.8f}};

// Makes a mesh of polygons. In all meshes here the faces are wound counter-clockwise seen from
// their front.
Mesh polygons(const std::string& name, std::vector<glm::vec3> vertices,
              const std::vector<std::vector<int32_t>>& faces);
// Makes na x nb parallelograms with common vertices over origin + [0, 1] a + [0, 1] b.
Mesh grid(const std::string& name, const glm::vec3& origin, const glm::vec3& a, const glm::vec3& b,
          int na, int nb);
inline Mesh rectangle(const std::string& name, const glm::vec3& origin, const glm::vec3& a,
                      const glm::vec3& b) {
    return grid(name, origin, a, b, 1, 1);
}
// Makes a box of six quads whose fronts are inside or outside.
Mesh box(const std::string& name, const glm::vec3& low, const glm::vec3& high, bool inward);
// Makes a floor of n x n squares of 1 m, starting at the origin. Every other column is cut in half,
// and the T-junctions are filled with slivers of the given height. The quads come first.
Mesh floorWithSlivers(int n, float height);
// Makes a sphere around the origin: an icosahedron whose faces are divided into four `levels`
// times.
Mesh icosphere(const std::string& name, float radius, int levels, bool inward);

// Makes a grey material. `emission` is that of the front side, W/m^2.
Material grey(const std::string& name, float reflectance, float emission = 0,
              float backEmission = 0);

// Adds the mesh with one material on all its faces, and an instance of it. Returns the instance's
// id.
int32_t place(Scene& scene, Mesh mesh, const Material& material,
              const glm::dmat4& transform = glm::dmat4(1), rb_role role = RB_ROLE_BAKE,
              rb_side side = RB_SIDE_FRONT);

// Makes a closed unit cube with its fronts inside.
Scene closedCube(float reflectance, float emission = 0);
// Makes a closed room of 4 x 3.2 x 2.8 m with two boxes in it, one of them rotated, both `gap`
// above the floor.
Scene roomWithBoxes(float reflectance, float emission = 0, float gap = 0.1f);

Light pointLight(const glm::dvec3& position, const glm::dvec3& intensity);
Light areaLight(const glm::dvec3& centre, const glm::dvec3& axisU, const glm::dvec3& axisV,
                const glm::dvec3& radiance, rb_area_shape shape = RB_AREA_RECTANGLE);
Light sunLight(const glm::dvec3& direction, const glm::dvec3& irradiance, double angle = 0);

// Traces the first `count` bundles of a sequence through the patches and returns the line counts.
LineCounts traceLines(const Patches& patches, float pixelSize, uint32_t count, uint32_t seed = 1,
                      DirectionKind directions = DirectionKind::LOW_DISCREPANCY);

// Returns the number of lines in all exchanges of a bundle.
uint64_t exchangedLines(const BundleLines& lines);

// Returns, per side, whether its light is shown: all sides are shown but those of one instance.
std::vector<bool> shownBut(const Patches& patches, uint32_t instance);

// Returns m_i of both halves together: the number of lines that leave side i.
double linesOf(const LineCounts& counts, uint32_t side);
// Returns c_ij of both halves together: the number of lines that join sides i and j.
double linesBetween(const LineCounts& counts, uint32_t i, uint32_t j);
// Returns the form factor from all fronts of an instance to all fronts of another, from the counts.
double formFactor(const Patches& patches, const LineCounts& counts, uint32_t from, uint32_t to);

// Closed forms of form factors (Howell, A Catalog of Radiation Heat Transfer Configuration
// Factors).
// Aligned parallel rectangles a x b at distance c.
double parallelRectangles(double a, double b, double c);
// Perpendicular rectangles with a common edge of length l; w is the width of the first rectangle, h
// that of the second.
double perpendicularRectangles(double w, double h, double l);
// Parallel rectangles [x0, x1] x [y0, y1] and [u0, u1] x [v0, v1] at distance z.
double offsetRectangles(const double (&x)[2], const double (&y)[2], const double (&u)[2],
                        const double (&v)[2], double z);
// Coaxial disks of radii r1 and r2 at distance h.
double coaxialDisks(double r1, double r2, double h);

}  // namespace raybundle::test
