// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/clusters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <unordered_map>

#include "job/cancellation.h"
#include "patches/side.h"
#include "sampling/mix_bits.h"
#include "scene/disjoint_sets.h"

namespace raybundle {
namespace {

// Cells of normals along each edge of the square to which the octahedral map takes the sphere. A
// cell is some 25 degrees wide.
constexpr int kNormalCells = 8;
// Width of a cell of positions, relative to the target edge of a tile.
constexpr float kWidth = 0.5f;
// Patches larger than this share of a cell's area are in no cluster.
constexpr float kSmall = 0.25f;
// Largest width of the patches of a dense surface, relative to the target edge of a tile, and the
// smallest number of such patches.
constexpr float kDense = 0.5f;
constexpr size_t kFewestOfDense = 1000;

// Returns the cell of a unit normal, by the octahedral map.
int cellOf(const glm::vec3& normal) {
    const glm::vec3 a = glm::abs(normal);
    glm::vec2 p = glm::vec2(normal) / (a.x + a.y + a.z);
    if (normal.z < 0)
        p = (1.0f - glm::abs(glm::vec2(p.y, p.x))) *
            glm::vec2(p.x < 0 ? -1.0f : 1.0f, p.y < 0 ? -1.0f : 1.0f);
    const auto cell = [](float x) {
        return std::clamp(int(0.5f * (x + 1) * kNormalCells), 0, kNormalCells - 1);
    };
    return cell(p.x) * kNormalCells + cell(p.y);
}

// Surface, object, material, cell of the normal, and cell of the position (3 numbers).
using Key = std::array<uint32_t, 7>;
struct HashOf {
    size_t operator()(const Key& key) const {
        uint64_t mixed = 0;
        for (const uint32_t part : key) mixed = mixBits(mixed ^ part);
        return size_t(mixed);
    }
};

// Returns whether a patch may be in a cluster: it is a whole face that is opaque and not
// translucent.
bool canJoin(const Patches& patches, uint32_t patch) {
    return patches.parentAt(2 * patch).patchCount() == 1 && patches.opacityOf(patch) == 1.0f &&
           patches.translucenceOf(2 * patch) == glm::vec3(0.0f) &&
           patches.translucenceOf(2 * patch + 1) == glm::vec3(0.0f);
}

// Returns per cell the number of its parents.
std::vector<uint32_t> piecesOfCells(const Patches& patches) {
    std::vector<uint32_t> pieces(patches.cells.size());
    for (const Parent& parent : patches.parents) ++pieces[parent.cell];
    return pieces;
}

// Returns per connected surface whether a wall passes through any of its cells or stands on an edge
// (patches/crossings.h).
std::vector<bool> surfacesWithWalls(const Patches& patches, const std::vector<uint32_t>& pieces) {
    std::vector<bool> result;
    for (size_t p = 0; p < patches.parents.size(); ++p) {
        throwIfCancelledAt(p);
        const Parent& parent = patches.parents[p];
        result.resize(std::max(result.size(), size_t(parent.surface) + 1));
        if (pieces[parent.cell] > 1 || patches.cells[parent.cell].parted)
            result[parent.surface] = true;
    }
    return result;
}

// Parts clusters through which walls pass, so that no light gets through these walls: only patches
// that are connected within a cluster stay together, and pieces of cells are in no cluster.
void partAtWalls(const Patches& patches, std::vector<uint32_t>& cluster) {
    const std::vector<uint32_t> pieces = piecesOfCells(patches);
    const std::vector<bool> hasWalls = surfacesWithWalls(patches, pieces);
    if (std::find(hasWalls.begin(), hasWalls.end(), true) == hasWalls.end()) return;
    struct Edge {
        uint32_t low, high, patch;
    };
    std::vector<Edge> edges;
    for (uint32_t patch = 0; patch < cluster.size(); ++patch) {
        throwIfCancelledAt(patch);
        const Parent& parent = patches.parentAt(2 * patch);
        if (cluster[patch] == kNoCluster || !hasWalls[parent.surface]) continue;
        if (pieces[parent.cell] > 1) {
            cluster[patch] = kNoCluster;
            continue;
        }
        const int n = parent.isTriangle ? 3 : 4;
        for (int k = 0; k < n; ++k) {
            if (patches.cells[parent.cell].parted >> k & 1) continue;
            const auto [low, high] =
                std::minmax(parent.vertex[size_t(k)], parent.vertex[size_t((k + 1) % n)]);
            edges.push_back({low, high, patch});
        }
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
        return std::tie(a.low, a.high, a.patch) < std::tie(b.low, b.high, b.patch);
    });
    DisjointSets joined(cluster.size());
    for (size_t k = 1; k < edges.size(); ++k) {
        const Edge &a = edges[k - 1], &b = edges[k];
        if (a.low == b.low && a.high == b.high && cluster[a.patch] == cluster[b.patch])
            joined.join(a.patch, b.patch);
    }
    // Clusters of surfaces without walls keep one number, as if they were connected.
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> numbers;
    for (uint32_t patch = 0; patch < cluster.size(); ++patch) {
        if (cluster[patch] == kNoCluster) continue;
        const bool isParted = hasWalls[patches.parentAt(2 * patch).surface];
        cluster[patch] =
            numbers
                .emplace(std::make_pair(cluster[patch], isParted ? joined.root(patch) : UINT32_MAX),
                         uint32_t(numbers.size()))
                .first->second;
    }
}

}  // namespace

