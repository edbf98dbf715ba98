// SPDX-License-Identifier: GPL-3.0-or-later
//
// Patches: the finest units of transport. A face of the user's mesh is cut into parents (triangles
// and parallelograms), and a parent into equal patches by a regular grid in its affine coordinates:
//
//   point = origin + s * a + t * b
//   parallelogram: s, t in [0, 1];  triangle: s, t >= 0, s + t <= 1
//
// The patch at a point of a parent follows from the coordinates without a search, and the cost of
// projecting the parents does not depend on the size of the patches. An element of the regular grid
// is a tile. Where the light requires it, a tile is cut once more, into 4^level patches of a
// regular grid of its own (refinement/refinement.h); otherwise the tile is one patch.
//
// Differs from the thesis (section 4.2), which projects each patch by itself.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "patches/doubled_faces.h"
#include "patches/sheets.h"
#include "patches/side.h"
#include "scene/scene.h"

namespace raybundle {

// Stands for no parent where an index of a parent is expected.
constexpr uint32_t kNoParent = UINT32_MAX;

// How the tiles of a parent are cut, if any of them is cut into smaller patches.
struct CutTiles {
    std::vector<uint8_t> level;  // per tile, which has 4^level patches
    // Per tile, its first patch, counted within the parent; one more entry at the end.
    std::vector<uint32_t> first;
};

// A triangle or parallelogram that is projected as a unit and carries a regular grid of tiles. Its
// front is the side to which cross(a, b) points.
struct Parent {
    glm::vec3 origin, a, b;  // metres, relative to Patches::centre
    glm::vec3 normal;        // of the front, unit, along cross(a, b)
    // Indices in Patches::vertices, in order around the parent. A triangle does not use the last
    // one.
    std::array<uint32_t, 4> vertex;
    // Index of the first patch over all parents.
    uint32_t firstPatch = 0;
    // Index of the first tile over all parents: the index of its patch if no tile is cut.
    uint32_t firstTile = 0;
    uint16_t countA = 1, countB = 1;  // tiles along a and b; equal for triangles
    bool isTriangle = true;
    bool isSolid = false;   // part of a surface that encloses a volume
    bool isInward = false;  // the front faces that volume
    // The connected surface (patches/welding.h) that the parent belongs to.
    uint32_t surface = 0;
    // A rank of the surface by area: larger objects have larger ranks, and within objects of equal
    // size larger connected surfaces do.
    uint32_t surfaceSize = 0;
    // Copied from the instance (Instance::stopsDirect, Instance::exchanges, Instance::isAdapted).
    bool stopsDirect = true, exchanges = true, isAdapted = false;
    uint32_t instance = 0;  // index in Scene::instances
    int32_t face = 0;       // face of the instance's mesh
    uint32_t island = 0;    // index in Patches::islands
    // The sides have the entries 2 * scattering (front) and 2 * scattering + 1 (back) of
    // Patches::scattering.
    uint32_t scattering = 0;
    // Index in Patches::cells of the cell that the parent is part of. The result is interpolated
    // between the corners of the cell.
    uint32_t cell = 0;
    // Bit k is set if no wall stands between the parent and corner k of its cell
    // (patches/crossings.h).
    uint8_t seenCorners = 15;
    std::shared_ptr<const CutTiles> cut;  // null if each tile is one patch

