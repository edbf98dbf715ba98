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
// cell is some 25 degrees wide, or some 70 in the coarsest clusters.
constexpr int kNormalCells = 8, kFewestNormalCells = 3;
// Width of a cell of positions, relative to the target edge of a tile.
constexpr float kWidth = 0.5f;
// Patches larger than this share of a cell's area are in no cluster.
constexpr float kSmall = 0.25f;
// Clusters below this share of a cell's area are remnants, which become part of others. A remnant
// would need denser lines than others, and its light is hardly seen.
constexpr float kRemnant = 0.25f;
// Clusters are coarsened by steps of this factor, and at most to kCoarsest times their usual width.
constexpr float kCoarser = 1.5f, kCoarsest = 64;
// Steps by which more surfaces count as dense. Small surfaces come first, larger patches later.
constexpr Density kDensities[] = {{0.5f, 1000}, {0.5f, 64}, {0.5f, 1}, {1, 1},
                                  {2, 1},       {4, 1},     {8, 1},    {16, 1}};
// Beside a dense surface of their object, others need only one of this many patches to be dense.
constexpr size_t kBeside = 8;

// Returns the cell of a unit normal, by the octahedral map with `cells` cells along each edge.
glm::ivec2 cellOf(const glm::vec3& normal, int cells) {
    const glm::vec3 a = glm::abs(normal);
    glm::vec2 p = glm::vec2(normal) / (a.x + a.y + a.z);
    if (normal.z < 0)
        p = (1.0f - glm::abs(glm::vec2(p.y, p.x))) *
            glm::vec2(p.x < 0 ? -1.0f : 1.0f, p.y < 0 ? -1.0f : 1.0f);
    const auto cell = [cells](float x) {
        return std::clamp(int(0.5f * (x + 1) * float(cells)), 0, cells - 1);
    };
    return {cell(p.x), cell(p.y)};
}

// Surface, object, material, cell of the normal (2 numbers), and cell of the position (3 numbers).
using Key = std::array<uint32_t, 8>;
struct HashOf {
    size_t operator()(const Key& key) const {
        uint64_t mixed = 0;
        for (const uint32_t part : key) mixed = mixBits(mixed ^ part);
        return size_t(mixed);
    }
};

// The clusters that cells form, by their keys.
class Clustering {
  public:
    // Adds a patch of the given area to the cluster of a key, whose number is returned. A cluster
    // is a remnant if its area ends below `least`. Areas are in m^2.
    uint32_t add(const Key& key, float area, float least) {
        const auto [it, isNew] = numbers.try_emplace(key, uint32_t(clusters.size()));
        if (isNew) clusters.push_back({key, 0, least});
        clusters[it->second].area += area;
        return it->second;
    }

    // Returns per cluster the number of the cluster that it becomes part of: itself, or for
    // remnants the largest cluster in a neighbouring cell of positions or of normals. Numbers begin
    // at 0, in the order of add().
    std::vector<uint32_t> withoutRemnants() const {
        std::vector<uint32_t> host(clusters.size());
        for (uint32_t c = 0; c < host.size(); ++c) {
            throwIfCancelledAt(c);
            host[c] = isRemnant(c) ? largestBeside(c) : c;
        }
        std::vector<uint32_t> merged(host.size()), numberOf(host.size(), kNoCluster);
        uint32_t count = 0;
        for (uint32_t c = 0; c < host.size(); ++c) {
            // Each host is larger than its guest, so that this ends.
            uint32_t last = c;
            while (host[last] != last) last = host[last];
            if (numberOf[last] == kNoCluster) numberOf[last] = count++;
            merged[c] = numberOf[last];
        }
        return merged;
    }

  private:
    struct OfCell {
        Key key;
        float area, least;  // m^2
    };
    bool isRemnant(uint32_t c) const { return clusters[c].area < clusters[c].least; }
    // Returns the largest cluster beside a cluster that is larger than this, or else itself.
    uint32_t largestBeside(uint32_t c) const {
        uint32_t best = c;
        for (size_t part = kFirstOfCells; part < clusters[c].key.size(); ++part)
            for (const uint32_t step : {1u, UINT32_MAX}) {
                Key key = clusters[c].key;
                key[part] += step;
                if (const auto found = numbers.find(key);
                    found != numbers.end() && clusters[found->second].area > clusters[best].area)
                    best = found->second;
            }
        return best;
    }

