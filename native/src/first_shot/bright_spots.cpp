// SPDX-License-Identifier: GPL-3.0-or-later
#include "first_shot/bright_spots.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "bundles/directions.h"
#include "first_shot/directed_light.h"
#include "patches/clusters.h"
#include "patches/side.h"
#include "scene/channels.h"
#include "visibility/exposed_share.h"

namespace raybundle {
namespace {

// A side may be a bright spot if its exitance is at least this many times the mean exitance that
// lines meet.
constexpr double kBright = 3;
// Largest share of the scene's area that all bright spots may take. Lines carry the light of large
// areas better.
constexpr double kMostArea = 0.05;
// Gathering the light of the bright spots of one object takes about as long as this number of
// bundles (the time of both is proportional to the number of patches). It pays only if it saves
// more bundles. (The dishes of a laid table, 48 objects, took longer at a target of 0.2 % than the
// whole bake without bright spots.)
constexpr double kWorthwhileBundles = 50;
// Beyond this number, further objects take little more time, since a receiver samples them as one
// (lights/joint_source.h).
constexpr size_t kMostApart = 12;

// Largest number of times that light is gathered from bright spots, which reflect some of each
// other's light, and the number of bundles that each further round must save. The lines of fewer
// bundles would also serve dark places less: beside the point where a sphere touches the floor of a
// room (blend_tests/test_clean.py), a round that saved some 220 of 550 bundles raised the noise at
// the 95th percentile from 3.3 to 4.2 %.
constexpr int kMostRounds = 4;
constexpr double kWorthFurtherRound = 1000;

// An island whose mean light is less than this share of that of the brightest island is ignored, so
// that something dark far below a room does not make the room's walls bright spots.
constexpr double kDarkIsland = 0.01;

// Number of points on a side that are tested for another surface lying on it.
constexpr uint32_t kLooks = 16;
// A side of which less than this share is exposed is no bright spot.
constexpr float kLeastExposed = 0.1f;

// What lies on a side.
enum class Cover { NOTHING, SOLID, SHEET };

Cover coverOf(const Patches& patches, const Visibility& exchange, uint32_t side) {
    Cover found = Cover::NOTHING;
    for (uint32_t k = 0; k < kLooks; ++k) {
        const glm::vec4 u = sobolPoint(k, side);
        const auto met =
            exchange.firstHit(side, patches.point(patchOf(side), {u.x, u.y}), patches.normal(side),
                              nullptr, patches.islandAt(side).touchDistance);
        if (!met) continue;
        if (!patches.parentAt(*met).isSolid) return Cover::SHEET;
        found = Cover::SOLID;
    }
    return found;
}

// Returns per side of `bright` the share that is exposed. Returns 0 if that is too little for a
// source, or if a sheet lies on the side: unlike a solid, it does not block all shadow rays to what
// it covers.
std::vector<float> exposedShares(const FirstShotInput& input, const Visibility& exchange,
                                 const std::vector<uint32_t>& bright) {
    std::vector<float> shares(bright.size(), 1.0f);
    std::vector<uint32_t> covered;  // sides on which solids stand
    std::vector<size_t> at;         // their indices in `bright`
    for (size_t k = 0; k < bright.size(); ++k) {
        const Cover cover = coverOf(input.patches, exchange, bright[k]);
        if (cover == Cover::SHEET) shares[k] = 0;
        if (cover != Cover::SOLID) continue;
        covered.push_back(bright[k]);
        at.push_back(k);
    }
    const std::vector<float> exposed =
        exposedShareOf(covered, exchange, Clusters(input.patches), uint32_t(input.settings.seed));
    for (size_t k = 0; k < at.size(); ++k)
        shares[at[k]] = exposed[k] < kLeastExposed ? 0 : exposed[k];
    return shares;
}

// Returns the area that a line stands for at a parent, relative to lines outside all windows.
double lineShare(const LineDensity& density, uint32_t parent) {
    const int32_t window = density.windowOf.empty() ? -1 : density.windowOf[parent];
    return window < 0 ? 1.0 : std::ldexp(1.0, -2 * density.windows[size_t(window)].level);
}

// Returns the exitance of a side by reflected light of the first shot, W/m^2.
glm::vec3 reflected(const Patches& patches, const FirstShot& shot, size_t side) {
    return shotReflectance(patches, shot, side) * shot.irradiance[side];
}

// Sums over the sides of an island (Patches::islands) after the first shot.
struct IslandLight {
    double power = 0, reflectance = 0, area = 0;  // W, m^2 times reflectance, m^2

