// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sides that stand for others in the first shot. Where a mesh is finer than the tiles that light is
// exchanged by, and its light is not shown, what surfaces around get from it is that of many sides
// together: of the sides of one surface that lie within a tile's width and face alike, some gather
// the light of the sources, and the others have the mean of theirs.
//
// Sources: face clusters as receivers (Willmott, Heckbert and Garland, "Face Cluster Radiosity",
// 1999). Differs: clusters are cells of a grid and not a hierarchy, and only what is not shown is
// in any.
#pragma once

#include <cstdint>
#include <vector>

#include "patches/patches.h"

namespace raybundle {

class StandIns {
  public:
    // isShown: per side; null: all are, and each side stands for itself alone.
    StandIns(const Patches& patches, const std::vector<bool>* isShown);

    // The sides that gather, ascending.
    const std::vector<uint32_t>& gatherers() const { return sides; }
    // The number of a side among them, or kNone.
    uint32_t numberOf(uint32_t side) const { return numbers.empty() ? side : numbers[side]; }
    static constexpr uint32_t kNone = UINT32_MAX;
    // Whether a side gathers for others too.
    bool isStandIn(uint32_t side) const {
        return !numbers.empty() && numbers[side] != kNone && clusterOf[side] != kNone &&
               standsForOthers[clusterOf[side]];
    }

    // Calls visit(number) for each of those that stand for a side which does not gather.
    template <class Visit>
    void forEachOf(uint32_t side, const Visit& visit) const {
        const uint32_t cluster = clusterOf[side];
        for (uint32_t k = first[cluster]; k < first[cluster + 1]; ++k) visit(members[k]);
    }

  private:
    std::vector<uint32_t> sides;
    std::vector<uint32_t> numbers, clusterOf;  // per side; empty where all gather
    std::vector<uint32_t> first, members;      // per cluster: numbers of its gatherers
    std::vector<bool> standsForOthers;         // per cluster
};

}  // namespace raybundle
