// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/patch_size.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <tuple>

#include "job/cancellation.h"

namespace raybundle {
namespace {

// Patches along the diagonal of an island.
constexpr double kPatchesAcross = 64;
// Groups smaller than kTiny of the diagonal of their surroundings get finer patches. Groups kFull
// times smaller than that get the patches that they would have alone, with a continuous transition.
constexpr double kTiny = 1.0 / 16, kFull = 8;
// Surfaces belong together if their gap is at most this share of the larger one's diagonal.
constexpr double kTogether = 0.25;
// Surfaces of one object that touch form one group, such as a lamp and its rod, unless the object
// is larger than kThing of its surroundings: a table and all that lies on it may also be one
// object. They touch if their gap is at most kTouch of the smaller one's diagonal.
constexpr double kThing = 1.0 / 4, kTouch = 0.01;
// Used by areOneIsland(): two rooms of equal size are one island if the gap between them is at most
// a tenth of their length.
constexpr double kMostOfSmaller = 0.8;
// All tiny groups of one size together have at most this many times the patches of their
// surroundings, so that pebbles on a lawn do not get more patches than they are worth.
constexpr double kMostOfTiny = 2;
// The first island is the one with the most patches among those that see themselves. Other islands
// that see themselves are equally important if they have at least kAsImportant of its patches, up
// to kMostImportant islands. All other islands together have at most kMostOfOthers times the
// patches of the first.
constexpr double kAsImportant = 0.5;
constexpr size_t kMostImportant = 4;
constexpr double kMostOfOthers = 0.25;
// No patch is more than kLargest times as large as those of the first island, so that lines can be
// dense enough for both (bundles/line_windows.h), unless the island would then have more than
// kMostOfVast times the patches of the first.
constexpr double kLargest = 512, kMostOfVast = 2;
// With more members than this, a grid joins members before they are compared in pairs.
constexpr size_t kMostMembers = 4096;

using Members = std::vector<size_t>;  // indices of surfaces
// Surfaces, and the box that contains them.
struct Group {
    Extent extent;
    Members members;
};

// Returns the union of two groups.
Group joined(Group a, Group b) {
    if (a.members.size() < b.members.size()) std::swap(a, b);
    a.extent.add(b.extent);
    a.members.insert(a.members.end(), b.members.begin(), b.members.end());
    return a;
}

// Joins groups whose middles lie in one cell of a grid. The grid is coarsened until at most
// kMostMembers groups are left.
std::vector<Group> joinedByGrid(std::vector<Group> groups) {
    Extent all;
    for (const Group& group : groups) all.add(group.extent);
    for (double cells = 256; groups.size() > kMostMembers; cells /= 2) {
        std::map<std::array<int, 3>, Group> byCell;
        const double cell = all.diagonal() / cells;
        for (Group& group : groups) {
            const glm::dvec3 at = (group.extent.middle() - all.low) / cell;
            Group& there = byCell[{int(at.x), int(at.y), int(at.z)}];
            there = joined(std::move(there), std::move(group));
        }
        groups.clear();
        for (auto& [at, group] : byCell) groups.push_back(std::move(group));
    }
    return groups;
}

// Joins groups for which `belong` returns true of their extents, repeatedly until no two belong
// together. Begins with the largest, so that the result does not depend on the order of the groups.
template <class Belong>
std::vector<Group> groupsOf(std::vector<Group> open, const Belong& belong) {
    std::vector<Group> groups;
    open = joinedByGrid(std::move(open));
    std::sort(open.begin(), open.end(), [](const Group& a, const Group& b) {
        auto key = [](const Group& g) {
            return std::make_tuple(-g.extent.diagonal(), g.extent.low.x, g.extent.low.y,
                                   g.extent.low.z, g.members.front());
        };
        return key(a) < key(b);
    });
    for (Group& next : open) {
        Group group = std::move(next);
        for (size_t k = 0; k < groups.size();) {
            if (!belong(groups[k].extent, group.extent)) {
                ++k;
                continue;
            }
            const Extent before = groups[k].extent;
            group = joined(std::move(group), std::move(groups[k]));
            groups.erase(groups.begin() + ptrdiff_t(k));
            // A group that has grown may belong to groups that were compared before.
            if (group.extent.low != before.low || group.extent.high != before.high) k = 0;
        }
        groups.push_back(std::move(group));
    }
    return groups;
}

// Returns whether the extent of both together is at most that of the larger one plus most of that
// of the smaller one.
bool areOneIsland(const Extent& a, const Extent& b) {
    Extent both = a;
    both.add(b);
    const double one = a.diagonal(), other = b.diagonal();
    return both.diagonal() <= std::max(one, other) + kMostOfSmaller * std::min(one, other);
}

bool areTogether(const Extent& a, const Extent& b) {
    return a.isNear(b, kTogether * std::max(a.diagonal(), b.diagonal()));
}

bool doTouch(const Extent& a, const Extent& b) {
    return a.isNear(b, kTouch * std::min(a.diagonal(), b.diagonal()));
}

// Computes the patch sizes of all surfaces, island by island.
class Sizing {
  public:
    explicit Sizing(const std::vector<Surface>& surfaces)
        : surfaces(surfaces), sizes(surfaces.size(), 0) {}

