// SPDX-License-Identifier: GPL-3.0-or-later
#include "patches/parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "job/cancellation.h"
#include "patches/side.h"

namespace raybundle {
namespace {

// The square of a part's width, as a share of the area of its object.
constexpr float kPartOfArea = 1.0f / 64;

// Returns the axis that is closest to a vector, 0 to 5: +x, -x, +y, -y, +z, -z.
int mainAxis(const glm::vec3& v) {
    const glm::vec3 a = glm::abs(v);
    const int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
    return 2 * axis + (v[axis] < 0);
}

}  // namespace

Parts partsOf(const Patches& patches, const std::vector<uint32_t>& sides, bool bySurface) {
    std::vector<float> area;  // per instance, m^2
    for (uint32_t side : sides) {
        throwIfCancelledAt(side);
        const size_t instance = patches.parentAt(side).instance;
        area.resize(std::max(area.size(), instance + 1), 0.0f);
        area[instance] += patches.area[patchOf(side)];
    }
    Parts parts;
    std::map<std::array<int, 7>, uint32_t> numbers;
    for (uint32_t side : sides) {
        throwIfCancelledAt(side);
        const Parent& parent = patches.parentAt(side);
        const float width = std::sqrt(kPartOfArea * area[parent.instance]);
        const glm::vec3 from = patches.islandAt(side).centre;
        const glm::vec3 at =
            patches.axes * (patches.point(patchOf(side), glm::vec2(0.5f)) - from) / width;
        const std::array<int, 7> key{
            int(parent.instance),  bySurface ? int(parent.surface) : 0,
            int(parent.island),    mainAxis(patches.axes * patches.normal(side)),
            int(std::floor(at.x)), int(std::floor(at.y)),
            int(std::floor(at.z))};
        parts.of.push_back(numbers.emplace(key, uint32_t(numbers.size())).first->second);
    }
    parts.count = numbers.size();
    return parts;
}

}  // namespace raybundle
