// SPDX-License-Identifier: GPL-3.0-or-later
//
// Checks that a bake survives running out of memory at any point. Bakes run out of memory at their
// first allocation, at their second, and so on to their last, on any thread, either for that
// allocation alone or for all allocations after it as well. Each bake must return an error, keep
// the results of the previous run and work again afterwards. If the failed allocation can be done
// without, the bake must give the right light instead.
//
//   allocation_faults [STEP [FIRST]]
//
// Lets every STEP-th allocation fail (default 1), from the FIRST-th on (default 0). Each series of
// bakes begins a few allocations after the one before, so that they reach others.
//
// The program replaces malloc and related functions of the C library, and mmap, for all libraries,
// so that allocations of oneTBB, its allocator and Embree fail too. Each failing allocation has a
// process of its own, so that any damage is noticed and does not reach the next one. With a STEP of
// 1, allocations also fail in the first bake of a process, which starts oneTBB.
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "fault_room.h"

namespace {

enum Way { MALLOC, CALLOC, REALLOC, ALIGNED, MMAP, WAYS };
constexpr std::array<const char*, WAYS> kWays{"malloc", "calloc", "realloc", "aligned", "mmap"};

std::atomic<bool> isBaking{false};  // allocations are counted, and can fail, only while this is set
std::atomic<int64_t> untilFault{0};  // allocations before the failing one; below 0 after it
bool stays = false;                  // whether all allocations after the failing one fail too

// Memory that a process shares with the process that started it.
struct Told {
    std::array<float, 2 * 72> wanted;  // the right light
    Way failed;                        // kind of the allocation that failed last
};
Told* told = nullptr;

// A separate function, so that a debugger can stop in it.
[[gnu::noinline]] bool fail(Way way) {
    told->failed = way;
    errno = ENOMEM;
    return true;
}

bool isFault(Way way) {
    if (!isBaking.load()) return false;
    const int64_t left = untilFault.fetch_sub(1);
    return (left == 0 || (stays && left < 0)) && fail(way);
}

}  // namespace

extern "C" {

void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* memory, size_t size);
void* __libc_memalign(size_t alignment, size_t size);

void* malloc(size_t size) noexcept { return isFault(MALLOC) ? nullptr : __libc_malloc(size); }
void* calloc(size_t count, size_t size) noexcept {
    return isFault(CALLOC) ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* memory, size_t size) noexcept {
    return isFault(REALLOC) ? nullptr : __libc_realloc(memory, size);
}
void* memalign(size_t alignment, size_t size) noexcept {
    return isFault(ALIGNED) ? nullptr : __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) noexcept { return memalign(alignment, size); }
void* valloc(size_t size) noexcept { return memalign(size_t(sysconf(_SC_PAGESIZE)), size); }
int posix_memalign(void** memory, size_t alignment, size_t size) noexcept {
    void* const found = memalign(alignment, size);
    if (!found) return ENOMEM;
    *memory = found;
    return 0;
}
void* mmap(void* at, size_t size, int protection, int flags, int file, off_t offset) noexcept {
    if (isFault(MMAP)) return MAP_FAILED;
    return reinterpret_cast<void*>(syscall(SYS_mmap, at, size, protection, flags, file, offset));
}
void* mmap64(void* at, size_t size, int protection, int flags, int file, off64_t offset) noexcept {
    return mmap(at, size, protection, flags, file, offset);
}
void* mremap(void* at, size_t size, size_t wanted, int flags, ...) noexcept {
    if (isFault(MMAP)) return MAP_FAILED;
    va_list rest;
    va_start(rest, flags);
    void* const to = flags & MREMAP_FIXED ? va_arg(rest, void*) : nullptr;
    va_end(rest);
    return reinterpret_cast<void*>(syscall(SYS_mremap, at, size, wanted, flags, to));
}

}  // extern "C"

