// SPDX-License-Identifier: GPL-3.0-or-later
//
// A tree over the emitting faces of a mesh, by which a receiver chooses one about in proportion to
// the light that it gets from it: whatever their order is in the mesh, and without looking at all.
//
// Source: Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree
// Splitting" (2018): the bounds of a cluster's light by its sphere and by the cone of its normals.
// Differs:
// - One sample goes to one face: clusters are not split for a receiver.
// - Cosines are bounded by heights over the box of a cluster, too: right beside a surface of many
//   faces the spheres of large clusters say nothing of which of them hold the nearest ones, whose
//   light is nearly all there is.
// - Of a flat cluster far enough before the receiver a face is chosen by its power alone: its
//   bounds would hardly say more, and take most of the time.
// - Clusters are halved at the middle of their longer side instead of where the surface area
//   orientation heuristic has its least: the faces of one mesh are of a kind.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

// One side of a face that emits.
struct LightFace {
    glm::vec3 origin, a, b;  // as in Parent
    glm::vec3 normal;        // of the side that emits
    bool isTriangle;
    float strength;  // emission, sum of the channels, W/m^2; above 0
    uint32_t side;   // patch side; where the emission is even on its parent, of its first patch

    glm::vec3 middle() const { return origin + (isTriangle ? 1 / 3.0f : 0.5f) * (a + b); }
    float area() const { return glm::length(glm::cross(a, b)) * (isTriangle ? 0.5f : 1.0f); }
};

class LightTree {
  public:
    LightTree() = default;
    // Brings the faces into its own order.
    explicit LightTree(std::vector<LightFace>& faces);

    // A cluster of faces. Those within it follow it: first its first half, then its second.
    struct Node {
        glm::vec3 centre;       // of a box around it, metres
        glm::vec3 half;         // half the size of that, along the axes of the tree, metres
        float radius;           // of the sphere around the box, metres
        glm::vec3 axis;         // of the cone of normals
        float depth;            // half the size of the box along that, metres
        float cosine, sine;     // of half its opening
        float power;            // sum of the channels, W
        uint32_t first, count;  // of the faces; a leaf has one
        uint32_t second;        // the second child; the first one follows
    };
    // The whole first; empty without faces. A cluster of n faces has 2 n - 1, itself included.
    const std::vector<Node>& clusters() const { return nodes; }

    struct Choice {
        uint32_t face;  // into the faces
        float weight;   // one over its probability; 0: none gives anything
        float u;        // what is left of the random number, uniform in [0, 1)
    };
    // By the power alone; u uniform in [0, 1). There must be a face.
    Choice chooseByPower(double u) const;
    // By the bounds of what a plane with that normal at a point gets from each cluster; u uniform
    // in [0, 1).
    Choice choose(const glm::vec3& point, const glm::vec3& normal, float u) const {
        return nodes.size() == 1 ? Choice{0, 1, u} : chooseOfMany(point, normal, u);
    }

  private:
    Choice chooseOfMany(const glm::vec3& point, const glm::vec3& normal, float u) const;

    uint32_t build(std::vector<LightFace>& faces, uint32_t first, uint32_t count);
    // boxNormal: along the axes.
    float importance(const Node& node, const glm::vec3& point, const glm::vec3& normal,
                     const glm::vec3& boxNormal) const;

    // Whether its faces give the plane about what their powers say.
    static bool isEven(const Node& node, const glm::vec3& point, const glm::vec3& normal);
    // Of a cluster, itself chosen with that weight.
    Choice byPower(const Node& node, double u, double weight) const;
    // The face in which the power of all before comes to `at`, W; all: of those it was chosen
    // among.
    Choice chosen(uint32_t face, double at, double all) const;

    glm::mat3 axes{1.0f};             // rows: of all boxes, those of the largest face
    std::vector<double> powerBefore;  // per face, and of all: sum of the channels, W
    std::vector<double> perPower;     // per face: one over its own, 1/W
    // Of as many equal shares of the power as there are faces: the face that each starts in.
    std::vector<uint32_t> faceAt;
    double sharesPerPower = 0;  // 1/W
    std::vector<Node> nodes;
};

}  // namespace raybundle
