// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/area_average.h"

#include <algorithm>

#include "job/cancellation.h"
#include "patches/side.h"

namespace raybundle {

std::vector<std::vector<glm::vec3>> areaAverage(
    const LitSurfaces& surfaces, const InstanceSide& surface,
    const std::vector<const std::vector<glm::vec3>*>& fields) {
    const auto& [patches, exposed] = surfaces;
    const auto& [range, regions, side] = surface;
    std::vector<std::vector<glm::dvec3>> sums(
        fields.size(), std::vector<glm::dvec3>(regions.nodeCount, glm::dvec3(0.0)));
    std::vector<double> weights(regions.nodeCount, 0.0);
    const CornerWeights cornerWeights(surfaces, range, side);
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        throwIfCancelledAt(p);
        const Parent& parent = patches.parents[p];
        const Cell& cell = patches.cells[parent.cell];
        for (uint32_t k = 0; k < parent.patchCount(); ++k) {
            const uint32_t index = 2 * (parent.firstPatch + k) + uint32_t(side);
            const auto [shares, all] = cornerWeights.of(p, k);
            const double area = double(patches.area[patchOf(index)]) *
                                double(std::max(exposed[index], kLeastExposure)) * double(all);
            for (size_t a = 0; a < 4; ++a) {
                if (cell.corner[a] < 0 || shares[a] <= 0) continue;
                const uint32_t node = regions.nodeOf[size_t(cell.corner[a])];
                const double weight = area * double(shares[a]);
                weights[node] += weight;
                for (size_t f = 0; f < fields.size(); ++f)
                    sums[f][node] += weight * glm::dvec3((*fields[f])[index]);
            }
        }
    }
    std::vector<std::vector<glm::vec3>> result;
    for (const std::vector<glm::dvec3>& sum : sums) {
        result.emplace_back(regions.nodeCount, glm::vec3(0.0f));
        for (size_t v = 0; v < sum.size(); ++v)
            if (weights[v] > 0) result.back()[v] = glm::vec3(sum[v] / weights[v]);
    }
    return result;
}

}  // namespace raybundle
