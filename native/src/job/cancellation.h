// SPDX-License-Identifier: GPL-3.0-or-later
//
// Cancellation of a bake at any point. All work of a bake runs under one oneTBB task group context.
// The thread that started the bake reports its progress to the caller, and cancels the context when
// the caller asks for it. Loops check the context: parallel loops do so by themselves between two
// pieces of work, and long serial loops call throwIfCancelled().
#pragma once

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_group.h>

#include <functional>
#include <utility>

#include "job/error.h"
#include "job/progress.h"

namespace raybundle {

// Throws Error(CANCELLED) if the calling thread works for a bake that has been cancelled. Takes a
// few nanoseconds.
inline void throwIfCancelled() {
    if (tbb::is_current_task_group_canceling())
        throw Error(RB_ERROR_CANCELLED, "the bake was cancelled");
}

// Calls throwIfCancelled() if `step` is a multiple of 1024. For each step of a long serial loop.
inline void throwIfCancelledAt(size_t step) {
    if (step % 1024 == 0) throwIfCancelled();
}

// Calls tbb::parallel_for. If the bake is cancelled, pieces of work that have not begun are left
// out and Error(CANCELLED) is thrown.
template <class... Arguments>
void parallelFor(Arguments&&... arguments) {
    tbb::parallel_for(std::forward<Arguments>(arguments)...);
    throwIfCancelled();
}
// Calls tbb::parallel_invoke. If the bake is cancelled, bodies that have not begun are left out and
// Error(CANCELLED) is thrown.
template <class... Bodies>
void parallelInvoke(const Bodies&... bodies) {
    tbb::parallel_invoke(bodies...);
    throwIfCancelled();
}

// Whether work was cancelled, and where: BETWEEN_STEPS if the caller did so in answer to a progress
// report of the work, which leaves its data complete; ANYWHERE if the caller did so between two
// reports, or if the work could not go on, which may leave its data half-made.
enum class Cancelled { NO, BETWEEN_STEPS, ANYWHERE };

// Work that can be cancelled. It reports to `progress` and must run its parallel loops under
// `context`.
using Work = std::function<void(const Progress& progress, tbb::task_group_context& context)>;
// Runs `work` in a thread of its own. Meanwhile the calling thread passes the reports of the work
// on to `progress`, and repeats the last one every 20 ms, so that the caller can cancel at any
// time. At least as often, it asks `mayGoOn`, and cancels the work if the answer is false. Returns
// whether and where the work was cancelled. Throws what `work` throws, unless it was cancelled. If
// no thread can be started, `work` runs in the calling thread, and nobody asks `mayGoOn`.
Cancelled runCancellable(const Progress& progress, const std::function<bool()>& mayGoOn,
                         const Work& work);

}  // namespace raybundle
