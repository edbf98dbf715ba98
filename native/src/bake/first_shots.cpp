// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/first_shots.h"

#include <optional>

#include "bake/interim.h"
#include "bake/light_hash.h"
#include "bake/stopwatch.h"
#include "first_shot/bright_spots.h"
#include "first_shot/stand_ins.h"

namespace raybundle {
namespace {

// Adds the work that the first shot of a light set has skipped to the report.
void noteSkips(const DirectLight& direct, const FirstShot& shot, Report& report) {
    report.skip(SkippedWork::LAMP_INSIDES, direct.unseenSides());
    report.skip(SkippedWork::WHOLLY_LIT, shot.unblockedSides);
    report.skip(SkippedWork::FACING_AWAY, shot.hiddenSides);
    report.skip(SkippedWork::WEAK_SOURCES, shot.weakSides);
    report.skip(SkippedWork::INSIDE_OF_SOLIDS, shot.insideSides);
    report.skip(SkippedWork::STAND_INS, shot.sidesByOthers);
}

// Returns the first shot of one light set. Uses the first shot of the last bake as far as it is
// still valid. `aims` is the result of shotHash().
FirstShot shootOrKeep(const StageInput& in, const FirstShotInput& input, uint64_t aims,
                      Trace::Shot& last, Report& report) {
    const bool isGather = in.settings.gathersFirstShot();
    const uint64_t hash = lightHash(input.light, aims);
    if (in.settings.skipLights && isGather && last.hash == hash) {
        report.skip(SkippedWork::UNCHANGED_LIGHTS, 1);
        return last.shot;
    }
    FirstShot shot = firstShot(in.settings.firstShot, input);
    report.shadowRays += shot.rays;
    if (shot.bySource && shot.bySource == last.shot.bySource) {
        const size_t kept = input.light.lightSources().size() - shot.freshSources;
        report.skip(shot.freshSources ? SkippedWork::KEPT_LIGHTS : SkippedWork::SCALED_LIGHTS,
                    kept);
    }
    if (isGather) last = {hash, aims, shot};
    return shot;
}

// Returns the result of shotHash(). `isShown` is per side.
uint64_t aimsOf(const StageInput& in, const std::vector<bool>& isShown) {
    return shotHash(in.scene, in.settings, isShown, !in.trace.patches.scattering.empty());
}

// Returns the stand-ins for these shown sides. `aims` is the result of aimsOf() for them. The
// reference is valid until the next call.
const StandIns& standInsOf(const StageInput& in, const std::vector<bool>& isShown, uint64_t aims) {
    return in.trace.standInsFor(in.settings.skipClusters ? &isShown : nullptr, aims);
}

// Gives all sides that have not gathered the light of their stand-ins. What a stand-in tells about
// the edge of a shadow holds for itself alone.
void copyFromStandIns(const StandIns& standIns, CoarseShot& shot) {
    const std::vector<uint32_t>& gatherers = standIns.gatherers();
    if (gatherers.size() == shot.gathered.size()) return;
    shot.isOwn.resize(shot.gathered.size());
    for (const uint32_t side : gatherers) shot.isOwn[side] = true;
    for (uint32_t side = 0; side < shot.gathered.size(); ++side) {
        if (shot.isOwn[side]) continue;
        shot.gathered[side] = shot.gathered[gatherers[standIns.numberOf(side)]];
        shot.gathered[side].contrast = 0;
    }
}

}  // namespace

std::vector<CoarseShot> shootCoarsely(const StageInput& in, Report& report) {
    Stopwatch stage(report.seconds[RB_STAGE_FIRST_SHOT]);
    const Patches& patches = in.trace.patches;
    const std::vector<bool> isShown = shownSides(in.scene, patches, in.settings);
    // The first shot uses the same stand-ins if no patch is cut.
    const StandIns& standIns = standInsOf(in, isShown, aimsOf(in, isShown));
    std::vector<CoarseShot> shots;
    for (int32_t set = kNoLightSet; set < int32_t(in.scene.lightSets.size()); ++set) {
        const DirectLight direct(in.scene, patches, in.trace.visibilityOfLights(),
                                 uint32_t(in.settings.seed), set, in.settings);
        CoarseShot shot{std::vector<Gathered>(patches.sideCount()), {}};
        direct.shootCoarsely(
            shot, standIns.gatherers(),
            [&](size_t side) {
                return Receiver{uint32_t(side), patches.normal(uint32_t(side)), std::nullopt,
                                uint32_t(side)};
            },
            [&](double done) { in.progress.report(RB_STAGE_FIRST_SHOT, done); });
        copyFromStandIns(standIns, shot);
        shots.push_back(std::move(shot));
    }
    return shots;
}

SetLights shootSources(const StageInput& in, const ShownLight& shown,
                       const std::vector<CoarseShot>& coarse, Report& report) {
    Stopwatch stage(report.seconds[RB_STAGE_FIRST_SHOT]);
    Trace& trace = in.trace;
    const Settings& settings = in.settings;
    const Patches& patches = trace.patches;
    const Visibility& visibility = trace.visibilityOfLights();
    const uint64_t aims = aimsOf(in, shown.sides());
    const StandIns& standIns = standInsOf(in, shown.sides(), aims);
    const bool isGather = settings.gathersFirstShot();
    SetLights lights;
    const int32_t count = int32_t(in.scene.lightSets.size());
    for (int32_t set = kNoLightSet; set < count; ++set) {
        const Progress share = in.progress.part(lights.size(), size_t(count) + 1);
        DirectLight direct(in.scene, patches, visibility, uint32_t(settings.seed), set, settings);
        Trace::Shot& last = trace.shots[set];
        const bool mayScale = settings.skipLights && isGather && last.aims == aims;
        FirstShotInput input{direct,
                             patches,
                             visibility,
                             settings,
                             share,
                             trace.linesPerBundle(),
                             &trace.visibility,
                             coarse.empty() ? nullptr : &coarse[lights.size()],
                             mayScale ? last.shot.bySource : nullptr,
                             &shown.sides(),
                             &in.scene.instances,
                             &standIns};
        // The light of further sets is not waited for.
        if (in.interim && lights.empty())
            input.showCoarse = [&](std::vector<glm::vec3> irradiance) {
                offerDirect(in, shown, std::move(irradiance));
            };
        FirstShot shot = shootOrKeep(in, input, aims, last, report);
        if (isGather && settings.countsLines())
            if (const size_t spots =
                    gatherBrightSpots(in.scene, input, trace.visibility, trace.density, shot))
                report.skip(SkippedWork::BRIGHT_SPOTS, spots);
        noteSkips(direct, shot, report);
        lights.push_back({set, std::move(direct), std::move(shot), in.scene.worldRadianceOf(set),
                          Irradiance(patches.sideCount())});
    }
    return lights;
}

}  // namespace raybundle
