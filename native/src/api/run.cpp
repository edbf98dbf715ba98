// SPDX-License-Identifier: GPL-3.0-or-later
#include <atomic>
#include <exception>
#include <optional>
#include <thread>

#include "api/border.h"
#include "bake/bake.h"
#include "bake/interim.h"

using namespace raybundle;

namespace {

// A bake that runs in a thread of its own. The bake and the scene are in use until it has ended.
class Run {
  public:
    Run(rb_bake bakeHandle, rb_scene sceneHandle)
        : bake(std::in_place, bakeHandle, "bake"), scene(std::in_place, sceneHandle, "scene") {
        thread = std::thread([this] { work(); });
    }
    ~Run() {
        isCancelled = true;
        if (thread.joinable()) thread.join();
    }

    void cancel() { isCancelled = true; }
    // Waits for the end. Throws what the bake has thrown.
    void finish() {
        if (thread.joinable()) thread.join();
        if (thrown) std::rethrow_exception(thrown);
    }
    rb_run_state state() const {
        return {0, isRunning, stage, fraction, interim.noise(), interim.count()};
    }
    Interim& interimLight() { return interim; }

  private:
    void work() noexcept {
        Bake& baked = **bake;
        const Progress callers = baked.progress;
        baked.progress = Progress(&Run::note, this);
        // A draft ends before anyone could look at less than it.
        baked.interim = baked.settings.draft ? nullptr : &interim;
        try {
            baked.run(**scene);
        } catch (...) {
            thrown = std::current_exception();
        }
        baked.progress = callers;
        baked.interim = nullptr;
        scene.reset();
        bake.reset();
        isRunning = false;
    }
    // The progress function. `user` is the Run.
    static bool note(void* user, rb_stage stage, double fraction) {
        Run& run = *static_cast<Run*>(user);
        run.stage = stage;
        run.fraction = fraction;
        return !run.isCancelled;
    }

    std::optional<HeldBake> bake;
    std::optional<HeldScene> scene;
    Interim interim;
    std::atomic<bool> isRunning{true}, isCancelled{false};
    std::atomic<rb_stage> stage{RB_STAGE_PATCHES};
    std::atomic<double> fraction{0};
    std::exception_ptr thrown;
    std::thread thread;  // the last member: it uses all others
};

using Runs = Handles<rb_run, Run>;
using HeldRun = Held<rb_run, Run>;

}  // namespace

rb_error rb_start_bake(rb_bake bake, rb_scene scene, rb_run* run) {
    return guarded([&] {
        need(run, "run");
        *run = Runs::add(std::make_unique<Run>(bake, scene));
    });
}

rb_error rb_get_run_state(rb_run run, rb_run_state* state) {
    return guarded([&] {
        const HeldRun held(run, "run");
        fillStruct(state, held->state(), "state");
    });
}

rb_error rb_get_run_light(rb_run run, int32_t instance, rb_output output, float* rgb,
                          size_t count) {
    return guarded([&] {
        const HeldRun held(run, "run");
        copyLight(held->interimLight().read(instance, output), rgb, count);
    });
}

rb_error rb_cancel_run(rb_run run) {
    return guarded([&] { HeldRun(run, "run")->cancel(); });
}

rb_error rb_finish_run(rb_run run) {
    return guarded([&] { HeldRun(run, "run")->finish(); });
}

void rb_release_run(rb_run run) { Runs::release(run); }
