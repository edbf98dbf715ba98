// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/patch_size.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace raybundle {
namespace {

constexpr double kPatchesAcross = 64;
// Groups smaller than this share of what is around them get finer patches; kFull times smaller
// ones get those that they would have alone, and in between there is no jump.
constexpr double kTiny = 1.0 / 16, kFull = 8;
// Objects not further apart than this share of the larger one's diagonal belong together.
constexpr double kTogether = 0.25;

using Group = std::vector<size_t>;  // objects

Extent grown(const Extent& extent) {
    const double by = kTogether * extent.diagonal();
    return {extent.low - by, extent.high + by};
}

bool meet(const Extent& a, const Extent& b) {
    return glm::all(glm::lessThanEqual(a.low, b.high)) &&
           glm::all(glm::lessThanEqual(b.low, a.high));
}

size_t rootOf(std::vector<size_t>& leader, size_t k) {
    while (leader[k] != k) k = leader[k] = leader[leader[k]];
    return k;
}

// Objects that lie together, by a sweep along x.
std::vector<Group> groupsOf(const std::vector<Extent>& objects, Group members) {
    std::vector<Extent> reach(objects.size());
    for (size_t m : members) reach[m] = grown(objects[m]);
    std::sort(members.begin(), members.end(),
              [&](size_t a, size_t b) { return reach[a].low.x < reach[b].low.x; });
    std::vector<size_t> leader(members.size());
    std::iota(leader.begin(), leader.end(), size_t(0));
    for (size_t i = 0; i < members.size(); ++i) {
        const size_t a = members[i];
        for (size_t j = i + 1; j < members.size(); ++j) {
            const size_t b = members[j];
            if (reach[b].low.x > reach[a].high.x) break;
            if (meet(reach[a], objects[b]) || meet(reach[b], objects[a]))
                leader[rootOf(leader, j)] = rootOf(leader, i);
        }
    }
    std::vector<Group> groups(members.size());
    for (size_t i = 0; i < members.size(); ++i) groups[rootOf(leader, i)].push_back(members[i]);
    groups.erase(std::remove_if(groups.begin(), groups.end(),
                                [](const Group& group) { return group.empty(); }),
                 groups.end());
    return groups;
}

// Sets the sizes of tiny groups within one of a diagonal, and of those within them.
void refine(const std::vector<Extent>& objects, const Group& around, double diagonal,
            std::vector<double>& sizes) {
    Group tiny;
    for (size_t m : around)
        if (objects[m].diagonal() < kTiny * diagonal) tiny.push_back(m);
    for (const Group& group : groupsOf(objects, tiny)) {
        Extent extent;
        for (size_t m : group) {
            extent.add(objects[m].low);
            extent.add(objects[m].high);
        }
        const double own = extent.diagonal();
        if (!(own > 0) || own >= diagonal) continue;
        const double ratio = own / (kTiny * diagonal);
        const double coarser =
            std::pow(1 / kTiny, std::max(0.0, 1 + std::log(ratio) / std::log(kFull)));
        for (size_t m : group)
            sizes[m] = std::min(sizes[m], own / kPatchesAcross * std::max(1.0, coarser));
        refine(objects, group, own, sizes);
    }
}

}  // namespace

std::vector<double> automaticPatchSizes(const std::vector<Extent>& objects) {
    Extent scene;
    Group all;
    for (size_t m = 0; m < objects.size(); ++m) {
        if (objects[m].isEmpty()) continue;
        scene.add(objects[m].low);
        scene.add(objects[m].high);
        all.push_back(m);
    }
    std::vector<double> sizes(objects.size(), scene.diagonal() / kPatchesAcross);
    refine(objects, all, scene.diagonal(), sizes);
    return sizes;
}

}  // namespace raybundle
