// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/local_ray_transport.h"

#include <algorithm>
#include <cassert>
#include <glm/gtc/constants.hpp>

#include "job/cancellation.h"
#include "patches/side.h"

namespace raybundle {
namespace {

// Number of batches of a half between two checks of the cancel flag. Their logs are in memory at
// once.
constexpr size_t kHeld = 16;

}  // namespace

LocalRayTransport::LocalRayTransport(const TransportInput& input, uint64_t samplesPerBundle,
                                     uint32_t mostPerBatch)
    : input(input), rays(input), samplesPerBundle(samplesPerBundle), mostPerBatch(mostPerBatch) {
    const size_t n = input.patches.sideCount();
    for (Sums& sums : halves) {
        sums.direct.resize(n);
        sums.indirect.resize(n);
        sums.world.resize(n);
        sums.rays.resize(n);
        sums.escapes.resize(n);
    }
}

void LocalRayTransport::advance(uint32_t count, const Progress& progress) {
    assert(count % 2 == 0 && "two halves of equal size");
    const uint64_t wanted = count / 2 * samplesPerBundle;  // number of samples of each half
    std::vector<RayLog> logs(2 * kHeld);
    for (uint64_t done = 0; done < wanted;) {
        progress.report(RB_STAGE_BUNDLES, double(done) / double(wanted));
        auto samplesOf = [&](size_t batch) {
            const uint64_t before = std::min(wanted, done + batch * mostPerBatch);
            return uint32_t(std::min<uint64_t>(mostPerBatch, wanted - before));
        };
        parallelFor(size_t(0), logs.size(), [&](size_t k) {
            const size_t half = k / kHeld, batch = k % kHeld;
            logs[k].scores.clear();
            logs[k].rays.clear();
            logs[k].escapes.clear();
            const uint32_t samples = samplesOf(batch);
            if (samples == 0 || rays.power() == 0) return;
            const uint64_t index = halves[half].batches + batch;
            std::seed_seq words{uint32_t(input.settings.seed), uint32_t(half), uint32_t(index),
                                uint32_t(index >> 32)};
            std::mt19937_64 random(words);
            sample(samples, random, logs[k]);
        });
        auto addHalf = [&](size_t half) {
            Sums& sums = halves[half];
            for (size_t batch = 0; batch < kHeld; ++batch) {
                add(logs[half * kHeld + batch], sums);
                sums.samples += samplesOf(batch);
            }
            sums.batches += kHeld;
        };
        parallelInvoke([&] { addHalf(0); }, [&] { addHalf(1); });
        done = std::min(wanted, done + kHeld * mostPerBatch);
    }
    bundles += count;
    progress.report(RB_STAGE_BUNDLES, 1);
}

void LocalRayTransport::add(const RayLog& log, Sums& to) const {
    for (const RayLog::Score& score : log.scores) {
        (score.light == RayLight::REFLECTED ? to.indirect : to.direct)[score.side] +=
            glm::dvec3(score.power);
        if (score.light == RayLight::WORLD)
            to.world[score.side] += double(score.power.x) + score.power.y + score.power.z;
    }
    for (uint32_t side : log.rays) ++to.rays[side];
    for (uint32_t side : log.escapes) ++to.escapes[side];
}

Irradiance LocalRayTransport::irradiance(Half half, float) {
    const size_t n = input.patches.sideCount();
    const HandOver first = handOver(input, input.shot);
    Irradiance result(n);
    for (uint32_t side = 0; side < n; ++side) {
        glm::dvec3 direct(0.0), indirect(0.0);
        uint64_t samples = 0;
        for (size_t h = 0; h < 2; ++h) {
            if (half != Half::BOTH && h != size_t(half)) continue;
            direct += halves[h].direct[side];
            indirect += halves[h].indirect[side];
            samples += halves[h].samples;
        }
        const double perPower = samples > 0 && rays.area(side) > 0
                                    ? 1 / (double(rays.area(side)) * double(samples))
                                    : 0;
        result.ofSources[side] = first.ofSources[side];
        result.direct[side] = first.ofSources[side] + glm::vec3(perPower * direct);
        result.indirect[side] = first.indirect[side] + glm::vec3(perPower * indirect);
    }
    return result;
}

std::vector<float> LocalRayTransport::openShare() const {
    const Patches& patches = input.patches;
    struct Count {
        double rays = 0, escapes = 0;
    };
    std::vector<Count> ofFace(2 * patches.parents.size());  // per side of a parent
    auto face = [&](size_t side) { return 2 * patches.parentOf[patchOf(side)] + isBack(side); };
    std::vector<Count> ofSide(patches.sideCount());
    for (size_t side = 0; side < ofSide.size(); ++side) {
        for (const Sums& sums : halves) {
            ofSide[side].rays += sums.rays[side];
            ofSide[side].escapes += sums.escapes[side];
        }
        ofFace[face(side)].rays += ofSide[side].rays;
        ofFace[face(side)].escapes += ofSide[side].escapes;
    }
    const glm::vec3 world = glm::pi<float>() * input.worldRadiance;
    const double worldExitance = double(world.x) + world.y + world.z;
    const double samples = double(halves[0].samples + halves[1].samples);
    std::vector<float> share(ofSide.size(), 0.0f);
    for (uint32_t side = 0; side < share.size(); ++side) {
        const Count& count = ofSide[side].rays > 0 ? ofSide[side] : ofFace[face(side)];
        const double most = worldExitance * samples * double(rays.area(side));
        if (count.rays > 0)
            share[side] = float(count.escapes / count.rays);
        else if (most > 0)
            share[side] = float((halves[0].world[side] + halves[1].world[side]) / most);
    }
    return share;
}

}  // namespace raybundle
