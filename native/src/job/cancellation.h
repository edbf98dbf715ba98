// SPDX-License-Identifier: GPL-3.0-or-later
//
// Stopping a bake wherever it is. All that a bake does runs under one context of oneTBB; the thread
// that asked for the bake tells the caller how far it is, and cancels that context where the caller
// wants to stop. Loops look whether it is: the parallel ones do by themselves, between two pieces
// of work, and those that take long in one thread by throwIfCancelled().
#pragma once

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_group.h>

#include <functional>
#include <utility>

#include "job/error.h"
#include "job/progress.h"

namespace raybundle {

// Throws Error(CANCELLED) if what the calling thread does is part of a bake that is to stop. Takes
// some nanoseconds.
inline void throwIfCancelled() {
    if (tbb::is_current_task_group_canceling())
        throw Error(RB_ERROR_CANCELLED, "the bake was cancelled");
}

// The same at every 1024th step of a loop.
inline void throwIfCancelledAt(size_t step) {
    if (step % 1024 == 0) throwIfCancelled();
}

// As in oneTBB. Where the bake is to stop they leave out what is not begun, and throw.
template <class... Arguments>
void parallelFor(Arguments&&... arguments) {
    tbb::parallel_for(std::forward<Arguments>(arguments)...);
    throwIfCancelled();
}
template <class... Bodies>
void parallelInvoke(const Bodies&... bodies) {
    tbb::parallel_invoke(bodies...);
    throwIfCancelled();
}

enum class Cancelled { NO, BETWEEN_STEPS, ANYWHERE };

// Runs `work` in a thread of its own, with a progress to report to and a context that is cancelled,
// while the calling thread passes the reports on to `progress`, and repeats what came last every 20
// ms. Where the caller stops the work at a report it ends between two steps, else anywhere: what it
// works on may then be half-made. Throws what the work throws. Where no thread can be started, or
// nobody wants to know, the work runs in the calling one.
using Work = std::function<void(const Progress& progress, tbb::task_group_context& context)>;
Cancelled runCancellable(const Progress& progress, const Work& work);

}  // namespace raybundle
