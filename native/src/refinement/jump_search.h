// SPDX-License-Identifier: GPL-3.0-or-later
//
// Where the light of the sources jumps on the edges of triangles, found by halving the edges.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "patches/refined_mesh.h"
#include "refinement/adapted_mesh.h"
#include "refinement/source_light.h"

namespace raybundle {

// An edge of triangles, and where the light jumps on it.
class JumpEdge {
  public:
    JumpEdge(const RefinedMesh& mesh, uint32_t id);

    const uint32_t id;          // 3 * triangle + k, of one triangle that has the edge
    const bool isOfSource;      // or within a face
    const glm::dvec3 from, to;  // ends, m
    bool jumps = false;
    double width = 0;  // share of the edge within which most of the jump lies; 0 if it is hard

    double length() const { return glm::distance(from, to); }  // m
    // Returns the difference of the light between the ends, W/m^2.
    double difference() const { return double(glm::distance(atFrom, atTo)); }
    // Returns the share of the edge at which the light jumps, and that which other surfaces cover
    // there.
    double share() const {
        return covered ? 0.5 * ((*covered)[0] + (*covered)[1]) : 0.5 * (low + high);
    }
    double coveredWidth() const { return covered ? (*covered)[1] - (*covered)[0] : 0; }
    // Returns the point at which the light jumps, m.
    glm::dvec3 crossing() const { return at(share()); }

  private:
    friend class JumpSearch;
    // The light at a place, W/m^2; empty where it is not gathered, as on a covered surface.
    using Light = std::optional<glm::vec3>;

    glm::dvec3 at(double share) const { return (1 - share) * from + share * to; }
    // Returns the share at which the jump is searched next, on one of the two sides of what covers
    // the edge.
    double next(size_t side) const {
        return covered ? 0.5 * ((*covered)[side] + (side == 0 ? low : high)) : share();
    }
    // Takes the light at next(side).
    void take(size_t side, const Light& light);
    // Returns whether a half of the edge may hold most of the jump, by the light at its quarters.
    bool mayBeHard(const std::array<Light, 3>& quarters) const;

    const glm::dvec3 third;              // corner of the triangle beside the edge, m
    glm::vec3 atFrom{0.0f}, atTo{0.0f};  // light close to the ends, W/m^2
    double low, high;                    // the light jumps between these shares of the edge
    // The shares between which other surfaces cover the edge, if the light jumps there.
    std::optional<std::array<double, 2>> covered{};
};

class JumpSearch {
  public:
    // Jumps of less than `leastJump` (W/m^2) do not count. References must outlive the object.
    JumpSearch(const RefinedMesh& mesh, SourceSampler& light, double leastJump)
        : mesh(mesh), light(light), leastJump(leastJump), isTaken(mesh.triangles().size(), 0) {}

    // Searches the edges of triangles, and from where the light jumps on to those beside them.
    void search(std::vector<uint32_t> triangles);

    // Returns whether the edges of a triangle were searched.
    bool isSearched(uint32_t triangle) const { return isTaken[triangle]; }
    // Returns the index of edge `k` of a triangle that was searched.
    uint32_t indexOf(uint32_t triangle, uint32_t k) { return find(triangle, k).first; }
    const JumpEdge& edge(uint32_t index) const { return edges[index]; }

  private:
    using Light = JumpEdge::Light;

    // Returns the index of edge `k` of a triangle, and whether it is new.
    std::pair<uint32_t, bool> find(uint32_t triangle, uint32_t k);
    // Searches the edges of triangles. Returns those edges on which the light jumps.
    std::vector<uint32_t> jumping(const std::vector<uint32_t>& triangles);
    // Measures how widely the jumps of edges are spread. Those whose jump is soft have none.
    void measureWidths(const std::vector<uint32_t>& these);
    // Returns the light at shares of edges. A share that is not a number has none.
    std::vector<Light> lightAt(const std::vector<uint32_t>& these,
                               const std::vector<double>& shares);
    // Removes the edges that have no jump.
    void keepJumps(std::vector<uint32_t>& these) const;

    const RefinedMesh& mesh;
    SourceSampler& light;
    const double leastJump;
    std::vector<uint8_t> isTaken;  // per triangle: whether its edges are searched
    std::vector<JumpEdge> edges;
    std::map<uint32_t, uint32_t> indices;  // of edges, by the first edge in the ring
};

}  // namespace raybundle