    static constexpr size_t kFirstOfCells = 3;  // parts of a key from here on number cells
    std::unordered_map<Key, uint32_t, HashOf> numbers;
    std::vector<OfCell> clusters;
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

// Returns the number of clusters, and of patches in none.
size_t countOf(const std::vector<uint32_t>& cluster) {
    size_t count = 0, clusters = 0;
    for (const uint32_t c : cluster)
        if (c == kNoCluster)
            ++count;
        else
            clusters = std::max(clusters, size_t(c) + 1);
    return count + clusters;
}

}  // namespace

std::vector<uint32_t> findClusters(const Patches& patches, const std::vector<bool>& isIn,
                                   float coarseness) {
    const int cells = std::max(kFewestNormalCells, int(std::lround(kNormalCells / coarseness)));
    std::vector<uint32_t> cluster(patches.count(), kNoCluster);
    Clustering found;
    for (uint32_t patch = 0; patch < cluster.size(); ++patch) {
        throwIfCancelledAt(patch);
        if (!isIn[patch]) continue;
        const Parent& parent = patches.parentAt(2 * patch);
        const Island& island = patches.islands[parent.island];
        const float width = coarseness * kWidth * island.size;
        if (!(patches.area[patch] <= kSmall * width * width)) continue;
        const glm::vec3 at = patches.point(patch, glm::vec2(0.5f)) - island.centre;
        const glm::ivec3 place(glm::floor(patches.axes * at / width));
        const glm::ivec2 facing = cellOf(patches.axes * parent.normal, cells);
        cluster[patch] =
            found.add({parent.surface, parent.instance, parent.scattering, uint32_t(facing.x),
                       uint32_t(facing.y), uint32_t(place.x), uint32_t(place.y), uint32_t(place.z)},
                      patches.area[patch], kRemnant * width * width);
    }
    const std::vector<uint32_t> merged = found.withoutRemnants();
    for (uint32_t& c : cluster)
        if (c != kNoCluster) c = merged[c];
    partAtWalls(patches, cluster);
    return cluster;
}

std::vector<bool> findDense(const Patches& patches, const Density& density) {
    std::vector<size_t> counts;  // per connected surface: number of its small patches
    auto isSmall = [&](uint32_t patch) {
        const float edge = density.edge * patches.islandAt(2 * patch).size;
        return patches.area[patch] <= edge * edge;
    };
    const std::vector<uint32_t> pieces = piecesOfCells(patches);
    std::vector<bool> isDense(patches.count());
    for (uint32_t patch = 0; patch < isDense.size(); ++patch) {
        throwIfCancelledAt(patch);
        const Parent& parent = patches.parentAt(2 * patch);
        isDense[patch] = !parent.isAdapted && canJoin(patches, patch) && pieces[parent.cell] == 1 &&
                         isSmall(patch);
        const size_t surface = parent.surface;
        counts.resize(std::max(counts.size(), surface + 1));
        counts[surface] += isDense[patch];
    }
    std::vector<bool> hasDense;  // per instance: whether any of its surfaces is dense by itself
    for (const Parent& parent : patches.parents) {
        hasDense.resize(std::max(hasDense.size(), size_t(parent.instance) + 1));
        if (counts[parent.surface] >= density.fewest) hasDense[parent.instance] = true;
    }
    for (uint32_t patch = 0; patch < isDense.size(); ++patch) {
        const Parent& parent = patches.parentAt(2 * patch);
        const size_t fewest = density.fewest / (hasDense[parent.instance] ? kBeside : 1);
        if (counts[parent.surface] < fewest) isDense[patch] = false;
    }
    return isDense;
}

void chooseDensity(const std::vector<bool>& isBaked, size_t most, Patches& patches) {
    for (const Density& density : kDensities) {
        patches.density = density;
        patches.isDense = findDense(patches, density);
        size_t others = 0;
        for (uint32_t patch = 0; patch < patches.count(); ++patch)
            others += !patches.isDense[patch] && isBaked[patches.parentAt(2 * patch).instance];
        if (others <= most) break;
    }
}

Clusters::Clusters(const Patches& all, const std::vector<bool>& isShown, size_t most) : all(&all) {
    std::vector<bool> isIn(all.count());
    for (uint32_t patch = 0; patch < isIn.size(); ++patch)
        isIn[patch] = !isShown[2 * patch] && !isShown[2 * patch + 1] && canJoin(all, patch);
    std::vector<uint32_t> cluster = findClusters(all, isIn);
    for (size_t last = SIZE_MAX, now = countOf(cluster);
         now > most && now < last && width < kCoarsest; now = countOf(cluster)) {
        last = now;
        width *= kCoarser;
        cluster = findClusters(all, isIn, width);
    }
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
