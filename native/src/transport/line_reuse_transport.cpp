// SPDX-License-Identifier: GPL-3.0-or-later
//
// LINE_REUSE as a transport. While bundles are traced, their lines are only counted. Light moves
// when the system on the counts is solved (transport/line_reuse.h). When the counts would exceed
// their share of the memory limit, they are dropped, and each further bundle improves the solution
// by itself (transport/streaming_reuse.h). Light sets share the lines: the transport of one light
// set traces them, and advances the transports of the others.

#include <algorithm>
#include <array>
#include <glm/gtc/constants.hpp>
#include <optional>

#include "job/cancellation.h"
#include "job/memory.h"
#include "patches/side.h"
#include "surfaces/translucence.h"
#include "transport/line_reuse.h"
#include "transport/streaming_reuse.h"
#include "transport/transport.h"

namespace raybundle {
namespace {

// Sides that fewer lines met than this also gather with local rays.
constexpr uint32_t kStarvedLines = 16;
// Limits for the traced lines that are held before they are merged into the counts: in bytes, and
// as a share of the memory for the counts.
constexpr size_t kMergeBytes = size_t(256) << 20;
constexpr double kMergeShare = 0.25;
// Number of bundles between two checks of the cancel flag.
constexpr uint32_t kStep = 16;
// Relative tolerance of the solution from which streaming starts.
constexpr float kStartTolerance = 1e-4f;

std::vector<glm::vec3> meanOf(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    std::vector<glm::vec3> mean(std::min(a.size(), b.size()));
    for (size_t i = 0; i < mean.size(); ++i) mean[i] = 0.5f * (a[i] + b[i]);
    return mean;
}

class LineReuseTransport : public Transport {
  public:
    explicit LineReuseTransport(const TransportInput& input)
        : input(input),
          solver(input.patches, input.counts, input.shot, input.worldRadiance, input.exposed,
                 input.isShown, {input.settings.targetError, input.settings.draft != 0}),
          limit(MemoryLimit(input.settings.memoryLimit).exchanges),
          own(input.solutions ? 0 : input.patches.sideCount()),
          last(input.solutions ? *input.solutions : own) {}

    // Makes a transport of another light a follower, which from now on gets all lines that this
    // transport traces. The follower must not advance by itself and must live as long as this
    // object.
    void lead(LineReuseTransport& follower) { carriers.push_back(&follower); }

    void advance(uint32_t count, const Progress& progress) override {
        std::vector<TracedBundle> held;
        size_t bytes = 0;
        const size_t mostHeld = std::min(kMergeBytes, size_t(kMergeShare * double(limit)));
        for (uint32_t done = 0; done < count;) {
            progress.report(RB_STAGE_BUNDLES, double(done) / count);
            // Merging needs memory for the old and the new counts at once.
            if (!streaming[0] && held.empty() && input.counts.bundles > 0 &&
                2 * input.counts.byteCount() + mostHeld > limit) {
                for (LineReuseTransport* carrier : carriers) carrier->startStreaming();
                input.counts.dropExchanges();
            }
            const uint32_t step = std::min(kStep, count - done);
            std::vector<TracedBundle> traced = input.tracer.trace(step);
            done += step;
            if (streaming[0]) {
                for (LineReuseTransport* carrier : carriers) carrier->stream(traced);
                input.counts.addTotals(traced);
                continue;
            }
            for (TracedBundle& bundle : traced) {
                bytes += bundle.lines.byteCount();
                held.push_back(std::move(bundle));
            }
            if (bytes > mostHeld || done == count) {
                input.counts.add(held);
                held.clear();
                bytes = 0;
            }
        }
        progress.report(RB_STAGE_BUNDLES, 1);
    }

    uint32_t bundleCount() const override { return input.tracer.bundleCount(); }

    Irradiance irradiance(Half half, float tolerance) override {
        if (streaming[0]) return streamed(half);
        const uint32_t bundles = input.counts.bundles;
        LineSolution& guess = last.of[size_t(half)];
        const bool isOfOthers = guess.bundles != bundles;
        if (isOfOthers) {
            guess.brought.clear();
            guess.lines.reset();
        }
        if (!input.settings.skipWarmStart) {
            std::fill(guess.reflected.begin(), guess.reflected.end(), glm::vec3(0.0f));
            guess.passed.clear();
            guess.brought.clear();
        } else if (half == Half::BOTH && isOfOthers) {
            guess.reflected = meanOf(last.of[0].reflected, last.of[1].reflected);
            guess.passed = meanOf(last.of[0].passed, last.of[1].passed);
        }
        guess.bundles = bundles;
        ++solves;
        if (half != Half::BOTH)
            return solver.solve(half, tolerance, guess, solver.lineWeights(half));
        if (isOfOthers) last.weights = solver.lineWeights(half);
        return solver.solve(half, tolerance, guess, last.weights);
    }

