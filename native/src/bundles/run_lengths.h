// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bundles/projector.h"

namespace raybundle {

// Collects exchanges and merges equal ones of neighbouring pixels, since the same pair often occurs
// in many consecutive pixels. Keeps its memory.
class RunLengths {
  public:
    // Adds one line between sides i and j. `slot` should be a small number that is equal each time
    // the same pair occurs, such as its place in the pixel's list. A pair is merged with the last
    // one of its slot.
    void add(size_t slot, uint32_t i, uint32_t j) {
        const uint32_t low = std::min(i, j), high = std::max(i, j);
        if (slot >= last.size()) last.resize(slot + 1, 0);
        Exchange& run = runs[last[slot]];
        if (run.i == low && run.j == high) {
            ++run.lines;
            return;
        }
        if (count == runs.size()) runs.resize(2 * count);
        last[slot] = count;
        // Assign each member, since copying a temporary would wait until its members are stored.
        Exchange& next = runs[count++];
        next.i = low;
        next.j = high;
        next.lines = 1;
    }

    // Appends all exchanges to `out` and clears the collection.
    void moveTo(std::vector<Exchange>& out) {
        out.insert(out.end(), runs.begin() + 1, runs.begin() + ptrdiff_t(count));
        std::fill(last.begin(), last.end(), 0);
        count = 1;
    }

  private:
    // The first entry is a sentinel of no pair.
    std::vector<Exchange> runs{{0, 0, 0}, {0, 0, 0}};
    size_t count = 1;
    std::vector<size_t> last;  // per slot: index of its current run
};

}  // namespace raybundle
