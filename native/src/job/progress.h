// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "job/error.h"
#include "raybundle/raybundle.h"

namespace raybundle {

// Reports the progress of a bake to the caller and lets the caller cancel. A Progress made by the
// default constructor reports to nobody. Call its functions only from the thread that runs the
// bake. Copies report to the same function.
class Progress {
  public:
    Progress() = default;
    // Reports to `function` with its argument `user`. Both must outlive the Progress and its
    // copies.
    Progress(rb_progress_function function, void* user) : function(function), user(user) {}

    // Reports the completed share (0 to 1) of a stage. Throws Error(CANCELLED) if the caller
    // cancels.
    void report(rb_stage stage, double fraction) const {
        if (!tell(stage, fraction)) throw Error(RB_ERROR_CANCELLED, "the bake was cancelled");
    }
    // Reports the completed share (0 to 1) of a stage. Returns false if the caller cancels.
    bool tell(rb_stage stage, double fraction) const {
        return !function || function(user, stage, begin + share * fraction);
    }
    // Returns whether there is a progress function to report to.
    bool isHeard() const { return function != nullptr; }

    // Returns a Progress whose range 0 to 1 is the part k (from 0) of n equal parts of this one.
    Progress part(size_t k, size_t n) const {
        return between(double(k) / double(n), double(k + 1) / double(n));
    }
    // Returns a Progress whose range 0 to 1 is the range `from` to `to` of this one.
    Progress between(double from, double to) const {
        Progress progress = *this;
        progress.begin = begin + from * share;
        progress.share = (to - from) * share;
        return progress;
    }

  private:
    rb_progress_function function = nullptr;
    void* user = nullptr;
    // The part of the stage that this Progress covers: where it begins, and its length.
    double begin = 0, share = 1;
};

}  // namespace raybundle
