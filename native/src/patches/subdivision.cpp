// SPDX-License-Identifier: GPL-3.0-or-later
//
// Cuts a scene into patches, and cuts tiles once more. patches/face_cutting.h makes cells and
// parents from faces; this file sizes and numbers the grids of the parents.
#include <algorithm>
#include <cmath>

#include "job/cancellation.h"
#include "job/error.h"
#include "job/settings.h"
#include "patches/clusters.h"
#include "patches/face_cutting.h"
#include "patches/patches.h"
#include "patches/placement.h"
#include "patches/reflectance.h"

namespace raybundle {
namespace {

// The touch distance of an island is the smaller one of these shares of its radius and of its
// finest patches. Far from the centre, where positions are less precise, it is at least
// kTouchOfDistance of the island's distance.
constexpr float kTouchOfRadius = 1e-4f, kTouchOfPatch = 0.02f, kTouchOfDistance = 1e-6f;

// Sets the indices of the first patches and tiles of all parents. Returns the number of patches.
size_t numberPatches(Patches& patches) {
    size_t count = 0;
    for (Parent& parent : patches.parents) {
        parent.firstPatch = parent.firstTile = uint32_t(count);
        count += parent.patchCount();
    }
    return count;
}

// Makes the grids coarser by a factor.
void coarsen(Patches& patches, double factor) {
    for (Parent& parent : patches.parents) {
        parent.countA = uint16_t(std::max(1.0, std::floor(parent.countA / factor)));
        parent.countB = parent.isTriangle
                            ? parent.countA
                            : uint16_t(std::max(1.0, std::floor(parent.countB / factor)));
    }
}

// Sets all properties of patches. Their indices must be set.
void fillPatches(const Scene& scene, Patches& patches) {
    patches.parentOf.clear();
    patches.area.clear();
    for (size_t i = 0; i < patches.parents.size(); ++i) {
        throwIfCancelledAt(i);
        const Parent& parent = patches.parents[i];
        patches.parentOf.resize(parent.firstPatch + parent.patchCount(), uint32_t(i));
        const float tileArea = parent.area() / float(parent.tileCount());
        for (uint32_t tile = 0; tile < parent.tileCount(); ++tile) {
            const uint32_t count = parent.firstOf(tile + 1) - parent.firstOf(tile);
            patches.area.resize(patches.area.size() + count, tileArea / float(count));
        }
    }
    patches.sheets = findSheets(patches);
    assignOpacity(scene, patches);
    assignMaterials(scene, patches);
}

// Returns per instance whether its light is a result, and its surfaces can be dense.
std::vector<bool> bakedInstances(const Scene& scene) {
    std::vector<bool> isBaked;
    for (const Instance& instance : scene.instances)
        isBaked.push_back(instance.role == RB_ROLE_BAKE);
    if (std::find(isBaked.begin(), isBaked.end(), true) == isBaked.end())
        isBaked.assign(isBaked.size(), true);
    for (size_t i = 0; i < isBaked.size(); ++i)
        if (scene.instances[i].isAdapted) isBaked[i] = false;
    return isBaked;
}

}  // namespace

Patches subdivide(const Scene& scene, float patchSize, size_t maxPatches) {
    Patches patches;
    Placement placed(scene);
    if (placed.isEmpty()) return patches;
    placed.findIslands(patches);
    cutFaces(scene, placed, patchSize, patches);

    // A parent keeps at least one patch. If many small parents use up most of maxPatches, an eighth
    // of maxPatches is still available for the grids of large parents. Otherwise a ground under
    // dense props would become one patch.
    const size_t most = std::max(maxPatches, patches.parents.size() + maxPatches / 8);
    while (numberPatches(patches) > most) {
        coarsen(patches, 1.1);
        patches.size *= 1.1f;
        patches.finest *= 1.1f;
        for (Island& island : patches.islands) {
            island.size *= 1.1f;
            island.finest *= 1.1f;
        }
    }
    const size_t count = numberPatches(patches);
    if (count > kMostPatches)
        throw invalidArgument("the scene has too many faces: it needs at least " +
                              std::to_string(count) + " patches, and only " +
                              std::to_string(kMostPatches) +
                              " are possible; simplify meshes, or hide objects in renders");
    for (Island& island : patches.islands) {
        island.touchDistance =
            std::max(std::min(kTouchOfRadius * island.radius, kTouchOfPatch * island.finest),
                     kTouchOfDistance * (island.reach - island.radius));
        patches.touchDistance = std::max(patches.touchDistance, island.touchDistance);
    }
    patches.tileCount = count;
    for (const Parent& parent : patches.parents) patches.totalArea += parent.area();
    fillPatches(scene, patches);
    chooseDensity(bakedInstances(scene), maxPatches, patches);
    return patches;
}

void cutTiles(const Scene& scene, Patches& patches, const std::vector<uint8_t>& levels) {
    uint32_t next = 0;
    for (Parent& parent : patches.parents) {
        parent.firstPatch = next;
        const auto begin = levels.begin() + ptrdiff_t(parent.firstTile);
        CutTiles cut{{begin, begin + parent.tileCount()}, {}};
        for (uint8_t level : cut.level) {
            cut.first.push_back(next - parent.firstPatch);
            next += 1u << (2 * level);
        }
        cut.first.push_back(next - parent.firstPatch);
        const bool isCut = next - parent.firstPatch > parent.tileCount();
        parent.cut = isCut ? std::make_shared<const CutTiles>(std::move(cut)) : nullptr;
    }
    fillPatches(scene, patches);
    patches.isDense = findDense(patches, patches.density);
}

}  // namespace raybundle
