// SPDX-License-Identifier: GPL-3.0-or-later
//
// GATHER: every patch side gathers the light of the sources.
//
// Sources: thesis sections 2.4.2 and 4.3.3 (first shot, stated error).
// Differs: the thesis shoots rays from the sources, of which a patch gets fewer the finer it is.
// Gathering takes its rays where the light is needed (direct_light/direct_light.h).
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

#include "first_shot/first_shot.h"
#include "first_shot/stand_ins.h"
#include "job/cancellation.h"
#include "patches/side.h"

namespace raybundle {
namespace {

// Factor of the error allowed on sides whose light is not shown. Their light reaches shown surfaces
// only as the mean over many sides.
constexpr float kOthersError = 2;
// The same for a side that stands for a whole cluster, within which the light differs by more than
// this anyway.
constexpr float kStandInError = 4;
// Largest factor of the error. It applies to sides that reflect nothing, whose light only counts in
// the energy balance.
constexpr float kMostError = 10;

// Returns the factor of the error allowed on a side whose light is not shown. Other surfaces get
// the light of many such sides, whose errors average out: the variance of the sum is proportional
// to the share that each side has of the total area.
float othersError(const Patches& patches, const StandIns& standIns, uint32_t side) {
    if (patches.reflectance[side] == glm::vec3(0.0f) &&
        patches.translucenceOf(opposite(side)) == glm::vec3(0.0f))
        return kMostError;
    if (standIns.isForOthers(standIns.numberOf(side))) return kStandInError;
    const float edge = patches.islandAt(side).size;
    return kOthersError *
           std::max(1.0f, edge / std::sqrt(std::max(patches.area[patchOf(side)], 1e-30f)));
}

// Returns the coarse shot of the tiles, extended to the patches of cut tiles. Only these are
// sampled here, and sides that had the light of a stand-in.
CoarseShot coarseOfPatches(const FirstShotInput& input, const std::vector<uint32_t>& gatherers,
                           const std::function<Receiver(size_t)>& receiverAt,
                           const std::function<void(double)>& report) {
    CoarseShot coarse;
    const Patches& patches = input.patches;
    coarse.seen = input.fromTiles->seen;
    coarse.gathered.resize(gatherers.size());
    std::vector<uint32_t> others;
    for (uint32_t k = 0; k < gatherers.size(); ++k) {
        throwIfCancelledAt(k);
        const uint32_t side = gatherers[k];
        const uint32_t ofTile = sideOf(patches.tileOf(patchOf(side)), isBack(side));
        const std::vector<bool>& isOwn = input.fromTiles->isOwn;
        if (patches.level(patchOf(side)) > 0 || (!isOwn.empty() && !isOwn[ofTile]))
            others.push_back(k);
        else
            coarse.gathered[k] = input.fromTiles->gathered[ofTile];
    }
    input.light.shootCoarsely(coarse, others, receiverAt, report);
    return coarse;
}

// Returns the irradiance of each of `count` sides, W/m^2. irradianceAt(k) is that of gatherer k.
template <class IrradianceAt>
std::vector<glm::vec3> irradianceOfSides(const StandIns& standIns, size_t count,
                                         const IrradianceAt& irradianceAt) {
    std::vector<glm::vec3> irradiance(count);
    for (uint32_t side = 0; side < count; ++side)
        irradiance[side] = irradianceAt(standIns.numberOf(side));
    return irradiance;
}

// Adds what the gatherers have gathered to the shot, whose vectors have an entry per side.
void addResults(const std::vector<Gathered>& results, const Patches& patches,
                const StandIns& standIns, FirstShot& shot) {
    for (const Gathered& result : results) {
        shot.rays += result.rays;
        shot.unblockedSides += result.unblocked;
        shot.hiddenSides += result.hidden;
        shot.weakSides += result.weak;
        shot.insideSides += result.inside;
    }
    for (uint32_t side = 0; side < patches.sideCount(); ++side) {
        const Gathered& result = results[standIns.numberOf(side)];
        shot.irradiance[side] = result.irradiance;
        shot.emitted += double(patches.area[patchOf(side)]) * glm::dvec3(result.unpowered);
        shot.angles[side] = result.meanAngles();
        if (!shot.incoming.empty()) shot.incoming[side] = result.incoming;
        shot.error[side] = std::sqrt(result.variance);
        shot.noisiest[side] = result.noisiest;
    }
}

}  // namespace

FirstShot gather(const FirstShotInput& input) {
    const DirectLight& light = input.light;
    const Patches& patches = input.patches;
    const size_t n = patches.sideCount();
    std::optional<StandIns> alone;
    const StandIns& standIns = input.standIns ? *input.standIns : alone.emplace(patches, nullptr);
    const std::vector<uint32_t>& gatherers = standIns.gatherers();
    FirstShot shot;
    shot.emission = light.bundledEmission();
    shot.irradiance.resize(n);
    shot.angles.resize(n);
    if (!patches.scattering.empty()) shot.incoming.resize(n);
    shot.error.resize(n);
    shot.noisiest.resize(n);
    auto report = [&](double done) { input.progress.report(RB_STAGE_FIRST_SHOT, done); };
    auto receiverAt = [&](size_t k) {
        const uint32_t side = gatherers[k];
        Receiver receiver{side, patches.normal(side), std::nullopt, side};
        // Most of the error of the patches of a cut tile averages out over the tile. The mean over
        // the tile may keep twice the error of other tiles.
        if (const int level = patches.level(patchOf(side)); level > 0)
            receiver.errorFactor = std::ldexp(1.0f, level);
        if (input.isShown && !(*input.isShown)[side]) {
            receiver.isShown = false;
            receiver.errorFactor =
                std::min(receiver.errorFactor * othersError(patches, standIns, side), kMostError);
        } else if (input.instances) {
            receiver.targetFactor = (*input.instances)[patches.parentAt(side).instance].noiseFactor;
        }
        return receiver;
    };
    const float target = input.settings.targetError;
    const auto& sources = light.lightSources();
    std::vector<PowerShares> shares(sources.size());
    std::vector<Gathered> results;
    if (const auto matches = input.before ? input.before->match(sources) : std::nullopt) {
        results = light.gatherFresh(
            *input.before, *matches, receiverAt, target, report,
            matches->fresh.empty() ? std::vector<ReceiverPair>() : standIns.neighbours());
        shot.bySource = input.before;
        shot.freshSources = matches->fresh.size();
        shares = light.powerShares(matches->fresh);
        for (size_t k = 0; k < matches->ofKept.size(); ++k)
            if (const auto source = matches->ofKept[k].source)
                shares[*source] = input.before->powerShares[k];
    } else {
        auto bySource = std::make_shared<LightBySource>(sources, gatherers.size());
        bySource->isWhole = bySource->hasRoom() && !input.fromTiles;
        LightBySource* const whole = bySource->isWhole ? bySource.get() : nullptr;
        const std::vector<ReceiverPair>& neighbours = standIns.neighbours();
        CoarseShot coarse = input.fromTiles ? coarseOfPatches(input, gatherers, receiverAt, report)
                                            : light.shootCoarsely(gatherers.size(), receiverAt,
                                                                  report, neighbours, whole);
        if (input.showCoarse)
            input.showCoarse(irradianceOfSides(
                standIns, n, [&](size_t k) { return coarse.gathered[k].irradiance; }));
        results = light.gather(gatherers.size(), receiverAt, target, report, std::move(coarse),
                               neighbours, whole);
        shares = bySource->powerShares = light.powerShares();
        shot.bySource = std::move(bySource);
    }
    addResults(results, patches, standIns, shot);
    shot.sidesByOthers = n - gatherers.size();
    for (size_t k = 0; k < sources.size(); ++k) {
        const glm::dvec3 power(sources[k]->power());
        if (sources[k]->castsShadows) shot.emitted += power * (1.0 - shares[k].covered);
        shot.escaped += power * shares[k].escaped;
    }
    input.progress.report(RB_STAGE_FIRST_SHOT, 1);
    return shot;
}

}  // namespace raybundle
