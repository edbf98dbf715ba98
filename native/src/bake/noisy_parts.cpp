// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/noisy_parts.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bake/cancellation.h"
#include "bake/parts.h"
#include "reconstruction/reconstruction.h"
#include "reconstruction/smooth_regions.h"

namespace raybundle {
namespace {

constexpr uint32_t kNone = UINT32_MAX;
// What is darker than this share of the mean, of the scene and of its island, counts as that.
constexpr double kDark = 0.05;
// The values at corners whose interpolation is nearest to the light have more variance than the means
// of cells, as far as that is random: 3 times in a grid, where there is one corner a cell, and 16
// times on a quad by itself, which has four of them.
constexpr double kGrowthOfGrid = 3, kGrowthPower = 1.2;
// The noise at corners over what that foretells (measured in cornell_box, two_rooms and big_room: 0.9
// to 1.7).
constexpr double kAtCorners = 1.4;
// So many cells of the whole object are added to those of a part, as they are without the noisiest
// ones: a few that are nearly covered say nothing of the others.
constexpr double kOfObject = 4, kUsual = 0.95;
// Time that a line takes, projected, kept and solved with, over that of local rays which tell as much
// (30 ns, and 400 ns a ray; measured in cornell_box).
constexpr double kLineOverRays = 0.15;
// Where there are windows of finer lines, a face takes the time of so many lines in each bundle, for it
// is projected in several of them (1.8 us on 24,000 leaves, most of which lie in some).
constexpr double kLinesOfFace = 30;
// Rays lose and make light by their noise, which lines do not: what gets more than this share of all lines
// is left to these.
constexpr double kMostByRays = 0.4;
// Rays of a side: those that are fewer tell nothing, and those that are more do not end.
constexpr double kFewestRays = 8, kMostRays = 512;
// Share of the parts of an object that rays are to have made clean.
constexpr double kMostParts = 0.9;
constexpr double kOfLooksBefore = 0.5;

}  // namespace

NoisyParts::NoisyParts(const Scene& scene, const Tiles& tiles, const Looks& before,
                       const std::vector<float>& weight, const ShownLight& shown,
                       double projections)
    : tiles(tiles), before(before), partOf(tiles.sideCount(), kNone), projections(projections) {
    const Patches& patches = tiles.patches();
    std::vector<uint32_t> sides;
    for (uint32_t side = 0; side < weight.size(); ++side)
        if (weight[side] > 0) sides.push_back(side);
    const Parts found = partsOf(patches, sides, true);
    std::vector<uint32_t> cellNumbers(2 * patches.cells.size(), kNone);
    std::vector<uint32_t> partNumbers(found.count, kNone);
    for (size_t k = 0; k < sides.size(); ++k) {
        const uint32_t side = sides[k];
        const Parent& parent = patches.parentAt(side);
        uint32_t& cell = cellNumbers[2 * parent.cell + side % 2];
        if (cell == kNone) {
            // A cell is of the part that its first side is of.
            uint32_t& part = partNumbers[found.of[k]];
            if (part == kNone) {
                part = uint32_t(parts.size());
                parts.emplace_back();
            }
            cell = uint32_t(cells.size());
            cells.push_back({2 * parent.cell + side % 2, part, parent.island,
                             patches.cells[parent.cell].area()});
        }
        partOf[side] = cells[cell].part;
        Part& part = parts[cells[cell].part];
        part.instance = parent.instance;
        ++part.sides;
        if (shown.isGathered(tiles.firstSide(side))) part.isGathered = true;
    }
    growth.assign(scene.instances.size(), kGrowthOfGrid);
    const std::vector<InstanceRange> ranges = instanceRanges(scene, patches);
    parallelFor(size_t(0), growth.size(), [&](size_t i) {
        const InstanceRange& range = ranges[i];
        if (scene.instances[i].role != RB_ROLE_BAKE || range.firstCell == range.lastCell) return;
        const uint32_t corners = smoothRegions(scene.meshes[scene.instances[i].mesh], patches.cells,
                                               range.firstCell, range.lastCell)
                                     .nodeCount;
        growth[i] *= std::pow(double(corners) / (range.lastCell - range.firstCell), kGrowthPower);
    });
}

std::vector<double> NoisyParts::squaresOf(const Noise& noise) const {
    const std::vector<Noise::OfCell>& of = noise.cells();
    std::vector<double> light(tiles.patches().islands.size(), 0), area(light.size(), 0);
    for (const SeenCell& cell : cells) {
        light[cell.island] += of[cell.number].area * of[cell.number].light;
        area[cell.island] += of[cell.number].area;
    }
    const double allArea = std::accumulate(area.begin(), area.end(), 0.0);
    const double mean = std::accumulate(light.begin(), light.end(), 0.0) / std::max(allArea, 1e-30);
    // Per part, and of the whole object but for its worst cells: sums of squares, and of cells, which
    // count by how much of them is to be seen.
    std::vector<double> squares(parts.size(), 0), weights(parts.size(), 0);
    std::vector<std::vector<std::pair<double, double>>> ofInstance(growth.size());
    for (const SeenCell& cell : cells) {
        const Noise::OfCell& own = of[cell.number];
        const double dark = kDark * kDark * std::min(mean, light[cell.island] / area[cell.island]);
        if (!(own.area > 0) || !(std::max(own.light, dark) > 0)) continue;
        const size_t instance = parts[cell.part].instance;
        const double share = (own.noise + std::max(0.0, growth[instance] - 1) * own.random) /
                             std::max(own.light, dark);
        const double weight = std::min(1.0, own.area / cell.area);
        squares[cell.part] += weight * share;
        weights[cell.part] += weight;
        ofInstance[instance].push_back({share, weight});
    }
    std::vector<double> usual(growth.size(), 0);
    for (size_t i = 0; i < usual.size(); ++i) {
        std::vector<std::pair<double, double>>& all = ofInstance[i];
        std::sort(all.begin(), all.end());
        double sum = 0, weight = 0;
        for (size_t k = 0; k < size_t(std::ceil(kUsual * double(all.size()))); ++k) {
            sum += all[k].first * all[k].second;
            weight += all[k].second;
        }
        if (weight > 0) usual[i] = sum / weight;
    }
    for (size_t p = 0; p < parts.size(); ++p) {
        const double ofObject = usual[parts[p].instance];
        // Corners that gather see many parts of their object.
        squares[p] = parts[p].isGathered
                         ? ofObject
                         : kAtCorners * kAtCorners * (squares[p] + kOfObject * ofObject) /
                               (weights[p] + kOfObject);
    }
    return squares;
}

std::vector<double> NoisyParts::squaresOf(const SetNoise& noise) const {
    std::vector<double> squares(parts.size(), 0);
    for (const Noise& one : noise.ofLights()) {
        const std::vector<double> own = squaresOf(one);
        for (size_t p = 0; p < parts.size(); ++p) squares[p] = std::max(squares[p], own[p]);
    }
    return squares;
}

void NoisyParts::look(const SetNoise& noise, uint32_t count, const std::vector<float>& lines,
                      double all) {
    const std::vector<double> squares = squaresOf(noise);
    for (Part& part : parts) part.lines = 0;
    for (size_t side = 0; side < partOf.size(); ++side)
        if (partOf[side] != kNone) parts[partOf[side]].lines += double(lines[side]);
    const bool isSeenBefore =
        bundles == 0 && count == before.bundles && before.shareOfParts.size() == parts.size();
    for (size_t p = 0; p < parts.size(); ++p) {
        parts[p].last = squares[p];
        if (isSeenBefore) {
            parts[p].squares = before.shareOfParts[p] * squares[p];
            continue;
        }
        const double foretold =
            bundles > 0 ? parts[p].squares * std::pow(double(bundles) / count, 2 * kNoiseSlope)
                        : squares[p];
        parts[p].squares = kOfLooksBefore * foretold + (1 - kOfLooksBefore) * squares[p];
    }
    allLines = all;
    bundles = count;
}

std::vector<double> NoisyParts::shares() const {
    std::vector<double> result;
    for (const Part& part : parts) result.push_back(part.last > 0 ? part.squares / part.last : 1);
    return result;
}

double NoisyParts::excess(double target) const {
    std::vector<const Part*> noisiest;
    for (const Part& part : parts) noisiest.push_back(&part);
    std::stable_sort(noisiest.begin(), noisiest.end(),
                     [](const Part* a, const Part* b) { return a->squares > b->squares; });
    const double timeOfBundles = allLines + kLinesOfFace * projections * bundles;  // in lines
    const double most = std::min(kLineOverRays * timeOfBundles, kMostByRays * allLines);
    double lines = 0;
    for (const Part* part : noisiest) {
        lines += part->lines;
        if (part->isGathered || lines > most) return std::sqrt(part->squares) / target;
    }
    return 0;
}

double NoisyParts::excessWithRays(const SetNoise& noise, double target) const {
    const std::vector<double> squares = squaresOf(noise);
    std::vector<std::vector<double>> ofInstance(growth.size());
    for (size_t p = 0; p < parts.size(); ++p)
        if (!parts[p].isGathered) ofInstance[parts[p].instance].push_back(squares[p]);
    double most = 0;
    for (std::vector<double>& own : ofInstance) {
        if (own.empty()) continue;
        std::sort(own.begin(), own.end());
        most = std::max(most, own[size_t(kMostParts * double(own.size() - 1))]);
    }
    return std::sqrt(most) / target;
}

std::vector<ExtraRays> NoisyParts::rays(double target,
                                        const std::vector<std::array<float, 2>>& lines) const {
    std::vector<ExtraRays> result;
    for (uint32_t tile = 0; tile < partOf.size(); ++tile) {
        throwIfCancelledAt(tile);
        if (partOf[tile] == kNone) continue;
        const Part& part = parts[partOf[tile]];
        if (part.isGathered || part.last <= target * target) continue;
        const double enough = part.last / (target * target) * part.lines / part.sides;
        const uint32_t first = tiles.firstSide(tile);
        for (uint32_t k = 0; k < tiles.patchCount(tile / 2); ++k) {
            const uint32_t side = first + 2 * k;
            const double met = double(lines[side][0] + lines[side][1]);
            const double missing = std::ldexp(enough, -2 * tiles.level(tile / 2)) - met;
            if (!(missing > 0)) continue;
            const double rays = std::clamp(missing / kLinesOfRay, kFewestRays, kMostRays);
            result.push_back({side, 2 * uint32_t(std::ceil(rays / 2))});
        }
    }
    return result;
}

}  // namespace raybundle
