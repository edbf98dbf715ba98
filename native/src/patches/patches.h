// SPDX-License-Identifier: GPL-3.0-or-later
//
// Patches: the finest units of transport. A face of the user's mesh is cut into parents (triangles
// and parallelograms), and a parent into equal patches by a regular grid in its affine coordinates:
//
//   point = origin + s * a + t * b
//   parallelogram: s, t in [0, 1];  triangle: s, t >= 0, s + t <= 1
//
// so that whoever meets a parent at a point knows the patch without a search, and projecting the
// parents costs the same however fine the patches are. A patch of the regular grid is a tile; where
// the light needs it, a tile is cut once more, into 4^level patches of its own regular grid
// (refinement/refinement.h).
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
#include "scene/scene.h"

namespace raybundle {

constexpr uint32_t kNoParent = UINT32_MAX;

// The tiles of a parent of which some are cut once more.
struct CutTiles {
    std::vector<uint8_t> level;   // per tile: it has 4^level patches
    std::vector<uint32_t> first;  // per tile: its first patch in the parent; one more at the end
};

struct Parent {
    glm::vec3 origin, a, b;  // metres, relative to Patches::centre
    glm::vec3 normal;        // of the front, unit: along cross(a, b)
    std::array<uint32_t, 4>
        vertex;  // into Patches::vertices, in order around; [3] unused by triangles
    uint32_t firstPatch = 0;
    uint32_t firstTile = 0;           // its number before any tile was cut
    uint16_t countA = 1, countB = 1;  // grid along a and b; equal for triangles
    bool isTriangle = true;
    bool isSolid = false;   // part of a surface that encloses a volume
    bool isInward = false;  // its front looks into that volume
    uint32_t surface = 0;   // that it hangs together with (patches/welding.h)
    // Orders surfaces by the area of their object, and then of the part of it that hangs together.
    uint32_t surfaceSize = 0;
    // As the instance has it.
    bool stopsDirect = true, exchanges = true;
    uint32_t instance = 0;    // into Scene::instances
    int32_t face = 0;         // of the instance's mesh
    uint32_t island = 0;      // into Patches::islands
    uint32_t scattering = 0;  // half the index of its front's in Patches::scattering
    // The mesh triangle or quad that the parent is part of, for interpolation between its corners:
    // one of Patches::cells.
    uint32_t cell = 0;
    // Bit k: no wall stands between the parent and corner k of the cell (patches/crossings.h).
    uint8_t seenCorners = 15;
    std::shared_ptr<const CutTiles> cut;  // null: each tile is a patch

    uint32_t tileCount() const { return isTriangle ? countA * countA : countA * countB; }
    uint32_t patchCount() const { return cut ? cut->first.back() : tileCount(); }
    // The tile that a patch is part of, and how often its edges are halved, both by the number of
    // the patch in the parent.
    uint32_t tileOf(uint32_t patchInParent) const;
    int levelOf(uint32_t patchInParent) const {
        return cut ? cut->level[tileOf(patchInParent)] : 0;
    }
    // Of a patch by its number in the parent, whatever it lets through, m^2.
    float areaOf(uint32_t patchInParent) const {
        return std::ldexp(area() / float(tileCount()), -2 * levelOf(patchInParent));
    }
    // The first patch of a tile in the parent, and the end of its patches.
    uint32_t firstOf(uint32_t tile) const { return cut ? cut->first[tile] : tile; }
    // The patch at affine coordinates (s, t), counted within the parent. Clamps to the parent.
    uint32_t patchAt(float s, float t) const;
    // The point (u, v) in [0, 1]^2 of a patch, in affine coordinates of the parent; uniform by
    // area.
    glm::vec2 pointOn(uint32_t patchInParent, glm::vec2 uv) const;
    glm::vec3 position(glm::vec2 st) const { return origin + st.x * a + st.y * b; }
    // The affine coordinates of a point in its plane.
    glm::vec2 affineAt(const glm::dvec3& point) const;
    float area() const { return glm::length(glm::cross(a, b)) * (isTriangle ? 0.5f : 1.0f); }
};

// A triangle or parallelogram of the user's mesh, over whose corners the result is interpolated.
struct Cell {
    glm::vec3 origin, a, b;         // as in Parent
    std::array<int32_t, 4> corner;  // of the mesh; [3] is -1 for a triangle
    uint32_t instance = 0;
    int32_t face = 0;
    bool hasPatches = true;  // slivers have none, but join what lies beside them
    uint8_t parted = 0;      // bit k: a wall stands on the edge from corner k on (crossings.h)

