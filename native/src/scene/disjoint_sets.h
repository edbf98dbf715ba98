// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace raybundle {

// A partition of the indices 0 to count - 1 into sets that can be joined (union-find). Looking up a
// set halves the paths to its root.
//
// Source: Tarjan and van Leeuwen, "Worst-Case Analysis of Set Union Algorithms" (1984).
// Differs: sets are joined without regard to their sizes.
class DisjointSets {
  public:
    // Makes `count` sets of one index each.
    explicit DisjointSets(size_t count) : above(count) {
        std::iota(above.begin(), above.end(), 0u);
    }

    // Joins the sets that contain `a` and `b`.
    void join(uint32_t a, uint32_t b) { above[root(a)] = root(b); }
    // Returns the index that represents the set containing `index`. It is equal for all indices of
    // a set, and may change when sets are joined.
    uint32_t root(uint32_t index) {
        while (above[index] != index) index = above[index] = above[above[index]];
        return index;
    }

  private:
    std::vector<uint32_t> above;
};

}  // namespace raybundle
