// SPDX-License-Identifier: GPL-3.0-or-later
//
// LINE_REUSE as a transport: while bundles are traced their lines are only counted; light moves when
// the system on the counts is solved (transport/line_reuse.h).
#include <algorithm>

#include "transport/line_reuse.h"
#include "transport/transport.h"

namespace raybundle {
namespace {

// Sides with fewer lines than this also gather with local rays.
constexpr uint32_t kStarvedLines = 16;
// Lines held before they are merged into the counts, bytes.
constexpr size_t kMergeBytes = size_t(256) << 20;

class LineReuseTransport : public Transport {
  public:
    explicit LineReuseTransport(const TransportInput& input)
        : input(input),
          solver(input.patches, input.counts, input.shot, input.worldRadiance, input.exposed) {
        for (auto& field : reflected) field.resize(input.patches.sideCount());
    }

    void advance(uint32_t count, const Progress& progress) override {
        std::vector<TracedBundle> held;
        size_t bytes = 0;
        for (uint32_t done = 0; done < count;) {
            progress.report(RB_STAGE_BUNDLES, double(done) / count);
            const uint32_t step = std::min(kStep, count - done);
            for (TracedBundle& traced : input.tracer.trace(step)) {
                bytes += traced.lines.byteCount();
                held.push_back(std::move(traced));
            }
            done += step;
            if (bytes > kMergeBytes || done == count) {
                input.counts.add(held);
                held.clear();
                bytes = 0;
            }
        }
        progress.report(RB_STAGE_BUNDLES, 1);
    }

    uint32_t bundleCount() const override { return input.tracer.bundleCount(); }

    Irradiance irradiance(Half half, float tolerance) override {
        std::vector<glm::vec3>& guess = reflected[size_t(half)];
        if (half == Half::BOTH)
            for (size_t i = 0; i < guess.size(); ++i)
                guess[i] = 0.5f * (reflected[0][i] + reflected[1][i]);
        return solver.solve(half, tolerance, guess);
    }

    Irradiance finish(float tolerance, const std::vector<bool>& wanted, Report& report) override {
        Irradiance result = irradiance(Half::BOTH, tolerance);
        const size_t starved = solver.gatherStarvedSides(input.visibility, kStarvedLines,
                                                         uint32_t(input.settings.seed), wanted,
                                                         reflected[size_t(Half::BOTH)], result);
        if (starved)
            report.skipped.push_back({"bundles on small patches",
                                      "too few lines met them: they gathered with local rays",
                                      starved});
        return result;
    }

    std::vector<float> openShare() const override {
        const LineCounts& counts = input.counts;
        std::vector<float> share(counts.sideCount(), 0.0f);
        for (size_t i = 0; i < share.size(); ++i)
            if (const uint32_t m = counts.total[i][0] + counts.total[i][1]; m > 0)
                share[i] = float(counts.sky[i][0] + counts.sky[i][1]) / float(m);
        return share;
    }

    bool isFull() const override {
        return 2 * input.counts.byteCount() > size_t(input.settings.memoryLimit * 1e6);
    }

  private:
    static constexpr uint32_t kStep = 16;  // bundles between two looks at the cancel flag

    const TransportInput input;
    const LineReuse solver;
    std::vector<glm::vec3> reflected[3];  // per half and for both: the last solution
};

}  // namespace

std::unique_ptr<Transport> lineReuse(const TransportInput& input) {
    return std::make_unique<LineReuseTransport>(input);
}

}  // namespace raybundle