    uint32_t tileCount() const { return isTriangle ? countA * countA : countA * countB; }
    // Returns the number of patches of the parent.
    uint32_t patchCount() const { return cut ? cut->first.back() : tileCount(); }
    // Returns the tile that contains a patch. Both are counted within the parent.
    uint32_t tileOf(uint32_t patchInParent) const;
    // Returns how many times the edges of the patch's tile are halved. The patch is counted within
    // the parent.
    int levelOf(uint32_t patchInParent) const {
        return cut ? cut->level[tileOf(patchInParent)] : 0;
    }
    // Returns the area of a patch, m^2, including the share that its opacity lets through. The
    // patch is counted within the parent.
    float areaOf(uint32_t patchInParent) const {
        return std::ldexp(area() / float(tileCount()), -2 * levelOf(patchInParent));
    }
    // Returns the first patch of a tile, both counted within the parent. The patches of a tile end
    // at firstOf(tile + 1).
    uint32_t firstOf(uint32_t tile) const { return cut ? cut->first[tile] : tile; }
    // Returns the patch at affine coordinates (s, t), counted within the parent. Coordinates
    // outside the parent are clamped to it.
    uint32_t patchAt(float s, float t) const;
    // Maps (u, v) in [0, 1]^2 to affine coordinates of the parent, on a patch counted within the
    // parent. Uniform by area.
    glm::vec2 pointOn(uint32_t patchInParent, glm::vec2 uv) const;
    // Returns the position of affine coordinates, m, relative to Patches::centre.
    glm::vec3 position(glm::vec2 st) const { return origin + st.x * a + st.y * b; }
    // Returns the affine coordinates of a point in the plane of the parent. The point is in m,
    // relative to Patches::centre.
    glm::vec2 affineAt(const glm::dvec3& point) const;
    // Returns how far affine coordinates lie outside the parent; negative inside.
    float outside(glm::vec2 st) const {
        const float beyond = isTriangle ? st.x + st.y - 1 : std::max(st.x, st.y) - 1;
        return std::max({-st.x, -st.y, beyond});
    }
    // Returns the area of the parent, m^2.
    float area() const { return glm::length(glm::cross(a, b)) * (isTriangle ? 0.5f : 1.0f); }
};

// A triangle or parallelogram of the user's mesh. The result is interpolated over its corners.
struct Cell {
    // As in Parent: m, relative to Patches::centre.
    glm::vec3 origin, a, b;
    // Corners of the mesh, in order around the cell. The last one is -1 for a triangle.
    std::array<int32_t, 4> corner;
    // Index in Scene::instances, and face of the instance's mesh.
    uint32_t instance = 0;
    int32_t face = 0;
    // Slivers have no patches, but connect the cells beside them.
    bool hasPatches = true;
    // Bit k is set if a wall stands on the edge from corner k to the next (patches/crossings.h).
    uint8_t parted = 0;

    bool isTriangle() const { return corner[3] < 0; }
    int cornerCount() const { return isTriangle() ? 3 : 4; }
    // Returns the position of corner k, m, relative to Patches::centre.
    glm::vec3 position(int k) const {
        if (k == 0) return origin;
        if (k == 1) return origin + a;
        return isTriangle() || k == 3 ? origin + b : origin + a + b;
    }
    // Returns the unit normal of the front, along cross(a, b).
    glm::dvec3 normal() const { return glm::normalize(glm::cross(glm::dvec3(a), glm::dvec3(b))); }
    // Returns the area, m^2.
    double area() const {
        return glm::length(glm::cross(glm::dvec3(a), glm::dvec3(b))) * (isTriangle() ? 0.5 : 1.0);
    }
    // Returns the length of the longest edge, m.
    double longestEdge() const {
        return double(
            std::max({glm::length(a), glm::length(b), isTriangle() ? glm::distance(a, b) : 0.0f}));
    }
    // Returns the interpolation weight of each corner at a point of the cell (m, relative to
    // Patches::centre): barycentric in a triangle, bilinear in a parallelogram.
    std::array<float, 4> weights(const glm::vec3& point) const;
};

// A parallelogram of the user's mesh that walls have cut into several parents
// (patches/crossings.h).
struct CrossedCell {
    // Indices of its corners in Patches::vertices, in order around.
    std::array<uint32_t, 4> vertex;
    // Range of its parents in Patches::parents.
    uint32_t firstParent, parentCount;
};

// Surfaces that are near each other, with empty space around (patches/patch_size.h).
struct Island {
    glm::vec3 centre;  // centre of the bounding box, m, relative to Patches::centre
    float radius;      // radius of a sphere around `centre` that contains the island, m
    // Largest distance of the island from Patches::centre, m. Rounding errors are proportional to
    // it.
    float reach;
    float size = 0;           // largest target length of the edges of tiles, m
    float finest = 0;         // smallest target length of the edges of tiles, m
    float touchDistance = 0;  // surfaces within this distance touch, m
};

// Which surfaces are dense (findDense() in patches/clusters.h).
struct Density {
    float edge;     // largest width of their patches, relative to the target edge of a tile
    size_t fewest;  // smallest number of such patches
};

// All patches of a scene, as flat arrays. A patch p has two sides: side 2 * p is the front, 2 * p +
// 1 the back.
struct Patches {
    // World position of the local origin, m. Positions are floats relative to it, so that they stay
    // precise far from the world's origin.
    glm::dvec3 centre{0.0};
    // Radius of a sphere around `centre` that contains all surfaces, m.
    float radius = 0;
    // Rotation from local to canonical axes, along which most faces lie. Boxes along these axes do
    // not depend on how the scene is turned.
    glm::mat3 axes{1.0f};
    std::vector<glm::vec3> vertices;  // m, relative to `centre`
    // The island with the most patches is the first. `centre` is the centre of its box.
    std::vector<Island> islands;
    std::vector<Parent> parents;
    std::vector<Cell> cells;
    std::vector<CrossedCell> crossedCells;  // by increasing firstParent
    Sheets sheets;                          // sheets of parents
    std::vector<uint32_t> parentOf;         // per patch, index in `parents`
    // Per patch, m^2. Only the opaque share counts, as if a patch that lets light through had many
    // small holes. A global line meets the patch with that share as its probability, and
    // reflectance and emission are those of the surface between the holes.
    std::vector<float> area;
    // Per patch, the share of the light that the patch stops. Empty if all patches are opaque.
    std::vector<float> opacity;
    std::vector<glm::vec3> reflectance;  // per side
    // Per side, dependence of the reflectance on the angle of the light. Empty if no side has one.
    std::vector<AngleFactors> byAngle;
    // Two per value of Parent::scattering: front and back. Empty if all sides are Lambert's.
    std::vector<Scattering> scattering;
    std::vector<glm::vec3> emission;  // per side, W/m^2
    // Per side, the share of the light arriving at the other side of the patch that leaves this
    // side. Empty if it is 0 everywhere.
    std::vector<glm::vec3> translucence;
    double totalArea = 0;  // area of all parents, one side, whatever their opacity, m^2
    float size = 0;        // largest target length of the edges of tiles, m
    float finest = 0;      // smallest target length of the edges of tiles, m (patch_size.h)
    // Largest touch distance of all islands, m. A surface further away touches no side.
    float touchDistance = 0;
    size_t tileCount = 0;  // over all parents
    Warnings warnings;
    size_t degenerateFaces = 0;  // faces that were left out because they have no area
    // Corners of faces that were left out because another face in the same place stands for them.
    std::vector<DoubledCorner> doubledCorners;
    // See chooseDensity() in patches/clusters.h. `isDense` is per patch.
    Density density{};
    std::vector<bool> isDense;
    // Whether any faces coincide, also those that could not be left out.
    bool anyCoincide = false;

