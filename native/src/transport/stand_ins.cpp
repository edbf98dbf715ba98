// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/stand_ins.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

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
// Sides of more than this share of a tile's area stand for themselves.
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

struct Member {
    std::array<int, 5>
        key;         // surface and whether it is the inside, cell of the normal, of the place
    uint32_t order;  // by chance, whatever order the faces have
    uint32_t side;
    bool operator<(const Member& other) const {
        return key != other.key ? key < other.key
                                : std::tie(order, side) < std::tie(other.order, other.side);
    }
};

}  // namespace

StandIns::StandIns(const Patches& patches, const std::vector<bool>* isShown) {
    const uint32_t count = uint32_t(patches.sideCount());
    std::vector<Member> all;
    if (isShown)
        for (uint32_t side = 0; side < count; ++side) {
            throwIfCancelledAt(side);
            const float width = kWidth * patches.islandAt(side).size;
            if ((*isShown)[side] || patches.area[side / 2] > kSmall * width * width) continue;
            const Parent& parent = patches.parentAt(side);
            const auto normal = cellOf(patches.axes * patches.normal(side));
            const glm::ivec3 place(
                glm::floor(patches.axes * patches.point(side / 2, glm::vec2(0.5f)) / width));
            all.push_back({{int(2 * parent.surface + side % 2),
                            normal[0] * kNormalCells + normal[1], place.x, place.y, place.z},
                           hash(side, 0),
                           side});
        }
    if (all.empty()) {
        sides.resize(count);
        std::iota(sides.begin(), sides.end(), 0u);
        return;
    }
    std::sort(all.begin(), all.end());
    numbers.assign(count, 0);
    clusterOf.assign(count, kNone);
    first.push_back(0);
    for (size_t begin = 0, end = 0; begin < all.size(); begin = end) {
        while (end < all.size() && all[end].key == all[begin].key) ++end;
        const size_t gathering =
            std::min(end - begin, std::max<size_t>(kFewest, (end - begin) / kOneOf));
        for (size_t k = begin; k < end; ++k) {
            clusterOf[all[k].side] = uint32_t(first.size() - 1);
            if (k < begin + gathering)
                members.push_back(all[k].side);
            else
                numbers[all[k].side] = kNone;
        }
        first.push_back(uint32_t(members.size()));
        standsForOthers.push_back(gathering < end - begin);
    }
    for (uint32_t side = 0; side < count; ++side) {
        if (numbers[side] == kNone) continue;
        numbers[side] = uint32_t(sides.size());
        sides.push_back(side);
    }
    for (uint32_t& member : members) member = numbers[member];
}

}  // namespace raybundle
