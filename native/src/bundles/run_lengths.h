// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bundles/projector.h"

namespace raybundle {

// Collects the exchanges of neighbouring pixels: pixel after pixel the same pair often occurs
// again. Keeps its memory.
class RunLengths {
  public:
    // slot: small; a pair that occurs again should come with the slot of the last time.
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
        // Part by part: the copy of a temporary waits for its parts to be stored.
        Exchange& next = runs[count++];
        next.i = low;
        next.j = high;
        next.lines = 1;
    }

    // Appends all runs to a list and starts anew.
    void moveTo(std::vector<Exchange>& out) {
        out.insert(out.end(), runs.begin() + 1, runs.begin() + ptrdiff_t(count));
        std::fill(last.begin(), last.end(), 0);
        count = 1;
    }

  private:
    // The first is of no pair.
    std::vector<Exchange> runs{{0, 0, 0}, {0, 0, 0}};
    size_t count = 1;
    std::vector<size_t> last;  // per slot: the run in hand
};

}  // namespace raybundle
