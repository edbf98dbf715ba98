// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "bundles/projector.h"

namespace raybundle {

// Collects the exchanges of neighbouring pixels: pixel after pixel the same pair usually occurs
// again.
class RunLengths {
  public:
    explicit RunLengths(std::vector<Exchange>& out) : out(out) {}

    // slot: small; a pair that occurs again should come with the slot of the last time.
    void add(size_t slot, uint32_t i, uint32_t j) {
        if (i > j) std::swap(i, j);
        if (slot >= runs.size()) runs.resize(slot + 1, Exchange{0, 0, 0});
        Exchange& run = runs[slot];
        if (run.i == i && run.j == j) {
            ++run.lines;
            return;
        }
        if (run.lines) out.push_back(run);
        run = {i, j, 1};
    }

    void flush() {
        for (const Exchange& run : runs)
            if (run.lines) out.push_back(run);
        runs.clear();
    }

  private:
    std::vector<Exchange>& out;
    std::vector<Exchange> runs;  // the open run of each slot
};

}  // namespace raybundle
