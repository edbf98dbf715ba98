// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>

namespace raybundle {

// Adds the time from its construction to its destruction to `seconds`, which must outlive it.
class Stopwatch {
  public:
    explicit Stopwatch(double& seconds) : seconds(seconds), start(Clock::now()) {}
    Stopwatch(const Stopwatch&) = delete;
    ~Stopwatch() { seconds += std::chrono::duration<double>(Clock::now() - start).count(); }

  private:
    using Clock = std::chrono::steady_clock;
    double& seconds;
    const Clock::time_point start;
};

}  // namespace raybundle
