// SPDX-License-Identifier: GPL-3.0-or-later
#include "stated_error/object_noise.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "job/cancellation.h"
#include "reconstruction/least_squares.h"
#include "reconstruction/reconstruction.h"
#include "reconstruction/smooth_regions.h"

namespace raybundle {
namespace {

// The usual value of ShownNoise::overForetold counts as much as the measurement on this many cells
// of an object.
constexpr double kUsualCells = 4;
// Growth of the variance if there are as many corners as cells, and the power of corners per cell
// with which it rises.
constexpr double kGrowthOfGrid = 3, kGrowthPower = 1.2;
// The noise on n cells is stated 1 + kFewCells / (n + 2) times as high. In one bake of twenty, the
// difference of the halves on six cells is less than half of what it usually is.
constexpr double kFewCells = 3;
// Factor on the stated squares, because the difference of the halves is a single sample of an
// object's noise.
constexpr double kStatedOverMeasured = 1.1;

}  // namespace

std::vector<double> cornerGrowth(const Scene& scene, const Patches& patches,
                                 const std::vector<bool>& isGathered) {
    std::vector<double> growth(scene.instances.size(), kGrowthOfGrid);
    const std::vector<InstanceRange> ranges = instanceRanges(scene, patches);
    parallelFor(size_t(0), growth.size(), [&](size_t i) {
        const InstanceRange& range = ranges[i];
        if (isGathered[i]) {
            growth[i] = 1;
            return;
        }
        if (scene.instances[i].role != RB_ROLE_BAKE || range.firstCell == range.lastCell) return;
        const uint32_t corners = smoothRegions(scene.meshes[scene.instances[i].mesh], patches.cells,
                                               range.firstCell, range.lastCell)
                                     .nodeCount;
        growth[i] *= std::pow(double(corners) / (range.lastCell - range.firstCell), kGrowthPower);
    });
    return growth;
}

ShownNoise shownNoise(const Scene& scene, const LitSurfaces& surfaces, const Noise& noise,
                      const LightOfHalves& halves, float regularization,
                      const std::vector<double>& growth, const std::vector<bool>& isGathered) {
    const Patches& tiles = surfaces.patches;
    const std::vector<InstanceRange> ranges = instanceRanges(scene, tiles);
    const std::vector<Noise::OfCell>& cells = noise.cells();
    ShownNoise result{std::vector<double>(growth.size(), kUsuallyOverForetold),
                      std::vector<double>(cells.size(), -1)};
    parallelFor(size_t(0), growth.size(), [&](size_t i) {
        const Instance& instance = scene.instances[i];
        const InstanceRange& range = ranges[i];
        if (instance.role != RB_ROLE_BAKE || range.firstCell == range.lastCell) return;
        if (isGathered[i]) {
            result.overForetold[i] = 1;
            return;
        }
        const SmoothRegions regions = smoothRegions(scene.meshes[instance.mesh], tiles.cells,
                                                    range.firstCell, range.lastCell);
        const LeastSquaresFit fit = leastSquares(surfaces, {range, regions, instance.side},
                                                 regularization, {&halves[0], &halves[1]});
        double shown = 0, foretold = 0, count = 0;
        for (uint32_t c = range.firstCell; c < range.lastCell; ++c)
            for (uint32_t back = 0; back < 2; ++back) {
                const size_t number = 2 * size_t(c) + back;
                if (number >= cells.size() || !(cells[number].area > 0)) continue;
                double squares = 0;
                for (const int32_t corner : tiles.cells[c].corner) {
                    if (corner < 0) continue;
                    const uint32_t node = regions.nodeOf[size_t(corner)];
                    const glm::dvec3 half(0.5f * (fit.fields[0][node] - fit.fields[1][node]));
                    squares += glm::dot(half, half);
                }
                squares /= tiles.cells[c].cornerCount();
                if (fit.isSolved) result.ofCells[number] = squares;
                shown += cells[number].area * squares;
                foretold += cells[number].area * bundlesAtCorners(cells[number], growth[i]);
                ++count;
            }
        if (!fit.isSolved || !(foretold > 0)) return;
        result.overForetold[i] =
            (count * shown / foretold + kUsualCells * kUsuallyOverForetold) / (count + kUsualCells);
    });
    return result;
}

double bundlesAtCorners(const Noise::OfCell& cell, double growth) {
    return cell.noise + std::max(0.0, growth - 1) * cell.random;
}

CornerNoise noiseAtCorners(const Scene& scene, const Patches& tiles, const Noise& noise,
                           const std::vector<double>& growth, const std::vector<double>& shown) {
    const std::vector<InstanceRange> ranges = instanceRanges(scene, tiles);
    const std::vector<Noise::OfCell>& cells = noise.cells();
    const double scale = noise.scale();
    double allLight = 0, allArea = 0;
    for (const Noise::OfCell& cell : cells) {
        allLight += cell.area * cell.light;
        allArea += cell.area;
    }
    const double least = allArea > 0 ? kNearlyBlack * kNearlyBlack * allLight / allArea : 0;
    CornerNoise result{0, std::vector<double>(growth.size(), 0)};
    std::vector<double> squaresOf(growth.size(), 0);
    parallelFor(size_t(0), growth.size(), [&](size_t i) {
        double light = 0, area = 0, count = 0;
        double& squares = squaresOf[i];
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
        squares *= kStatedOverMeasured * shown[i];
        light = std::max(light, least * area);
        if (light > 0)
            result.ofObjects[i] = std::sqrt(squares / light) * (1 + kFewCells / (count + 2));
    });
    const double squares = std::accumulate(squaresOf.begin(), squaresOf.end(), 0.0);
    if (allLight > 0) result.ofAll = std::hypot(std::sqrt(squares / allLight), noise.biasOfBoth());
    return result;
}

}  // namespace raybundle