    double mean() const { return area > 0 ? power / area : 0; }  // W/m^2
};

// Returns the sides that are bright spots by what they send of the light `sent` that is left to the
// bundles (per side, W/m^2), in a round of gathering. There are none if the round does not pay.
std::vector<uint32_t> brightSides(const FirstShotInput& input, const LineDensity& density,
                                  const FirstShot& shot, const std::vector<glm::vec3>& sent,
                                  int round) {
    const Patches& patches = input.patches;
    const size_t n = patches.sideCount();
    std::vector<double> exitance(n, 0.0);  // brightest channel, W/m^2
    std::vector<IslandLight> islands(patches.islands.size());
    for (size_t side = 0; side < n; ++side) {
        const Parent& parent = patches.parentAt(uint32_t(side));
        IslandLight& island = islands[parent.island];
        if (!isBack(side)) island.area += double(patches.area[patchOf(side)]);
        // Light inside a solid, such as the body of a lamp, stays there.
        const bool isInside = parent.isSolid && !parent.isInward && isBack(side);
        if (!parent.exchanges || isInside) continue;
        const double area = double(patches.area[patchOf(side)]);
        exitance[side] = double(brightest(sent[side]));
        island.power += area * double(brightest(reflected(patches, shot, side)) +
                                      brightest(shot.emission[side]));
        if (!isBack(side))
            island.reflectance += area * double(brightest(patches.reflectance[side]));
    }
    double most = 0;
    for (const IslandLight& island : islands) most = std::max(most, island.mean());
    IslandLight all;
    for (IslandLight& island : islands) {
        if (island.mean() < kDarkIsland * most) island = {};
        all.power += island.power;
        all.reflectance += island.reflectance;
        all.area += island.area;
    }
    if (!(all.area > 0)) return {};
    // Includes all bounces that stay in the scene.
    const double mean = all.mean() / std::max(0.05, 1 - all.reflectance / all.area);
    if (!(mean > 0)) return {};
    // The noise that sides cause on others is proportional to the square of their contrast, to
    // their area, and to the area that a line stands for.
    double inSpots = 0, inRest = 0, areaOfSpots = 0;
    std::set<uint32_t> objects;  // instances with bright spots
    for (size_t side = 0; side < n; ++side) {
        if (islands[patches.parentAt(uint32_t(side)).island].area == 0) continue;
        const double area = double(patches.area[patchOf(side)]);
        const bool isBright = exitance[side] > kBright * mean;
        (isBright ? inSpots : inRest) += area * std::pow(exitance[side] / mean - 1, 2) *
                                         lineShare(density, patches.parentOf[patchOf(side)]);
        if (!isBright) continue;
        areaOfSpots += area;
        objects.insert(patches.parentAt(uint32_t(side)).instance);
    }
    if (areaOfSpots > kMostArea * all.area) return {};
    auto bundlesFor = [&](double squares) {
        return std::pow(std::sqrt(squares / all.area) / double(input.settings.targetError),
                        1 / kNoiseSlope);
    };
    const double spared = bundlesFor(inSpots + inRest) - bundlesFor(inRest);
    const double enough = round == 0
                              ? kWorthwhileBundles * double(std::min(objects.size(), kMostApart))
                              : kWorthFurtherRound;
    if (!(spared > enough)) return {};
    std::vector<uint32_t> bright;
    for (uint32_t side = 0; side < n; ++side)
        if (exitance[side] > kBright * mean) bright.push_back(side);
    return bright;
}

}  // namespace

size_t gatherBrightSpots(const Scene& scene, const FirstShotInput& input,
                         const Visibility& exchange, const LineDensity& density, FirstShot& shot) {
    const Patches& patches = input.patches;
    if (!patches.translucence.empty() || !patches.opacity.empty()) return 0;
    const size_t n = patches.sideCount();
    std::vector<glm::vec3> unshot(n);
    for (size_t side = 0; side < n; ++side)
        if (patches.parentAt(uint32_t(side)).exchanges)
            unshot[side] = reflected(patches, shot, side);
    std::optional<StandIns> alone;
    const StandIns& standIns = input.standIns ? *input.standIns : alone.emplace(patches, nullptr);
    const std::vector<uint32_t>& gatherers = standIns.gatherers();
    std::vector<bool> areSpots(n, false);
    // Only the first light that a side sends has known directions.
    const int mostRounds = patches.scattering.empty() ? kMostRounds : 1;
    for (int round = 0; round < mostRounds; ++round) {
        const std::vector<uint32_t> bright = brightSides(input, density, shot, unshot, round);
        const std::vector<float> exposed = exposedShares(input, exchange, bright);
        EmissionSplit spots;
        for (size_t k = 0; k < bright.size(); ++k) {
            if (exposed[k] == 0) continue;
            const uint32_t side = bright[k];
            if (spots.isSource.empty()) {
                spots.isSource.resize(n);
                spots.ofSources.resize(n);
            }
            spots.isSource[side] = areSpots[side] = true;
            // The light arrives on the exposed part, and leaves from there.
            spots.ofSources[side] = unshot[side] / exposed[k];
            unshot[side] = glm::vec3(0.0f);
        }
        if (spots.isSource.empty()) break;
        if (round == 0) shot.indirect.resize(n);
        if (!patches.scattering.empty())
            spots.directed =
                std::make_shared<const DirectedLight>(patches, shot, DirectedLight::Of::ALL);
        const uint32_t seed = hash(uint32_t(input.settings.seed), 0x5707 + uint32_t(round));
        const DirectLight light(scene, patches, exchange, seed, input.settings, std::move(spots));
        const std::vector<Gathered> results = light.gather(
            gatherers.size(),
            [&](size_t k) {
                const uint32_t side = gatherers[k];
                Receiver receiver{side, patches.normal(side), std::nullopt, side};
                receiver.isShown = !input.isShown || (*input.isShown)[side];
                receiver.otherLight = brightest(shot.irradiance[side] + shot.indirect[side]);
                return receiver;
            },
            input.settings.targetError,
            [&](double done) { input.progress.report(RB_STAGE_FIRST_SHOT, done); }, {},
            standIns.neighbours());
        for (const Gathered& result : results) shot.rays += result.rays;
        for (size_t side = 0; side < n; ++side) {
            const Gathered& result = results[standIns.numberOf(uint32_t(side))];
            shot.indirect[side] += result.irradiance;
            if (patches.parentAt(uint32_t(side)).exchanges)
                unshot[side] += patches.reflectance[side] * result.irradiance;
            shot.error[side] = std::hypot(shot.error[side], std::sqrt(result.variance));
        }
    }
    const size_t count = size_t(std::count(areSpots.begin(), areSpots.end(), true));
    if (count == 0) return 0;
    shot.unshot = std::move(unshot);
    shot.sentOn = std::move(areSpots);
    return count;
}

}  // namespace raybundle
