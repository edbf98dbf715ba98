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

// oneTBB counts the processors at its first use, and where memory runs out in that, every later use
// waits forever (2021.8: atomic_do_once stays pending when what it runs throws); and it looks for
// libraries of its own, in which glibc ends the process where there is no memory to say that there
// is none. So both are done when the library is loaded, before there is a scene that could take the
// memory.
bool prepare() noexcept {
    try {
        tbb::task_arena().initialize();
        return tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism) > 0;
    } catch (const std::bad_alloc&) {
        return false;
    }
}
const bool isPrepared = prepare();

// Starts threads until there are as many at once, with the caller's, or no more can be. oneTBB
// keeps those that it has, so that what went once is not tried again.
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
        // No more threads, or no memory for them.
    }
    end.set_value();
    for (std::thread& thread : threads) thread.join();
    const int count = int(threads.size()) + 1;
    known = std::max(known, count);
    return count;
}

}  // namespace

Threads::Threads(int asked) {
    if (!isPrepared) throw std::bad_alloc();
    const int most =
        int(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
    wanted = asked > 0 ? std::min(asked, most) : most;
    count = startable(wanted);
    if (count < wanted) limit.emplace(tbb::global_control::max_allowed_parallelism, size_t(count));
}

}  // namespace raybundle
