// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/cancellation.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>

namespace raybundle {
namespace {

// The interval at which the calling thread repeats the last progress report, so that the caller can
// cancel between two reports, and asks whether the work may go on.
constexpr std::chrono::milliseconds kEvery(20);

// State shared by the thread that works and the calling thread, which passes reports to the caller.
class Watch {
  public:
    Watch(const Progress& progress, const std::function<bool()>& mayGoOn)
        : progress(progress), mayGoOn(mayGoOn) {}

    // Progress function of the working thread: stores the report and waits until the calling thread
    // has passed it on. Returns false if the bake was cancelled. `user` is the Watch.
    static bool ask(void* user, rb_stage stage, double fraction) {
        Watch& watch = *static_cast<Watch*>(user);
        std::unique_lock lock(watch.mutex);
        watch.last = {stage, fraction};
        watch.isAsked = watch.isBegun = true;
        watch.changed.notify_all();
        watch.changed.wait(lock, [&] { return !watch.isAsked; });
        return watch.cancelled == Cancelled::NO;
    }

    // Runs `body` in the working thread and stores the exception that it throws, if any.
    void work(const Work& body) {
        try {
            body(progress.isHeard() ? Progress(&Watch::ask, this) : progress, context);
        } catch (...) {
            thrown = std::current_exception();
        }
        std::unique_lock lock(mutex);
        isDone = true;
        changed.notify_all();
    }

    // Passes reports to the caller until the work is done. Returns whether and where it was
    // cancelled. Rethrows the exception of the work unless it was.
    Cancelled answer() {
        std::unique_lock lock(mutex);
        while (!isDone) {
            const bool isDue = !changed.wait_for(lock, kEvery, [&] { return isAsked || isDone; });
            if (!isDone && cancelled == Cancelled::NO && !mayGoOn()) {
                cancelled = Cancelled::ANYWHERE;
                context.cancel_group_execution();
            }
            if (isDone || (isDue && !isBegun) || cancelled != Cancelled::NO) {
                isAsked = false;
                changed.notify_all();
                continue;
            }
            const auto [stage, fraction] = last;
            const bool wasAsked = isAsked;
            lock.unlock();
            const bool goesOn = progress.tell(stage, fraction);
            lock.lock();
            if (!goesOn) {
                cancelled = wasAsked ? Cancelled::BETWEEN_STEPS : Cancelled::ANYWHERE;
                if (!wasAsked) context.cancel_group_execution();
            }
            if (wasAsked) isAsked = false;
            changed.notify_all();
        }
        if (thrown && cancelled == Cancelled::NO) std::rethrow_exception(thrown);
        return cancelled;
    }

  private:
    const Progress& progress;
    const std::function<bool()>& mayGoOn;
    tbb::task_group_context context;
    std::mutex mutex;
    std::condition_variable changed;
    std::pair<rb_stage, double> last{RB_STAGE_PATCHES, 0};
    bool isAsked = false, isBegun = false, isDone = false;
    Cancelled cancelled = Cancelled::NO;
    std::exception_ptr thrown;
};

// Joins the thread when the scope ends, also by an exception.
struct Joined {
    std::thread& thread;
    ~Joined() { thread.join(); }
};

}  // namespace

Cancelled runCancellable(const Progress& progress, const std::function<bool()>& mayGoOn,
                         const Work& work) {
    Watch watch(progress, mayGoOn);
    std::thread thread;
    try {
        thread = std::thread([&] { watch.work(work); });
    } catch (const std::system_error&) {
        tbb::task_group_context untouched;
        work(progress, untouched);
        return Cancelled::NO;
    }
    const Joined joined{thread};
    return watch.answer();
}

}  // namespace raybundle
