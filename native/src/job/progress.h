// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "job/error.h"
#include "raybundle/raybundle.h"

namespace raybundle {

// Tells the caller which stage of a bake runs and how far it is, and lets the caller cancel. Used
// from the thread that runs the bake alone.
class Progress {
  public:
    Progress() = default;
    Progress(rb_progress_function function, void* user) : function(function), user(user) {}

    // Reports the share (0 to 1) of a stage that is done. Throws Error(CANCELLED) if the caller
    // wants to stop.
    void report(rb_stage stage, double fraction) const {
        if (!tell(stage, fraction)) throw Error(RB_ERROR_CANCELLED, "the bake was cancelled");
    }
    // The same; returns whether the caller wants to go on.
    bool tell(rb_stage stage, double fraction) const {
        return !function || function(user, stage, begin + share * fraction);
    }
    // Whether there is anyone to report to.
    bool isHeard() const { return function != nullptr; }

    // For the k-th of n equal parts of what a stage does.
    Progress part(size_t k, size_t n) const {
        Progress progress = *this;
        progress.share = share / double(n);
        progress.begin = begin + double(k) * progress.share;
        return progress;
    }

  private:
    rb_progress_function function = nullptr;
    void* user = nullptr;
    double begin = 0, share = 1;
};

}  // namespace raybundle