    // Returns the number of patches.
    size_t count() const { return area.size(); }
    // Returns the share of the light that a patch stops, 0 to 1.
    float opacityOf(uint32_t patch) const { return opacity.empty() ? 1.0f : opacity[patch]; }
    size_t sideCount() const { return 2 * area.size(); }
    // Returns the area of each side's patch, per side, m^2.
    std::vector<float> sideAreas() const {
        std::vector<float> areas(sideCount());
        for (size_t side = 0; side < areas.size(); ++side) areas[side] = area[patchOf(side)];
        return areas;
    }
    // Returns the translucence of a side, or 0 if no surface is translucent.
    glm::vec3 translucenceOf(size_t side) const {
        return translucence.empty() ? glm::vec3(0.0f) : translucence[side];
    }
    // Returns the unit normal of a side.
    glm::vec3 normal(uint32_t side) const {
        const glm::vec3& front = parentAt(side).normal;
        return isBack(side) ? -front : front;
    }
    // Returns the island of a side.
    const Island& islandAt(uint32_t side) const { return islands[parentAt(side).island]; }
    // Returns the parent of a side.
    const Parent& parentAt(uint32_t side) const { return parents[parentOf[patchOf(side)]]; }
    // Maps (u, v) in [0, 1]^2 to a point on a patch, uniform by area. In m, relative to `centre`.
    glm::vec3 point(uint32_t patch, glm::vec2 uv) const;
    // Returns the patch of a parent that contains a point in the plane of the parent. The point is
    // in m, relative to `centre`; points outside are clamped to the parent.
    uint32_t patchAt(uint32_t parent, const glm::vec3& point) const;
    // Returns the tile that contains a patch, counted over all parents.
    uint32_t tileOf(uint32_t patch) const {
        const Parent& parent = parents[parentOf[patch]];
        return parent.firstTile + parent.tileOf(patch - parent.firstPatch);
    }
    // Returns how many times the edges of the patch's tile are halved.
    int level(uint32_t patch) const {
        const Parent& parent = parents[parentOf[patch]];
        return parent.levelOf(patch - parent.firstPatch);
    }
};

// Cuts all instances of the scene into at most kMostPatches patches, and sets the means of
// reflectance, emission and opacity over each. The edges of patches are about `patchSize` metres
// long, or as automaticPatchSizes() chooses if it is 0, and longer if there would be more than
// maxPatches patches.
Patches subdivide(const Scene& scene, float patchSize, size_t maxPatches);

// Cuts tiles into smaller patches. `levels` has an entry per tile, counted over all parents: the
// edges of the tile are halved so many times, and 0 leaves the tile whole. `patches` must be uncut.
void cutTiles(const Scene& scene, Patches& patches, const std::vector<uint8_t>& levels);

}  // namespace raybundle