namespace {

using namespace raybundle::test;

// How a process ends: with the right error; with the right light; before it reached the allocation;
// wrong.
enum Outcome { FAILED_WELL, DID_WITHOUT, NOT_REACHED, WRONG };

constexpr int64_t kNextSeries = 7;  // allocations from the first of a series to that of the next
constexpr unsigned kHangs = 60;     // time limit, s; a bake takes some hundredths of a second

bool holds(bool condition, const char* what, int64_t at) {
    if (!condition)
        std::printf("allocation %lld, by %s: %s (%s)\n", (long long)at, kWays[told->failed], what,
                    rb_get_error_message());
    std::fflush(stdout);
    return condition;
}

// How a bake runs: while the caller waits, or in a thread of the library, which also makes light to
// look at.
enum class Mode { WAITED_FOR, IN_BACKGROUND };

rb_error runBake(rb_bake bake, rb_scene scene, Mode mode) {
    if (mode == Mode::WAITED_FOR) return rb_execute_bake(bake, scene);
    rb_run run = nullptr;
    const rb_error started = rb_start_bake(bake, scene, &run);
    if (started != RB_ERROR_NONE) return started;
    const rb_error error = rb_finish_run(run);
    rb_release_run(run);
    return error;
}

// Bakes while one allocation fails. `isFirst` is whether this is the first bake of the process,
// `at` the number of the allocation.
Outcome bakeWithFault(const char* reconstruction, Mode mode, bool isFirst, int64_t at) {
    alarm(kHangs);
    const std::vector<float> wanted(told->wanted.begin(), told->wanted.end());
    const rb_scene first = roomOf(10), second = roomOf(20);
    const rb_bake bake = newBake(reconstruction);
    std::vector<float> before;
    if (!isFirst) {
        // The bake with the failing allocation replaces these results.
        if (!holds(rb_execute_bake(bake, first) == RB_ERROR_NONE, "the run before failed", at))
            return WRONG;
        before = lightOf(bake);
        rb_set_bake_int(bake, "skip.geometry", 0);  // so that all stages run again
    }
    untilFault = at;
    isBaking = true;
    const rb_error error = runBake(bake, second, mode);
    isBaking = false;
    const bool wasReached = untilFault < 0;
    bool isRight = true;
    if (!wasReached || error == RB_ERROR_NONE) {
        isRight = holds(error == RB_ERROR_NONE, "a bake with memory failed", at) &&
                  holds(isLike(lightOf(bake), wanted), "another light with less memory", at);
    } else {
        const char* report = nullptr;
        isRight = holds(error == RB_ERROR_OUT_OF_MEMORY, "not RB_ERROR_OUT_OF_MEMORY", at) &&
                  holds(*rb_get_error_message(), "no message", at) &&
                  (isFirst ? holds(rb_get_report(bake, &report) != RB_ERROR_NONE,
                                   "a result without a bake", at)
                           : holds(lightOf(bake) == before, "the results before are gone", at));
    }
    // Bakes once with the lines that are left, and once without.
    for (int reuse : {1, 0}) {
        rb_set_bake_int(bake, "skip.geometry", reuse);
        isRight = isRight &&
                  holds(rb_execute_bake(bake, second) == RB_ERROR_NONE, "no recovery", at) &&
                  holds(isLike(lightOf(bake), wanted), "another light after recovery", at);
    }
    rb_release_bake(bake);
    rb_release_scene(first);
    rb_release_scene(second);
    return !isRight                 ? WRONG
           : !wasReached            ? NOT_REACHED
           : error == RB_ERROR_NONE ? DID_WITHOUT
                                    : FAILED_WELL;
}

// Runs `run` in a process of its own and returns its outcome. Returns WRONG if the process cannot
// be started or ends by a signal.
template <class Run>
Outcome inProcess(const Run& run, int64_t at) {
    std::fflush(stdout);
    const pid_t child = fork();
    if (child == 0) _exit(run());
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child) return WRONG;
    if (WIFEXITED(status)) return Outcome(WEXITSTATUS(status));
    std::printf("allocation %lld, by %s: ended by signal %d\n", (long long)at, kWays[told->failed],
                WTERMSIG(status));
    return WRONG;
}

// Lets every `step`-th allocation fail in turn. Returns whether all bakes ended well.
bool failEach(const char* reconstruction, Mode mode, bool isFirst, int64_t step, int64_t from) {
    const auto bakeWell = [&] {
        const rb_scene room = roomOf(20);
        const rb_bake bake = newBake(reconstruction);
        if (rb_execute_bake(bake, room) != RB_ERROR_NONE) return WRONG;
        const std::vector<float> light = lightOf(bake);
        std::copy(light.begin(), light.end(), told->wanted.begin());
        return NOT_REACHED;
    };
    if (inProcess(bakeWell, -1) != NOT_REACHED) return false;

    std::array<int64_t, 4> ended{};
    std::array<int64_t, WAYS> ways{};
    for (int64_t at = from; ended[NOT_REACHED] == 0; at += step) {
        ++ended[inProcess([&] { return bakeWithFault(reconstruction, mode, isFirst, at); }, at)];
        ++ways[told->failed];
    }
    std::printf(
        "%s%s, %s, %s: %lld failed with an error, %lld were done without, %lld went wrong (",
        reconstruction, mode == Mode::IN_BACKGROUND ? " in the background" : "",
        isFirst ? "the first bake" : "a later bake",
        stays ? "an allocation and all after it" : "one allocation", (long long)ended[FAILED_WELL],
        (long long)ended[DID_WITHOUT], (long long)ended[WRONG]);
    for (size_t way = 0; way < WAYS; ++way)
        std::printf("%s%s %lld", way ? ", " : "", kWays[way], (long long)ways[way]);
    std::printf(")\n");
    return ended[WRONG] == 0;
}

}  // namespace

int main(int count, char** arguments) {
    void* const shared =
        mmap(nullptr, sizeof(Told), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) return 1;
    told = static_cast<Told*>(shared);
    const int64_t step = count > 1 ? std::max(1, std::atoi(arguments[1])) : 1;
    const int64_t from = count > 2 ? std::max(0, std::atoi(arguments[2])) : 0;
    bool isWell = true;
    // Each series begins at another allocation, so that together they reach more of them.
    int64_t first = from;
    const auto runSeries = [&](const char* reconstruction, Mode mode, bool isFirst) {
        isWell = failEach(reconstruction, mode, isFirst, step, first) && isWell;
        first = from + (first - from + kNextSeries) % step;
    };
    for (bool all : {false, true}) {
        stays = all;
        for (bool isFirst : {true, false}) {
            if (isFirst && step != 1) continue;
            for (const char* reconstruction : {"LEAST_SQUARES", "POINT"})
                runSeries(reconstruction, Mode::WAITED_FOR, isFirst);
            runSeries("LEAST_SQUARES", Mode::IN_BACKGROUND, isFirst);
        }
    }
    return isWell ? 0 : 1;
}
