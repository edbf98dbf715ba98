// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace raybundle {

// Sets of indices that are joined in pairs.
//
// Source: Tarjan and van Leeuwen, "Worst-Case Analysis of Set Union Algorithms" (1984): paths are
// halved.
class DisjointSets {
  public:
    // Each index by itself.
    explicit DisjointSets(size_t count) : above(count) {
        std::iota(above.begin(), above.end(), 0u);
    }

    void join(uint32_t a, uint32_t b) { above[root(a)] = root(b); }
    // The index that stands for the set of another.
    uint32_t root(uint32_t index) {
        while (above[index] != index) index = above[index] = above[above[index]];
        return index;
    }

  private:
    std::vector<uint32_t> above;
};

}  // namespace raybundle
