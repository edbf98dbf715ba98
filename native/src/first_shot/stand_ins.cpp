// SPDX-License-Identifier: GPL-3.0-or-later
#include "first_shot/stand_ins.h"

#include <cmath>
#include <numeric>

#include "job/cancellation.h"
#include "patches/clusters.h"
#include "patches/neighbours.h"
#include "patches/side.h"
#include "sampling/sobol.h"

namespace raybundle {
namespace {

// Returns the pairs of all sides beside each other, as indices of sides.
std::vector<ReceiverPair> neighbouringSides(const Patches& patches) {
    std::vector<uint32_t> firstOf;  // first patch of each tile; one more at the end
    for (const Parent& parent : patches.parents)
        for (uint32_t tile = 0; tile < parent.tileCount(); ++tile)
            firstOf.push_back(parent.firstPatch + parent.firstOf(tile));
    firstOf.push_back(uint32_t(patches.count()));
    std::vector<ReceiverPair> pairs;
    auto add = [&](uint32_t patch, uint32_t other) {
        for (uint32_t back = 0; back < 2; ++back)
            pairs.push_back({2 * patch + back, 2 * other + back});
    };
    for (const TilePair& tiles : neighbouringTiles(patches, 0, uint32_t(patches.parents.size()))) {
        const uint32_t a = firstOf[tiles.first], b = firstOf[tiles.second];
        for (uint32_t p = a; p < firstOf[tiles.first + 1]; ++p) add(p, b);
        for (uint32_t p = b + 1; p < firstOf[tiles.second + 1]; ++p) add(p, a);
    }
    for (size_t tile = 0; tile + 1 < firstOf.size(); ++tile)
        for (uint32_t p = firstOf[tile] + 1; p < firstOf[tile + 1]; ++p) add(p, p - 1);
    return pairs;
}

}  // namespace

StandIns::StandIns(const Patches& patches, const std::vector<bool>* isShown, float coarseness)
    : patches(patches) {
    const uint32_t count = uint32_t(patches.sideCount());
    std::vector<uint32_t> clusters;  // per patch
    if (isShown) {
        std::vector<bool> isIn(patches.count());
        for (size_t patch = 0; patch < isIn.size(); ++patch)
            isIn[patch] = !(*isShown)[2 * patch] || !(*isShown)[2 * patch + 1];
        clusters = findClusters(patches, isIn, coarseness);
    }
    // Returns the cluster of a side: 2 * (cluster of its patch) for fronts, plus 1 for backs;
    // kNoCluster if the side gathers for itself.
    auto clusterOf = [&](uint32_t side) {
        return (*isShown)[side] || clusters[patchOf(side)] == kNoCluster
                   ? kNoCluster
                   : sideOf(clusters[patchOf(side)], isBack(side));
    };
    struct StandIn {
        uint32_t side = 0, sides = 0;  // sides: number of sides that it stands for
        float wait = INFINITY;
    };
    std::vector<StandIn> standIns;  // per side of a cluster
    bool isAnyForOthers = false;
    for (uint32_t side = 0; !clusters.empty() && side < count; ++side) {
        throwIfCancelledAt(side);
        const uint32_t cluster = clusterOf(side);
        if (cluster == kNoCluster) continue;
        if (cluster >= standIns.size()) standIns.resize(cluster + 1);
        StandIn& standIn = standIns[cluster];
        isAnyForOthers |= ++standIn.sides > 1;
        // Draw exponential waiting times with a rate proportional to the area. The smallest one
        // selects each side with a probability proportional to its area. Cuts of other tiles do
        // not change the choice.
        const Parent& parent = patches.parentAt(side);
        const uint32_t patch = patchOf(side) - parent.firstPatch, tile = parent.tileOf(patch);
        const uint32_t bits =
            hash(sideOf(parent.firstTile + tile, isBack(side)), patch - parent.firstOf(tile));
        const float random = (float(bits >> 8) + 0.5f) * 0x1p-24f;
        const float wait = -std::log(random) / patches.area[patchOf(side)];
        if (wait >= standIn.wait) continue;
        standIn.wait = wait;
        standIn.side = side;
    }
    if (!isAnyForOthers) {
        sides.resize(count);
        std::iota(sides.begin(), sides.end(), 0u);
        return;
    }
    numbers.resize(count);
    for (uint32_t side = 0; side < count; ++side) {
        const uint32_t cluster = clusterOf(side);
        if (cluster != kNoCluster && standIns[cluster].side != side) continue;
        numbers[side] = uint32_t(sides.size());
        sides.push_back(side);
        forOthers.push_back(cluster != kNoCluster && standIns[cluster].sides > 1);
    }
    for (uint32_t side = 0; side < count; ++side)
        if (const uint32_t cluster = clusterOf(side); cluster != kNoCluster)
            numbers[side] = numbers[standIns[cluster].side];
}

const std::vector<ReceiverPair>& StandIns::neighbours() const {
    if (pairs) return *pairs;
    pairs.emplace();
    for (const ReceiverPair& pair : neighbouringSides(patches)) {
        const ReceiverPair own{numberOf(pair.first), numberOf(pair.second)};
        if (sides[own.first] == pair.first && sides[own.second] == pair.second)
            pairs->push_back(own);
    }
    return *pairs;
}

}  // namespace raybundle
