// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tbb/global_control.h>

#include <optional>

namespace raybundle {

// The number of threads of a bake. oneTBB ends the process if one of its threads cannot start
// another one (2021.8: private_worker::run is noexcept and starts the thread). The constructor
// therefore tries how many threads can be started, and limits oneTBB to that number for the
// lifetime of the object.
class Threads {
  public:
    // Finds how many threads can be used. `asked` is the setting: at most that many, or as many as
    // oneTBB allows if it is 0. Throws std::bad_alloc if oneTBB could not be initialised.
    explicit Threads(int asked);

    // Threads that the bake was to use, and threads that it can use. Both include the calling
    // thread.
    int wanted = 1, count = 1;

  private:
    std::optional<tbb::global_control> limit;
};

}  // namespace raybundle
