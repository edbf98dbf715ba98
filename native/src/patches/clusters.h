// SPDX-License-Identifier: GPL-3.0-or-later
//
// Clusters of patches that exchange light as one patch. They are used where a mesh is finer than
// the tiles between which light is exchanged and its light is not shown. Surfaces around then
// receive only the sum of the light of many patches. A cluster consists of patches of one surface
// that lie within part of a tile's width and face in similar directions. The cost of transport thus
// follows the light and not the number of triangles.
//
// Sources: Willmott, Heckbert and Garland, "Face Cluster Radiosity" (1999). Lines can be counted
// for a patch of any shape: c_ij / m_i is its form factor however many faces it consists of, lines
// between two of its own faces included.
// Differs: clusters are cells of a grid and not a hierarchy. What lies in a cell that the surface
// hardly reaches into belongs to a cluster beside it. All cells become coarser if there are too
// many patches. Only patches whose light is not shown are in clusters. Their light is needed only
// on other surfaces, each of which receives light of many clusters.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "patches/patches.h"
#include "patches/side.h"

namespace raybundle {

// Stands for no cluster.
constexpr uint32_t kNoCluster = UINT32_MAX;

// Returns for each patch the number of the cluster that it belongs to. The patches of a cluster
// belong to one surface, object and material, are near each other and face in similar directions. A
// patch is in no cluster (kNoCluster) if it is too large or `isIn` (per patch) is false. Numbers
// begin at 0, in the order in which the patches first use them. Clusters are `coarseness` times as
// wide as usual.
std::vector<uint32_t> findClusters(const Patches& patches, const std::vector<bool>& isIn,
                                   float coarseness = 1);

// Returns for each patch whether it lies on a dense surface and is small: a dense surface is
// connected and has many patches that are whole faces, much smaller than tiles, opaque and not
// translucent. Pieces of faces that walls have cut are not among them. On an object that has such a
// surface, others with an eighth of the patches are dense too, as the eyes of a head. Meshes that
// were adapted to the light of their patches (Parent::isAdapted) have no dense surfaces.
std::vector<bool> findDense(const Patches& patches, const Density& density);

// Sets the density and the dense patches (Patches::isDense) such that at most `most` patches of
// baked instances are not dense, if possible. `isBaked` is per instance. Without need only large
// surfaces count.
void chooseDensity(const std::vector<bool>& isBaked, size_t most, Patches& patches);

// The units between which light is exchanged: clusters, and the patches in no cluster. Each of them
// is represented as one patch of patches().
class Clusters {
  public:
    // Makes an object without clusters, where patches() is `all`. Keeps a reference to `all`.
    explicit Clusters(const Patches& all) : all(&all) {}
    // Forms clusters of opaque patches that are not translucent and none of whose sides is shown.
    // `isShown` is per side. Clusters are coarsened until patches() has at most `most` patches, as
    // far as that is possible. Keeps a reference to `all`.
    Clusters(const Patches& all, const std::vector<bool>& isShown, size_t most = SIZE_MAX);

    // Returns whether there are no clusters, so that patches() is members().
    bool isNone() const { return !joined; }
    // Returns whether both objects have equal clusters of equal patches, whatever the patches
    // reflect and emit.
    bool areThoseOf(const Clusters& other) const { return numbers == other.numbers; }
    // Returns how many times as wide as usual the clusters are (findClusters()).
    float coarseness() const { return width; }
    // Returns the number of patches that share their cluster with other patches.
    size_t memberCount() const;

    // Returns the patches between which light is exchanged: one for each cluster, and one for each
    // patch in no cluster. A cluster has the position and the normal of its largest patch, the
    // total area, and the means of reflectance and emission. All parents of a cluster refer to its
    // patch. The result has no cells and no sheets.
    const Patches& patches() const { return joined ? *joined : *all; }

    // Returns the patches from which the clusters are formed.
    const Patches& members() const { return *all; }

    // Returns the side of patches() that contains a side of members().
    uint32_t sideOf(uint32_t side) const {
        return isNone() ? side : raybundle::sideOf(numbers[patchOf(side)], isBack(side));
    }
    // Returns a side of members() that is part of a side of patches(). Consecutive values of `k`
    // run through all these sides in a cycle.
    uint32_t memberOf(uint32_t side, uint32_t k) const {
        if (isNone()) return side;
        const uint32_t begin = first[patchOf(side)], count = first[patchOf(side) + 1] - begin;
        return raybundle::sideOf(memberList[begin + k % count], isBack(side));
    }
    // Calls visit(member, share) for each patch of members() that is part of `patch` of patches().
    // `share` is the member's share of the area, and the shares add up to 1. Only if !isNone().
    template <class Visit>
    void forEachMember(uint32_t patch, const Visit& visit) const {
        for (uint32_t k = first[patch]; k < first[patch + 1]; ++k)
            visit(memberList[k], all->area[memberList[k]] / joined->area[patch]);
    }

    // Returns the means by area over each side of patches() of values per side of members().
    // Returns an empty vector if `values` is empty.
    template <class Value>
    std::vector<Value> mean(const std::vector<Value>& values) const {
        if (isNone() || values.empty()) return values;
        std::vector<Value> means(joined->sideCount(), Value(0));
        for (uint32_t side = 0; side < means.size(); ++side)
            forEachMember(patchOf(side), [&](uint32_t patch, float share) {
                means[side] += share * values[raybundle::sideOf(patch, isBack(side))];
            });
        return means;
    }
    // Returns for each side of members() the value of the side of patches() that contains it.
    // Returns an empty vector if `values` is empty.
    template <class Value>
    std::vector<Value> spread(const std::vector<Value>& values) const {
        if (isNone() || values.empty()) return values;
        std::vector<Value> result(all->sideCount());
        for (uint32_t side = 0; side < result.size(); ++side) result[side] = values[sideOf(side)];
        return result;
    }

  private:
    // Sets the reflectance, emission, translucence and scattering of `joined`.
    void takeMaterials();

    const Patches* all;
    float width = 1;  // see coarseness()
    std::optional<Patches> joined;
    // Per patch of `all`, its patch of `joined`. Empty if there are no clusters.
    std::vector<uint32_t> numbers;
    // Patch k of `joined` consists of the patches of `all` in memberList, from position first[k] to
    // first[k + 1] - 1.
    std::vector<uint32_t> first, memberList;
};

}  // namespace raybundle
