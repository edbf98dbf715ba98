// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/stand_ins.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "bake/cancellation.h"
#include "transport/sobol.h"

namespace raybundle {
namespace {

// Of a cluster so many gather, or one of so many of its sides if that is more.
constexpr uint32_t kFewest = 2, kOneOf = 16;
// Cells of the normals along each edge of the octahedron that they are mapped to: some 25 degrees.
constexpr int kNormalCells = 8;
// Width of a cell of places, of a tile.
constexpr float kWidth = 0.5f;
// Sides of more than this share of a cell's area stand for themselves.
constexpr float kSmall = 0.25f;

std::array<int, 2> cellOf(const glm::vec3& normal) {
    const glm::vec3 a = glm::abs(normal);
    glm::vec2 p = glm::vec2(normal) / (a.x + a.y + a.z);
    if (normal.z < 0)
        p = (1.0f - glm::abs(glm::vec2(p.y, p.x))) *
            glm::vec2(p.x < 0 ? -1.0f : 1.0f, p.y < 0 ? -1.0f : 1.0f);
    const auto cell = [](float x) {
        return std::clamp(int(0.5f * (x + 1) * kNormalCells), 0, kNormalCells - 1);
    };
    return {cell(p.x), cell(p.y)};
}

// Surface and whether it is the inside, cell of the normal, cell of the place.
using Key = std::array<int, 5>;
struct HashOf {
    size_t operator()(const Key& key) const {
        uint32_t mixed = 0;
        for (const int part : key) mixed = hash(mixed, uint32_t(part));
        return mixed;
    }
};

}  // namespace

StandIns::StandIns(const Patches& patches, const std::vector<bool>* isShown) {
    const uint32_t count = uint32_t(patches.sideCount());
    std::unordered_map<Key, uint32_t, HashOf> clusters;
    std::vector<uint32_t> small;  // the sides that are in any
    clusterOf.assign(count, kNone);
    if (isShown)
        for (uint32_t side = 0; side < count; ++side) {
            throwIfCancelledAt(side);
            const Island& island = patches.islandAt(side);
            const float width = kWidth * island.size;
            if ((*isShown)[side] || patches.area[side / 2] > kSmall * width * width) continue;
            const auto normal = cellOf(patches.axes * patches.normal(side));
            const glm::vec3 at = patches.point(side / 2, glm::vec2(0.5f)) - island.centre;
            const glm::ivec3 place(glm::floor(patches.axes * at / width));
            const Key key{int(2 * patches.parentAt(side).surface + side % 2),
                          normal[0] * kNormalCells + normal[1], place.x, place.y, place.z};
            clusterOf[side] = clusters.emplace(key, uint32_t(clusters.size())).first->second;
            small.push_back(side);
        }
    if (small.empty()) {
        clusterOf.clear();
        sides.resize(count);
        std::iota(sides.begin(), sides.end(), 0u);
        return;
    }
    std::vector<uint32_t> begin(clusters.size() + 1, 0), inCluster(small.size());
    for (const uint32_t side : small) ++begin[clusterOf[side] + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<uint32_t> next(begin.begin(), begin.end() - 1);
    for (const uint32_t side : small) inCluster[next[clusterOf[side]]++] = side;

    numbers.assign(count, 0);
    first.push_back(0);
    for (uint32_t cluster = 0; cluster < clusters.size(); ++cluster) {
        throwIfCancelledAt(cluster);
        const auto from = inCluster.begin() + begin[cluster];
        const auto to = inCluster.begin() + begin[cluster + 1];
        const auto gathering =
            std::min(to - from, std::max<ptrdiff_t>(kFewest, (to - from) / kOneOf));
        // By chance, whatever order the faces have.
        std::partial_sort(from, from + gathering, to, [](uint32_t a, uint32_t b) {
            return std::make_pair(hash(a, 0), a) < std::make_pair(hash(b, 0), b);
        });
        members.insert(members.end(), from, from + gathering);
        for (auto side = from + gathering; side < to; ++side) numbers[*side] = kNone;
        first.push_back(uint32_t(members.size()));
        standsForOthers.push_back(from + gathering < to);
    }
    for (uint32_t side = 0; side < count; ++side) {
        if (numbers[side] == kNone) continue;
        numbers[side] = uint32_t(sides.size());
        sides.push_back(side);
    }
    for (uint32_t& member : members) member = numbers[member];
}

}  // namespace raybundle
