// SPDX-License-Identifier: GPL-3.0-or-later
//
// A tree over the emitting faces of a mesh. A receiver uses it to choose a face about in proportion
// to the light that it gets from the face, without visiting all faces, and whatever their order in
// the mesh is.
//
// Source: Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree
// Splitting" (2018): the light of a cluster is bounded by its sphere and by the cone of its
// normals.
// Differs:
// - One sample chooses one face. Clusters are not split for a receiver.
// - Cosines are also bounded by heights over the box of a cluster. Right beside a surface of many
//   faces, the spheres of large clusters do not show which of them hold the nearest faces, from
//   which nearly all of the light comes.
// - In a flat cluster that is far enough in front of the receiver, a face is chosen by its power
//   alone. Its bounds would hardly improve the choice, and would take most of the time.
// - Clusters are halved by number of faces along their longest extent, not at the minimum of the
//   surface area orientation heuristic, since the faces of one mesh are similar.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace raybundle {

// One emitting side of a face. Positions and lengths are in metres, relative to Patches::centre.
struct LightFace {
    glm::vec3 origin, a, b;  // as in Parent: a corner and the two edges from it
    glm::vec3 normal;        // unit normal of the emitting side
    bool isTriangle;
    float strength;  // exitance, sum of the channels, W/m^2; above 0
    // Patch side. If the emission is even on the parent, the side of the parent's first patch.
    uint32_t side;

    glm::vec3 middle() const { return origin + (isTriangle ? 1 / 3.0f : 0.5f) * (a + b); }
    float area() const { return glm::length(glm::cross(a, b)) * (isTriangle ? 0.5f : 1.0f); }
};

// A binary tree over emitting faces, for importance sampling.
class LightTree {
  public:
    LightTree() = default;
    // Builds the tree and sorts `faces` into the order of the tree. Face indices below refer to
    // this order.
    explicit LightTree(std::vector<LightFace>& faces);

    // A cluster of faces. The clusters within it follow it in the array: first all of its first
    // child, then all of its second child.
    struct Node {
        glm::vec3 centre;       // centre of the bounding box, metres
        glm::vec3 half;         // half the size of the box along the axes of the tree, metres
        float radius;           // radius of the sphere around the box, metres
        glm::vec3 axis;         // axis of the cone of normals, unit
        float depth;            // half the size of the box along `axis`, metres
        float cosine, sine;     // of half the cone's opening
        float power;            // sum of the channels, W
        uint32_t first, count;  // range of faces; a leaf has one
        uint32_t second;        // index of the second child; the first child is the next node
    };
    // Returns all clusters, the root first. Empty without faces. The subtree of a cluster of n
    // faces consists of 2 n - 1 clusters, itself included.
    const std::vector<Node>& clusters() const { return nodes; }

    // A face that a sample has chosen.
    struct Choice {
        uint32_t face;  // index of the face
        float weight;   // reciprocal of the probability; 0: no face gives light
        float u;        // rest of the random number, uniform in [0, 1)
    };
    // Chooses a face by its power alone. `u` is uniform in [0, 1). The tree must not be empty.
    Choice chooseByPower(double u) const;
    // Chooses a face by bounds of the irradiance from each cluster at a point with a unit normal.
    // `u` is uniform in [0, 1).
    Choice choose(const glm::vec3& point, const glm::vec3& normal, float u) const {
        return nodes.size() == 1 ? Choice{0, 1, u} : chooseOfMany(point, normal, u);
    }

  private:
    Choice chooseOfMany(const glm::vec3& point, const glm::vec3& normal, float u) const;

    uint32_t build(std::vector<LightFace>& faces, uint32_t first, uint32_t count);
    // Returns the weight of a cluster. `boxNormal` is the receiver's normal along the axes of the
    // tree.
    float importance(const Node& node, const glm::vec3& point, const glm::vec3& normal,
                     const glm::vec3& boxNormal) const;

    // Returns whether the faces of a cluster light the receiver about in proportion to their
    // powers.
    static bool isEven(const Node& node, const glm::vec3& point, const glm::vec3& normal);
    // Chooses a face of a cluster by its power. The cluster itself was chosen with `weight`.
    Choice byPower(const Node& node, double u, double weight) const;
    // Returns the choice of `face`. `at` is the random position in the cumulative power, W, and
    // `all` the power of the faces that the choice was among, W.
    Choice chosen(uint32_t face, double at, double all) const;

    glm::mat3 axes{1.0f};  // rows: the axes of all boxes, taken from the largest face
    // Cumulative power before each face, and of all faces, sum of the channels, W.
    std::vector<double> powerBefore;
    std::vector<double> perPower;  // per face: reciprocal of its power, 1/W
    // The total power is divided into as many equal shares as there are faces. This is the face in
    // which each share begins.
    std::vector<uint32_t> faceAt;
    double sharesPerPower = 0;  // number of shares over the total power, 1/W
    std::vector<Node> nodes;
};

}  // namespace raybundle
