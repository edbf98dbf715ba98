// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sides that stand for others in the first shot: of the sides of a cluster (patches/clusters.h)
// whose light is not shown one gathers the light of the sources for all. The other sides of its
// patches may be shown.
//
// Source: face clusters as receivers (Willmott, Heckbert and Garland, "Face Cluster Radiosity",
// 1999). Differs: one of the faces receives for all, by chance, as likely as it is large: what
// surfaces around get from many clusters is right in the mean.
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
    // Among them, the number of the one that gathers for a side.
    uint32_t numberOf(uint32_t side) const { return numbers.empty() ? side : numbers[side]; }
    // Whether it does for others too.
    bool isForOthers(uint32_t number) const { return !forOthers.empty() && forOthers[number]; }

  private:
    std::vector<uint32_t> sides;
    std::vector<uint32_t> numbers;  // per side; empty where all gather
    std::vector<bool> forOthers;    // per gatherer; likewise
};

}  // namespace raybundle
