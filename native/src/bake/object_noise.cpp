// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/object_noise.h"

#include <algorithm>
#include <cmath>

#include "bake/cancellation.h"
#include "reconstruction/reconstruction.h"
#include "reconstruction/smooth_regions.h"

namespace raybundle {
namespace {

constexpr double kGrowthOfGrid = 3, kGrowthPower = 1.2;
// Of n cells the noise is stated 1 + kFewCells / (n + 2) times as high: the halves of six differ by
// less than half of what is usual in one bake of twenty.
constexpr double kFewCells = 3;

}  // namespace

std::vector<double> cornerGrowth(const Scene& scene, const Patches& patches) {
    std::vector<double> growth(scene.instances.size(), kGrowthOfGrid);
    const std::vector<InstanceRange> ranges = instanceRanges(scene, patches);
    parallelFor(size_t(0), growth.size(), [&](size_t i) {
        const InstanceRange& range = ranges[i];
        if (scene.instances[i].role != RB_ROLE_BAKE || range.firstCell == range.lastCell) return;
        const uint32_t corners = smoothRegions(scene.meshes[scene.instances[i].mesh], patches.cells,
                                               range.firstCell, range.lastCell)
                                     .nodeCount;
        growth[i] *= std::pow(double(corners) / (range.lastCell - range.firstCell), kGrowthPower);
    });
    return growth;
}

double bundlesAtCorners(const Noise::OfCell& cell, double growth) {
    return cell.noise + std::max(0.0, growth - 1) * cell.random;
}

std::vector<double> noiseOfObjects(const Scene& scene, const Patches& tiles, const Noise& noise,
                                   const std::vector<double>& growth) {
    const std::vector<InstanceRange> ranges = instanceRanges(scene, tiles);
    const std::vector<Noise::OfCell>& cells = noise.cells();
    const double scale = noise.scale();
    double allLight = 0, allArea = 0;
    for (const Noise::OfCell& cell : cells) {
        allLight += cell.area * cell.light;
        allArea += cell.area;
    }
    const double least = allArea > 0 ? kNearlyBlack * kNearlyBlack * allLight / allArea : 0;
    std::vector<double> result(growth.size(), 0);
    parallelFor(size_t(0), result.size(), [&](size_t i) {
        double squares = 0, light = 0, area = 0, count = 0;
        const size_t end = std::min(2 * size_t(ranges[i].lastCell), cells.size());
        for (size_t c = 2 * size_t(ranges[i].firstCell); c < end; ++c) {
            const Noise::OfCell& cell = cells[c];
            if (!(cell.area > 0)) continue;
            squares += cell.area * (scale * bundlesAtCorners(cell, growth[i]) +
                                    std::max(1.0, growth[i]) * cell.direct);
            light += cell.area * cell.light;
            area += cell.area;
            ++count;
        }
        light = std::max(light, least * area);
        if (light > 0)
            result[i] = kAtCorners * std::sqrt(squares / light) * (1 + kFewCells / (count + 2));
    });
    return result;
}

}  // namespace raybundle