std::vector<uint32_t> findClusters(const Patches& patches, const std::vector<bool>& isIn) {
    std::vector<uint32_t> cluster(patches.count(), kNoCluster);
    std::unordered_map<Key, uint32_t, HashOf> clusters;
    for (uint32_t patch = 0; patch < cluster.size(); ++patch) {
        throwIfCancelledAt(patch);
        if (!isIn[patch]) continue;
        const Parent& parent = patches.parentAt(2 * patch);
        const Island& island = patches.islands[parent.island];
        const float width = kWidth * island.size;
        if (!(patches.area[patch] <= kSmall * width * width)) continue;
        const glm::vec3 at = patches.point(patch, glm::vec2(0.5f)) - island.centre;
        const glm::ivec3 place(glm::floor(patches.axes * at / width));
        const Key key{parent.surface,    parent.instance,
                      parent.scattering, uint32_t(cellOf(patches.axes * parent.normal)),
                      uint32_t(place.x), uint32_t(place.y),
                      uint32_t(place.z)};
        cluster[patch] = clusters.emplace(key, uint32_t(clusters.size())).first->second;
    }
    partAtWalls(patches, cluster);
    return cluster;
}

std::vector<bool> findDense(const Patches& patches) {
    std::vector<size_t> counts;  // per connected surface: number of its small patches
    auto isSmall = [&](uint32_t patch) {
        const float edge = kDense * patches.islandAt(2 * patch).size;
        return patches.area[patch] <= edge * edge;
    };
    const std::vector<uint32_t> pieces = piecesOfCells(patches);
    std::vector<bool> isDense(patches.count());
    for (uint32_t patch = 0; patch < isDense.size(); ++patch) {
        throwIfCancelledAt(patch);
        isDense[patch] = canJoin(patches, patch) && pieces[patches.parentAt(2 * patch).cell] == 1 &&
                         isSmall(patch);
        const size_t surface = patches.parentAt(2 * patch).surface;
        counts.resize(std::max(counts.size(), surface + 1));
        counts[surface] += isDense[patch];
    }
    for (uint32_t patch = 0; patch < isDense.size(); ++patch)
        if (counts[patches.parentAt(2 * patch).surface] < kFewestOfDense) isDense[patch] = false;
    return isDense;
}

Clusters::Clusters(const Patches& all, const std::vector<bool>& isShown) : all(&all) {
    std::vector<bool> isIn(all.count());
    for (uint32_t patch = 0; patch < isIn.size(); ++patch)
        isIn[patch] = !isShown[2 * patch] && !isShown[2 * patch + 1] && canJoin(all, patch);
    const std::vector<uint32_t> cluster = findClusters(all, isIn);
    std::vector<uint32_t> numberOf;  // per cluster with patches so far, its patch of `joined`
    std::vector<uint32_t> number(all.count()), size;
    for (uint32_t patch = 0; patch < number.size(); ++patch) {
        uint32_t own = uint32_t(size.size());
        if (const uint32_t c = cluster[patch]; c != kNoCluster) {
            if (c == numberOf.size()) numberOf.push_back(own);
            own = numberOf[c];
        }
        if (own == size.size()) size.push_back(0);
        number[patch] = own;
        ++size[own];
    }
    if (size.size() == all.count()) return;
    numbers = std::move(number);
    first.assign(1, 0);
    for (const uint32_t count : size) first.push_back(first.back() + count);
    memberList.resize(numbers.size());
    std::vector<uint32_t> next(first.begin(), first.end() - 1);
    for (uint32_t patch = 0; patch < numbers.size(); ++patch)
        memberList[next[numbers[patch]]++] = patch;

    joined.emplace();
    joined->centre = all.centre;
    joined->radius = all.radius;
    joined->axes = all.axes;
    joined->islands = all.islands;
    joined->parents = all.parents;
    joined->totalArea = all.totalArea;
    joined->size = all.size;
    joined->finest = all.finest;
    joined->touchDistance = all.touchDistance;
    joined->tileCount = all.tileCount - (all.count() - size.size());
    for (Parent& parent : joined->parents) parent.firstPatch = numbers[parent.firstPatch];
    for (uint32_t k = 0; k < size.size(); ++k) {
        throwIfCancelledAt(k);
        // The first member gives the position of the cluster. It is the largest member, or the
        // first of several that are equally large.
        const auto from = memberList.begin() + first[k], to = memberList.begin() + first[k + 1];
        std::iter_swap(from, std::max_element(from, to, [&](uint32_t a, uint32_t b) {
                           return all.area[a] < all.area[b];
                       }));
        joined->parentOf.push_back(all.parentOf[*from]);
        joined->area.push_back(std::accumulate(
            from, to, 0.0f, [&](float sum, uint32_t patch) { return sum + all.area[patch]; }));
        if (!all.opacity.empty()) joined->opacity.push_back(all.opacity[*from]);
    }
    takeMaterials();
}

size_t Clusters::memberCount() const {
    size_t count = 0;
    for (size_t k = 1; k < first.size(); ++k)
        if (const uint32_t size = first[k] - first[k - 1]; size > 1) count += size;
    return count;
}

void Clusters::takeMaterials() {
    joined->reflectance = mean(all->reflectance);
    joined->emission = mean(all->emission);
    joined->translucence = mean(all->translucence);
    joined->scattering = all->scattering;
    for (size_t i = 0; i < joined->parents.size(); ++i)
        joined->parents[i].scattering = all->parents[i].scattering;
    joined->byAngle.assign(all->byAngle.empty() ? 0 : joined->sideCount(), AngleFactors{});
    for (uint32_t side = 0; side < joined->byAngle.size(); ++side)
        forEachMember(patchOf(side), [&](uint32_t patch, float share) {
            for (size_t term = 0; term < joined->byAngle[side].size(); ++term)
                joined->byAngle[side][term] +=
                    share * all->byAngle[raybundle::sideOf(patch, isBack(side))][term];
        });
}

}  // namespace raybundle
