// SPDX-License-Identifier: GPL-3.0-or-later
//
// The memory of this process and of the computer, and how much of it a bake may take.
#pragma once

#include <algorithm>
#include <cstddef>

#include "job/error.h"

namespace raybundle {

// Return the physical memory that this process uses, now and at most so far, in bytes.
size_t residentMemory();
size_t peakResidentMemory();
// Returns the physical memory of the computer in bytes, or of the container (Linux control group)
// that this process runs in if it may use less.
size_t computersMemory();

// The memory that a bake may take. Part of it is for the exchanges between patches, so that there
// is some left for the rest: a bake that reaches that part goes on without keeping exchanges, and a
// bake that reaches the whole ends.
struct MemoryLimit {
    // Makes the limit of the setting memory_limit, in MB (10^6 bytes). 0 stands for three quarters
    // of the computer's memory.
    explicit MemoryLimit(float megabytes);
    // Returns the error of a bake that reached the whole limit.
    Error reached() const;

    size_t whole;      // bytes, at least those that the smallest bakes need
    size_t exchanges;  // bytes
    bool isAutomatic;  // whether it follows from the computer's memory
};

// The memory that a bake takes: what the process has grown by while the bake ran. The operating
// system knows what a process uses, but not for what. What else the process allocates during a bake
// is therefore counted, too.
class MemoryUse {
  public:
    // Tells that a run of the bake begins or ends. Between two runs, the bake holds what it keeps
    // for the next one.
    void begin() {
        const size_t now = residentMemory();
        before = now - std::min(now, held);
    }
    void end() { held = bytes(); }
    // Returns the memory that the bake takes now, in bytes. Call this only during a run.
    size_t bytes() const {
        const size_t now = residentMemory();
        return now - std::min(now, before);
    }

  private:
    size_t before = 0;  // bytes of the process without the bake
    size_t held = 0;    // bytes of the bake when its last run ended
};

}  // namespace raybundle
