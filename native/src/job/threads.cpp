// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/threads.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <exception>
#include <future>
#include <mutex>
#include <new>
#include <thread>
#include <vector>

namespace raybundle {
namespace {

// Initialises oneTBB at the first call. Returns false if there was not enough memory.
bool isPrepared() noexcept {
    static const bool is = [] {
        try {
            tbb::task_arena().initialize();
            return tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism) >
                   0;
        } catch (const std::bad_alloc&) {
            return false;
        }
    }();
    return is;
}

#ifndef _WIN32
// Makes this call when the library is loaded, before there is a scene that could take the memory.
// Running out of memory at the first use would be fatal for two reasons. oneTBB counts the
// processors at its first use, and if that throws, every later use waits forever (2021.8:
// atomic_do_once stays pending when its function throws). oneTBB also looks for its own libraries
// then, and glibc ends the process if there is no memory to report a missing one.
//
// Not in Windows: MinGW's libraries run their initialisers backwards, those of oneTBB after this
// one, and Windows holds a lock meanwhile that a new thread would wait for.
[[maybe_unused]] const bool isPreparedEarly = isPrepared();
#endif

// Returns how many of `wanted` threads can exist at once, the caller's included, by starting as
// many. The largest number reached is remembered and not tried again, because oneTBB keeps the
// threads that it has.
int startable(int wanted) {
    static std::mutex mutex;
    static int known = 1;
    const std::lock_guard lock(mutex);
    if (wanted <= known) return wanted;
    std::promise<void> end;
    const std::shared_future<void> ended = end.get_future().share();
    std::vector<std::thread> threads;
    try {
        while (int(threads.size()) + 1 < wanted) threads.emplace_back([ended] { ended.wait(); });
    } catch (const std::exception&) {
        // The system allows no more threads, or there is no memory for them.
    }
    end.set_value();
    for (std::thread& thread : threads) thread.join();
    const int count = int(threads.size()) + 1;
    known = std::max(known, count);
    return count;
}

}  // namespace

Threads::Threads(int asked) {
    if (!isPrepared()) throw std::bad_alloc();
    const int most =
        int(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
    wanted = asked > 0 ? std::min(asked, most) : most;
    count = startable(wanted);
    if (count < wanted) limit.emplace(tbb::global_control::max_allowed_parallelism, size_t(count));
}

}  // namespace raybundle
