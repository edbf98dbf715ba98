// SPDX-License-Identifier: GPL-3.0-or-later
//
// Clusters: patches of several faces. Where a mesh is finer than the tiles that light is exchanged
// by, and its light is not shown, what surfaces around get from it is that of many patches
// together: those of one surface that lie within a part of a tile's width and face alike exchange
// light as one, so that the work follows the light and not the triangles.
//
// Sources: Willmott, Heckbert and Garland, "Face Cluster Radiosity" (1999). Lines count for a patch
// of any shape: c_ij / m_i is its form factor however many faces it has, lines between two of them
// included.
// Differs: clusters are cells of a grid and not a hierarchy, and only what is not shown is in any:
// its light is needed on others alone, which are lit by many clusters.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

constexpr uint32_t kNoCluster = UINT32_MAX;

// Per patch, the number of the cluster that it would be in: of one surface, object and material,
// near each other, facing alike; kNoCluster of those that are too large for any, and where `isIn`
// (per patch) is false. The numbers are those from 0 on, in the order of the patches.
std::vector<uint32_t> findClusters(const Patches& patches, const std::vector<bool>& isIn);

// What light is exchanged between: the patches that are in no cluster, and clusters, each as one
// patch.
class Clusters {
  public:
    // Without any cluster. `all` must outlive the object and stay where it is.
    explicit Clusters(const Patches& all) : all(&all) {}
    // Of patches that let no light through and neither of whose sides is shown (isShown: per side).
    Clusters(const Patches& all, const std::vector<bool>& isShown);

    bool isNone() const { return !joined; }
    // Whether they are the same patches, whatever these reflect and emit.
    bool areThoseOf(const Clusters& other) const { return numbers == other.numbers; }
    // The patches that are in a cluster with others.
    size_t memberCount() const;

    // One a cluster, and one for each patch that is in none. Each has the place and the normal of
    // the largest of its patches, the area of all and the mean of what they reflect and emit; all
    // parents of a cluster have it as theirs. There are no cells and no sheets.
    const Patches& patches() const { return joined ? *joined : *all; }

    // The patches that these are made of.
    const Patches& members() const { return *all; }

    // The side among those of patches() that a side of `all` is part of.
    uint32_t sideOf(uint32_t side) const {
        return isNone() ? side : 2 * numbers[side / 2] + side % 2;
    }
    // One of the sides of `all` that a side of patches() is made of, in turns by k.
    uint32_t memberOf(uint32_t side, uint32_t k) const {
        if (isNone()) return side;
        const uint32_t begin = first[side / 2], count = first[side / 2 + 1] - begin;
        return 2 * memberList[begin + k % count] + side % 2;
    }
    // Calls visit(patch, its share of the area) for the patches that one of patches() is made of.
    template <class Visit>
    void forEachMember(uint32_t patch, const Visit& visit) const {
        for (uint32_t k = first[patch]; k < first[patch + 1]; ++k)
            visit(memberList[k], all->area[memberList[k]] / joined->area[patch]);
    }

    // Means by area over each side of patches(), of values per side of `all`; stays empty.
    template <class Value>
    std::vector<Value> mean(const std::vector<Value>& values) const {
        if (isNone() || values.empty()) return values;
        std::vector<Value> means(joined->sideCount(), Value(0));
        for (uint32_t side = 0; side < means.size(); ++side)
            forEachMember(side / 2, [&](uint32_t patch, float share) {
                means[side] += share * values[2 * patch + side % 2];
            });
        return means;
    }
    // From values per side of patches() to values per side of `all`; stays empty.
    template <class Value>
    std::vector<Value> spread(const std::vector<Value>& values) const {
        if (isNone() || values.empty()) return values;
        std::vector<Value> result(all->sideCount());
        for (uint32_t side = 0; side < result.size(); ++side) result[side] = values[sideOf(side)];
        return result;
    }

  private:
    void takeMaterials();

    const Patches* all;
    std::optional<Patches> joined;
    std::vector<uint32_t> numbers;  // per patch of `all`; empty where there are no clusters
    std::vector<uint32_t> first, memberList;  // per patch of `joined`
};

}  // namespace raybundle
