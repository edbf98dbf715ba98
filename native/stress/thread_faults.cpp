// SPDX-License-Identifier: GPL-3.0-or-later
//
// Checks that a bake for which the system starts fewer threads than asked for gives the right light
// with the threads that it gets, and warns. It asks for four threads, beside the calling one, which
// watches them, and gets 0 to 4. If it gets none, the calling one computes.
//
// The program replaces pthread_create. Each number of threads has a process of its own, since
// oneTBB keeps the threads that it has started.
#include <dlfcn.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "fault_room.h"

namespace {

constexpr int kAsked = 4;

// Number of running threads without the first one, and the number beyond which no thread starts.
std::atomic<int> running{0}, most{1000};

struct Start {
    void* (*routine)(void*);
    void* argument;
};

void* run(void* start) {
    const Start copy = *static_cast<Start*>(start);
    delete static_cast<Start*>(start);
    void* result = copy.routine(copy.argument);
    --running;
    return result;
}

}  // namespace

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*routine)(void*), void* argument) {
    using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
    static const Create create = reinterpret_cast<Create>(dlsym(RTLD_NEXT, "pthread_create"));
    if (++running > most) {
        --running;
        return EAGAIN;
    }
    return create(thread, attributes, run, new Start{routine, argument});
}

namespace {

using namespace raybundle::test;

// Bakes while at most `threads` threads can be started. The first bake writes its light to `light`;
// the light of others must be equal to it. Returns 0 if all is right, else the number of the check
// that failed.
int bakeWith(int threads, float* light, bool isFirst) {
    // Largest number of threads of oneTBB, independent of the number of cores.
    const tbb::global_control cores(tbb::global_control::max_allowed_parallelism, kAsked);
    const rb_scene room = roomOf(10);
    const rb_bake bake = newBake("LEAST_SQUARES");
    rb_set_bake_int(bake, "threads", isFirst ? 1 : kAsked);
    most = threads;
    for (int k = 0; k < 3; ++k) {
        if (rb_execute_bake(bake, room) != RB_ERROR_NONE) return 1;
        const std::vector<float> found = lightOf(bake);
        if (isFirst) std::copy(found.begin(), found.end(), light);
        if (!isLike(found, {light, light + found.size()})) return 2;
        const char* report = "";
        rb_get_report(bake, &report);
        const bool isSaid = std::strstr(report, "FEWER_THREADS") != nullptr;
        if (isSaid != (!isFirst && threads < kAsked)) return 3;
        rb_set_bake_int(bake, "skip.geometry", 0);  // so that all stages run again
    }
    return 0;
}

}  // namespace

int main() {
    void* const shared =
        mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) return 1;
    // The first bake asks for one thread only, and gives the light that the others are compared
    // with.
    constexpr int kFirst = -1;
    for (int threads : {kFirst, 0, 1, 2, 3, kAsked}) {
        const bool isFirst = threads == kFirst;
        const pid_t child = fork();
        if (child == 0)
            _exit(bakeWith(isFirst ? 1 : threads, static_cast<float*>(shared), isFirst));
        int status = -1;
        if (child < 0 || waitpid(child, &status, 0) != child || status != 0) {
            std::printf("%d threads of %d: failed, status %x\n", threads, kAsked, unsigned(status));
            return 1;
        }
        if (!isFirst) std::printf("%d threads of %d: the light of one\n", threads, kAsked);
    }
    return 0;
}