    Irradiance finish(float tolerance, const std::vector<bool>& wanted, Report& report) override {
        Irradiance result = irradiance(Half::BOTH, tolerance);
        // The first solve of each half has no solution to start from.
        if (input.settings.skipWarmStart && solves > 2)
            report.skip(SkippedWork::WARM_STARTS, solves - 2);
        const size_t starved = solver.gatherStarvedSides(
            {input.visibility, input.clusters, kStarvedLines, uint32_t(input.settings.seed)},
            wanted, last.of[size_t(Half::BOTH)].reflected, result);
        if (starved) report.skip(SkippedWork::STARVED_SIDES, starved);
        if (!result.isSettled)
            report.warn(
                WarningId::UNSETTLED_EXCHANGE,
                "the exchange of light did not converge, because some surfaces reflect or transmit "
                "nearly all light. The result may be wrong; reduce the reflectance and the "
                "translucence of surfaces that enclose light to at most 0.9");
        if (streaming[0])
            report.warn(
                WarningId::MEMORY_LIMIT,
                "the half of memory_limit that lines may take was full at " +
                    std::to_string(input.counts.bundles) + " bundles. The other " +
                    std::to_string(bundleCount() - input.counts.bundles) +
                    " bundles were used once and discarded. The result is therefore less precise, "
                    "and relighting has to trace these bundles again; increase memory_limit");
        return result;
    }

    std::vector<float> openShare() const override {
        const LineCounts& counts = input.counts;
        std::vector<float> share(counts.sideCount(), -1.0f);
        for (size_t i = 0; i < share.size(); ++i)
            if (const uint32_t m = counts.total[i][0] + counts.total[i][1]; m > 0)
                share[i] = float(counts.sky[i][0] + counts.sky[i][1]) / float(m);
        return share;
    }

  private:
    void startStreaming() {
        exposed = solver.exposedShare();
        const LitSurfaces surfaces{input.patches, exposed};
        first = handOver(surfaces, input.shot);
        // Light by direction is computed from the lines counted so far, because later lines are not
        // kept.
        const std::vector<glm::vec3> byDirection =
            solver.directed(Half::BOTH, solver.lineWeights(Half::BOTH));
        std::vector<glm::vec3> source = first.unshot;
        for (size_t i = 0; i < byDirection.size(); ++i) {
            first.indirect[i] += byDirection[i];
            source[i] += input.patches.reflectance[i] * byDirection[i];
        }
        for (size_t i = 0; i < source.size(); ++i)
            source[i] +=
                passedOn(surfaces, i, first.ofSources[opposite(i)] + first.indirect[opposite(i)]);
        for (uint32_t half = 0; half < 2; ++half) {
            const Irradiance start =
                solver.solve(Half(half), kStartTolerance, last.of[half].reflected);
            const size_t n = input.patches.sideCount();
            StreamingStart byLines{input.counts.bundles / 2, std::vector<float>(n),
                                   std::vector<glm::vec3>(n), std::vector<glm::vec3>(n)};
            for (size_t i = 0; i < n; ++i) {
                byLines.lines[i] = float(input.counts.total[i][half]);
                byLines.direct[i] = start.direct[i] - start.ofSources[i];
                byLines.indirect[i] = start.indirect[i] - first.indirect[i];
            }
            streaming[half].emplace(surfaces, byLines, source, input.shot.emission,
                                    glm::pi<float>() * input.worldRadiance);
        }
    }

    void stream(const std::vector<TracedBundle>& traced) {
        auto advanceHalf = [&](uint32_t half) {
            for (const TracedBundle& t : traced)
                if (t.bundle.half == half) streaming[half]->add(t.lines);
        };
        parallelInvoke([&] { advanceHalf(0); }, [&] { advanceHalf(1); });
    }

    Irradiance streamed(Half half) {
        Irradiance result(input.patches.sideCount());
        result.ofSources = result.direct = first.ofSources;
        result.indirect = first.indirect;
        std::vector<glm::vec3>& exitance = last.of[size_t(half)].reflected;
        last.of[size_t(half)].brought.clear();
        std::fill(exitance.begin(), exitance.end(), glm::vec3(0.0f));
        for (int h = 0; h < 2; ++h) {
            if (half != Half::BOTH && h != int(half)) continue;
            const float share = half == Half::BOTH ? 0.5f : 1.0f;
            for (size_t i = 0; i < exitance.size(); ++i) {
                result.direct[i] += share * streaming[h]->direct(i);
                result.indirect[i] += share * streaming[h]->indirect(i);
                exitance[i] += share * streaming[h]->reflected(i);
            }
        }
        return result;
    }

    const TransportInput input;
    const LineReuse solver;
    // Memory for the counts, bytes.
    const size_t limit;
    // The solutions if `input` has none, and a reference to the solutions in use.
    LineSolutions own;
    LineSolutions& last;
    uint64_t solves = 0;
    // Per half. Empty until that memory is full.
    std::array<std::optional<StreamingReuse>, 2> streaming;
    // Only while streaming. `first` also contains light by direction in its indirect part.
    HandOver first;
    // Per side: the share that no other surface covers.
    std::vector<float> exposed;
    // All transports that use the traced lines: this one and its followers.
    std::vector<LineReuseTransport*> carriers{this};
};

}  // namespace

std::unique_ptr<Transport> lineReuse(const TransportInput& input) {
    return std::make_unique<LineReuseTransport>(input);
}

Transports lineReuseOfMany(const std::vector<TransportInput>& inputs) {
    auto leader = std::make_unique<LineReuseTransport>(inputs.front());
    Transports transports(1);
    for (size_t k = 1; k < inputs.size(); ++k) {
        auto follower = std::make_unique<LineReuseTransport>(inputs[k]);
        leader->lead(*follower);
        transports.push_back(std::move(follower));
    }
    transports.front() = std::move(leader);
    return transports;
}

}  // namespace raybundle