    bool isTriangle() const { return corner[3] < 0; }
    int cornerCount() const { return isTriangle() ? 3 : 4; }
    // Of corner k, relative to Patches::centre.
    glm::vec3 position(int k) const {
        if (k == 0) return origin;
        if (k == 1) return origin + a;
        return isTriangle() || k == 3 ? origin + b : origin + a + b;
    }
    // Unit, along cross(a, b).
    glm::dvec3 normal() const { return glm::normalize(glm::cross(glm::dvec3(a), glm::dvec3(b))); }
    // m^2.
    double area() const {
        return glm::length(glm::cross(glm::dvec3(a), glm::dvec3(b))) * (isTriangle() ? 0.5 : 1.0);
    }
    double longestEdge() const {  // metres
        return double(
            std::max({glm::length(a), glm::length(b), isTriangle() ? glm::distance(a, b) : 0.0f}));
    }
    // Weight of each corner at a point: barycentric in a triangle, bilinear in a parallelogram.
    std::array<float, 4> weights(const glm::vec3& point) const;
};

// A parallelogram of the user's mesh that walls cut into several parents (patches/crossings.h).
struct CrossedCell {
    std::array<uint32_t, 4> vertex;     // of its corners, in order around, as Parent has them
    uint32_t firstParent, parentCount;  // into Patches::parents
};

// Surfaces with empty space around them (patches/patch_size.h).
struct Island {
    glm::vec3 centre;  // of its bounding box, metres, relative to Patches::centre
    float radius;      // of a sphere around it that holds the island, metres
    float reach;       // how far it reaches from Patches::centre: what rounding goes with, metres
    float size = 0;    // target edge of a tile, metres
    float finest = 0;  // the same where it is least
    float touchDistance = 0;  // surfaces not further apart touch, metres
};

// Two indices a patch: side 2 * p is its front, 2 * p + 1 its back.
struct Patches {
    glm::dvec3 centre{
        0.0};          // world position of the local origin, so that floats stay exact far away
    float radius = 0;  // of a sphere around the centre that holds everything, metres
    // To the axes along which most faces lie, for boxes that do not depend on how the scene is
    // turned.
    glm::mat3 axes{1.0f};
    std::vector<glm::vec3> vertices;  // metres, relative to centre
    std::vector<Island>
        islands;  // the one with the most patches first; the centre is that of its box
    std::vector<Parent> parents;
    std::vector<Cell> cells;
    std::vector<CrossedCell> crossedCells;  // ascending
    Sheets sheets;                          // of the parents
    std::vector<uint32_t> parentOf;         // per patch
    // Per patch, m^2. Of a patch that lets light through only the opaque share counts, as if it had
    // many small holes: a global line meets that share of it, and reflectance and emission are
    // those of what is left between the holes.
    std::vector<float> area;
    std::vector<float> opacity;          // per patch; empty where all are opaque
    std::vector<glm::vec3> reflectance;  // per side
    std::vector<AngleFactors> byAngle;   // per side: of the reflectance; empty where all are 0
    std::vector<Scattering> scattering;  // per Parent::scattering and side; empty: all Lambert's
    std::vector<glm::vec3> emission;     // per side, W/m^2
    // Per side: what leaves it of the light that arrives at the other side of the patch; empty
    // where all are 0.
    std::vector<glm::vec3> translucence;
    double totalArea = 0;  // of all patches, one side, m^2
    float size = 0;        // target edge of a tile, metres
    float finest = 0;      // the same where it is least (patch_size.h)
    // Metres; the largest of all islands'. Nothing that lies further from a side touches it.
    float touchDistance = 0;
    size_t tileCount = 0;
    Warnings warnings;
    size_t degenerateFaces = 0;  // left out
    // Of faces that are left out since others stand for them.
    std::vector<DoubledCorner> doubledCorners;
    bool anyCoincide = false;  // whether there are faces that might stand for others

    size_t count() const { return area.size(); }
    // Share of the light that a patch stops.
    float opacityOf(uint32_t patch) const { return opacity.empty() ? 1.0f : opacity[patch]; }
    size_t sideCount() const { return 2 * area.size(); }
    // Per side: the area of its patch, m^2.
    std::vector<float> sideAreas() const {
        std::vector<float> areas(sideCount());
        for (size_t side = 0; side < areas.size(); ++side) areas[side] = area[side / 2];
        return areas;
    }
    glm::vec3 translucenceOf(size_t side) const {
        return translucence.empty() ? glm::vec3(0.0f) : translucence[side];
    }
    // Unit normal of a side.
    glm::vec3 normal(uint32_t side) const {
        const glm::vec3& front = parents[parentOf[side / 2]].normal;
        return side % 2 ? -front : front;
    }
    const Island& islandAt(uint32_t side) const {
        return islands[parents[parentOf[side / 2]].island];
    }
    const Parent& parentAt(uint32_t side) const { return parents[parentOf[side / 2]]; }
    // The point (u, v) in [0, 1]^2 of a patch, relative to centre.
    glm::vec3 point(uint32_t patch, glm::vec2 uv) const;
    // The patch of a parent at a point in its plane.
    uint32_t patchAt(uint32_t parent, const glm::vec3& point) const;
    // The tile of a patch, counted over all parents.
    uint32_t tileOf(uint32_t patch) const {
        const Parent& parent = parents[parentOf[patch]];
        return parent.firstTile + parent.tileOf(patch - parent.firstPatch);
    }
    // How often the edges of a patch's tile are halved.
    int level(uint32_t patch) const {
        const Parent& parent = parents[parentOf[patch]];
        return parent.levelOf(patch - parent.firstPatch);
    }
};

// Cuts all instances of the scene into patches, kMostPatches at most, with edges of about
// `patchSize` metres (0: as automaticPatchSizes has it), coarser if there would be more than
// maxPatches, and gives each its reflectance, emission and opacity (means over its area).
Patches subdivide(const Scene& scene, float patchSize, size_t maxPatches);

// Cuts the tiles once more: levels holds one entry a tile, in the order of the patches of an uncut
// subdivision; 0 leaves a tile as it is.
void cutTiles(const Scene& scene, Patches& patches, const std::vector<uint8_t>& levels);

}  // namespace raybundle
