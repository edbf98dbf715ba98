// SPDX-License-Identifier: GPL-3.0-or-later
//
// Stand-ins: sides that gather the light of the sources for others. Among the sides of a cluster
// (patches/clusters.h) whose light is not shown, one side gathers for all. The other sides of the
// cluster's patches may be shown.
//
// Source: face clusters as receivers (Willmott, Heckbert and Garland, "Face Cluster Radiosity",
// 1999).
// Differs: one of the faces gathers for all, chosen at random with a probability proportional to
// its area. The light that other surfaces get from many clusters is then right in the mean.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "lights/receiver.h"
#include "patches/patches.h"

namespace raybundle {

// The assignment of sides to the sides that gather for them.
class StandIns {
  public:
    // `isShown`, per side, says whether the light of the side is shown. Null: all sides are shown,
    // and each gathers for itself. `coarseness` is that of the clusters (findClusters()). `patches`
    // must outlive the object.
    StandIns(const Patches& patches, const std::vector<bool>* isShown, float coarseness = 1);

    // Returns the sides that gather, in ascending order.
    const std::vector<uint32_t>& gatherers() const { return sides; }
    // Returns the index in gatherers() of the side that gathers for `side`.
    uint32_t numberOf(uint32_t side) const { return numbers.empty() ? side : numbers[side]; }
    // Returns whether the gatherer with this index gathers for other sides too.
    bool isForOthers(uint32_t number) const { return !forOthers.empty() && forOthers[number]; }

    // Returns the pairs of gatherers (indices in gatherers()) whose sides are beside each other:
    // sides of neighbouring tiles, and of the patches of one cut tile. Only sides that gather, for
    // themselves or for others, are paired. The first call finds them; it must not be made by two
    // threads at once.
    const std::vector<ReceiverPair>& neighbours() const;

  private:
    const Patches& patches;
    mutable std::optional<std::vector<ReceiverPair>> pairs;
    std::vector<uint32_t> sides;
    std::vector<uint32_t> numbers;  // per side; empty if all sides gather
    std::vector<bool> forOthers;    // per gatherer; empty if all sides gather
};

}  // namespace raybundle
