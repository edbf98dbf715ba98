// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tbb/global_control.h>

#include <optional>

namespace raybundle {

// The threads of a bake while it lives. oneTBB ends the process where one of its threads cannot
// start another (2021.8: private_worker::run is noexcept and launches), and so whether as many can
// be started is tried before; else it gets as many as could.
class Threads {
  public:
    // asked: 0 is as many as oneTBB takes, which is also the most.
    explicit Threads(int asked);

    int wanted = 1, count = 1;  // with the caller's

  private:
    std::optional<tbb::global_control> limit;
};

}  // namespace raybundle