    // Sets the sizes of an island's surfaces, multiplied by a factor.
    void setSizes(const Group& island, double factor) {
        for (size_t m : island.members)
            sizes[m] = factor * island.extent.diagonal() / kPatchesAcross;
        refine(island.members, island.extent.diagonal(), factor);
    }

    // Returns the estimated number of patches of some surfaces.
    double patchesOf(const Members& members) const {
        double count = 0;
        for (size_t m : members) count += patchesOf(m, sizes[m]);
        return count;
    }

    // Returns the sizes per surface, m, and leaves the object empty.
    std::vector<double> take() { return std::move(sizes); }

  private:
    double patchesOf(size_t m, double size) const {
        const double faces = double(surfaces[m].faces);
        return size > 0 ? std::max(faces, surfaces[m].area / (size * size)) : faces;
    }

    // Reduces the sizes of groups that are tiny compared to the surfaces around, whose diagonal is
    // given, and of tiny groups within these groups. Sizes are multiplied by a factor.
    void refine(const Members& around, double diagonal, double factor) {
        std::map<uint32_t, Group> objects;
        for (size_t m : around) {
            Group& object = objects[surfaces[m].object];
            object.extent.add(surfaces[m].extent);
            object.members.push_back(m);
        }
        std::vector<Group> tiny;
        for (auto& [index, object] : objects) {
            std::vector<Group> parts;
            for (size_t m : object.members) parts.push_back({surfaces[m].extent, {m}});
            if (object.extent.diagonal() < kThing * diagonal)
                parts = groupsOf(std::move(parts), doTouch);
            for (Group& part : parts)
                if (part.extent.diagonal() < kTiny * diagonal) tiny.push_back(std::move(part));
        }
        if (tiny.empty()) return;
        const double before = patchesOf(around);
        double after = 0;
        std::vector<std::pair<Group, double>> finer;
        for (Group& group : groupsOf(std::move(tiny), areTogether)) {
            const double own = group.extent.diagonal();
            if (!(own > 0) || own >= diagonal) continue;
            const double ratio = own / (kTiny * diagonal);
            const double coarser =
                std::pow(1 / kTiny, std::max(0.0, 1 + std::log(ratio) / std::log(kFull)));
            const double size = factor * own / kPatchesAcross * std::max(1.0, coarser);
            for (size_t m : group.members) after += patchesOf(m, std::min(sizes[m], size));
            finer.emplace_back(std::move(group), size);
        }
        const double more = std::sqrt(std::max(1.0, after / (kMostOfTiny * before)));
        for (const auto& [group, size] : finer) {
            for (size_t m : group.members) sizes[m] = std::min(sizes[m], more * size);
            refine(group.members, group.extent.diagonal(), more * factor);
        }
    }

    const std::vector<Surface>& surfaces;
    std::vector<double> sizes;
};

}  // namespace

PatchSizes automaticPatchSizes(const std::vector<Surface>& surfaces) {
    std::vector<Group> all;
    for (size_t m = 0; m < surfaces.size(); ++m)
        if (!surfaces[m].extent.isEmpty()) all.push_back({surfaces[m].extent, {m}});
    PatchSizes result;
    result.island.assign(surfaces.size(), 0);
    std::vector<Group> islands = groupsOf(std::move(all), areOneIsland);
    if (islands.empty()) {
        result.size.assign(surfaces.size(), 0);
        return result;
    }
    Sizing sizing(surfaces);
    std::vector<double> count;
    std::vector<bool> isBlind;  // per island: sees nothing of itself
    for (const Group& island : islands) {
        sizing.setSizes(island, 1);
        count.push_back(sizing.patchesOf(island.members));
        isBlind.push_back(island.members.size() == 1 &&
                          !surfaces[island.members.front()].seesItself);
    }

    // Order islands by importance, and equal ones by their distance from the world's origin.
    std::vector<size_t> order(islands.size());
    std::iota(order.begin(), order.end(), size_t(0));
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
        auto key = [&](size_t k) {
            const double about = std::round(16 * std::log2(std::max(1.0, count[k])));
            return std::make_tuple(isBlind[k], -about, glm::length(islands[k].extent.middle()));
        };
        return key(a) < key(b);
    });
    const double first = count[order[0]];
    size_t important = 1;
    while (important < std::min(order.size(), kMostImportant) &&
           isBlind[order[important]] == isBlind[order[0]] &&
           count[order[important]] >= kAsImportant * first)
        ++important;
    double others = 0;
    for (size_t k = important; k < order.size(); ++k) others += count[order[k]];
    const double factor = std::sqrt(std::max(1.0, others / (kMostOfOthers * first)));
    const double largest = kLargest * islands[order[0]].extent.diagonal();
    for (size_t k = important; k < order.size(); ++k) {
        throwIfCancelledAt(k);
        const Group& island = islands[order[k]];
        const double own = island.extent.diagonal(),
                     few = std::sqrt(count[order[k]] / (kMostOfVast * first));
        sizing.setSizes(island, own > 0 ? std::min(factor, std::max(largest / own, few)) : 1);
    }

    result.size = sizing.take();
    for (size_t k = 0; k < order.size(); ++k) {
        throwIfCancelledAt(k);
        for (size_t m : islands[order[k]].members) result.island[m] = uint32_t(k);
        result.extent.push_back(islands[order[k]].extent);
    }
    return result;
}

}  // namespace raybundle
