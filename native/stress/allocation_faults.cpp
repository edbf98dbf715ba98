// SPDX-License-Identifier: GPL-3.0-or-later
//
// A bake that runs out of memory at its first allocation, at its second, and so on to its last, on
// whichever thread: each time it must say so, keep the results of the run before, and be as good as
// new afterwards.
//
//   allocation_faults [STEP]     fails every STEP-th allocation (1)
//
// Operator new is replaced; what TBB and Embree take by malloc does not fail here.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <vector>

#include "fault_room.h"

namespace {

// Counts down while a bake runs; the allocation that reaches 0 fails. Negative: none does.
std::atomic<int64_t> untilFault{-1};
std::atomic<int64_t> allocations{0};

void* allocate(size_t size, size_t alignment) {
    ++allocations;
    if (untilFault.load() >= 0 && untilFault.fetch_sub(1) == 0) throw std::bad_alloc();
    void* memory =
        alignment > alignof(std::max_align_t)
            ? std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment)
            : std::malloc(size ? size : 1);
    if (!memory) throw std::bad_alloc();
    return memory;
}

}  // namespace

void* operator new(size_t size) { return allocate(size, 0); }
void* operator new[](size_t size) { return allocate(size, 0); }
void* operator new(size_t size, std::align_val_t alignment) {
    return allocate(size, size_t(alignment));
}
void* operator new[](size_t size, std::align_val_t alignment) {
    return allocate(size, size_t(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, size_t, std::align_val_t) noexcept { std::free(memory); }

namespace {

using namespace raybundle::test;

void require(bool holds, const char* what, int64_t at) {
    if (holds) return;
    std::printf("allocation %lld: %s (%s)\n", (long long)at, what, rb_get_error_message());
    std::exit(1);
}

// Returns how many allocations were made to fail.
int64_t failEach(const char* reconstruction, int64_t step) {
    const rb_scene first = roomOf(10), second = roomOf(20);
    rb_bake bake = newBake(reconstruction);
    require(rb_execute_bake(bake, second) == RB_ERROR_NONE, "no bake", 0);
    const std::vector<float> secondLight = lightOf(bake);
    rb_release_bake(bake);

    int64_t failed = 0;
    for (int64_t at = 0;; at += step) {
        // The results of a first run, which another one replaces.
        bake = newBake(reconstruction);
        require(rb_execute_bake(bake, first) == RB_ERROR_NONE, "the run before failed", at);
        rb_set_bake_int(bake, "skip.geometry", 0);  // all of it, not a relighting
        const std::vector<float> before = lightOf(bake);
        untilFault = at;
        const rb_error error = rb_execute_bake(bake, second);
        const bool wasReached = untilFault.exchange(-1) < 0;
        if (!wasReached) {
            require(error == RB_ERROR_NONE, "a bake with memory failed", at);
            rb_release_bake(bake);
            break;
        }
        // Where it does without what it asked for, the result is right.
        if (error == RB_ERROR_NONE) {
            require(isLike(lightOf(bake), secondLight), "another light with less memory", at);
        } else {
            ++failed;
            require(error == RB_ERROR_OUT_OF_MEMORY, "not RB_ERROR_OUT_OF_MEMORY", at);
            require(*rb_get_error_message(), "no message", at);
            require(lightOf(bake) == before, "the results of the run before are gone", at);
        }
        require(rb_execute_bake(bake, second) == RB_ERROR_NONE, "it does not recover", at);
        require(isLike(lightOf(bake), secondLight), "another light after recovery", at);
        rb_release_bake(bake);
    }
    rb_release_scene(first);
    rb_release_scene(second);
    return failed;
}

}  // namespace

int main(int count, char** arguments) {
    const int64_t step = count > 1 ? std::max(1, std::atoi(arguments[1])) : 1;
    for (const char* reconstruction : {"LEAST_SQUARES", "POINT"})
        std::printf(
            "%s: %lld allocations failed, each with an error, results kept, and recovered\n",
            reconstruction, (long long)failEach(reconstruction, step));
    return 0;
}
