// SPDX-License-Identifier: GPL-3.0-or-later
#include "stated_error/noisy_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "job/cancellation.h"
#include "patches/parts.h"
#include "patches/side.h"
#include "stated_error/object_noise.h"

namespace raybundle {
namespace {

constexpr uint32_t kNone = UINT32_MAX;
// A cell whose RMS light is below this share of that of the scene or of its island, whichever is
// less, is judged as if it had that much light.
constexpr double kDarkPart = 0.05;
// The noise of a part is averaged over its cells and kOfObject cells of the whole object. The
// latter have the mean noise of the object without its noisiest cells: only the share kUsual of the
// cells counts and never the noisiest one, since a few nearly covered cells are not representative.
constexpr double kOfObject = 4, kUsual = 0.95;
// At the corners of a nearly covered cell, the fit continues the slopes of other cells, and its
// noise has little to do with the noise of the cell: it was up to 6000 times the prediction,
// instead of 0.5 to 2 times. No cell counts with more than this many times the prediction in the
// ratio that is used for its whole object.
constexpr double kMostOverForetold = 8;
// Factor on the squared noise of a part. The difference of the halves is a single sample, and a
// bake tends to end when this sample is small by chance. At a target of 2 % with this factor, no
// object of cornell_box, two_rooms and big_room has more noise than 2.8 % at its 95th percentile (6
// seeds). With a factor of 1.5 the noise is up to 3.5 %, for an eighth fewer bundles.
constexpr double kByChance = 2;
// Time of a line, which is projected, stored and solved with, divided by the time of the local rays
// that give as much information (30 ns a line and 400 ns a ray, measured in cornell_box).
constexpr double kLineOverRays = 0.15;
// Number of lines whose time it takes to look for a face in the windows of finer lines, or to draw
// it in one of them (60 ns each and 80 ns a line, measured in a room with 200,000 and with 500,000
// triangles).
constexpr double kLinesOfFace = 0.75;
// The noise of rays adds or removes power, while lines conserve it. Parts that get more than this
// share of all lines are therefore left to bundles.
constexpr double kMostByRays = 0.4;
// Minimum number of rays of a side, since fewer rays are no useful estimate; and the ratio of the
// samples that rays have to provide to those that would suffice as lines. If bundles alone clean an
// object, most of its parts end below the target. Rays are aimed at each part, whose noise would be
// at the target everywhere without this ratio (95th percentile of the noise: objects of open_court
// 5.1 -> 4.4 %, of instances 6.5 -> 4.4 %).
constexpr double kFewestRays = 8, kSamplesByRays = 2;
// Conditions for more rays on the noisy parts of an object. The last pass must have reduced the
// noise of these parts to less than kWorthMoreRays of what it was. Only parts above kNearlyClean
// targets get more, and at most kMostGrowth times the samples.
constexpr double kWorthMoreRays = 0.85, kNearlyClean = 1.25, kMostGrowth = 4;
// Share of the noise that a pass with twice the rays leaves at best (measured in the rooms of
// house_on_plain). An object gets no more rays if all further passes together cannot clean it.
constexpr double kLeftByPass = 0.55;
// If the target is lower than this value, rays are used on the objects on which they would be used
// with this target, even if they cannot reach the lower one.
constexpr double kUsualTarget = 0.02;
// The noise of an object is this quantile of the noise of its parts: of all parts, or of those that
// need more rays.
constexpr double kMostParts = 0.9;
// Weight of the earlier looks in the average.
constexpr double kOfLooksBefore = 0.5;

}  // namespace

NoisyParts::NoisyParts(const NoisyPartsInput& input)
    : tiles(input.tiles),
      before(input.before),
      partOf(tiles.sideCount(), kNone),
      growth(input.growth),
      shownNoise(input.shownNoise),
      target(input.target) {
    const std::vector<float>& weight = input.weight;
    const Patches& patches = tiles.patches();
    std::vector<uint32_t> sides;
    for (uint32_t side = 0; side < weight.size(); ++side)
        if (weight[side] > 0) sides.push_back(side);
    const Parts found = partsOf(patches, sides, true);
    std::vector<uint32_t> cellNumbers(2 * patches.cells.size(), kNone);
    // Per part that was found: its number for sides that show their light, and for those whose
    // light is gathered, which rays cannot clean.
    std::vector<std::array<uint32_t, 2>> partNumbers(found.count, {kNone, kNone});
    for (size_t k = 0; k < sides.size(); ++k) {
        const uint32_t side = sides[k];
        const Parent& parent = patches.parentAt(side);
        uint32_t& cell = cellNumbers[2 * parent.cell + isBack(side)];
        if (cell == kNone) {
            // A cell belongs to the part of its first side.
            const bool isGathered = input.shown.isGathered(tiles.firstSide(side));
            uint32_t& part = partNumbers[found.of[k]][isGathered];
            if (part == kNone) {
                part = uint32_t(parts.size());
                parts.emplace_back().isGathered = isGathered;
            }
            cell = uint32_t(cells.size());
            cells.push_back({2 * parent.cell + isBack(side), part, parent.island,
                             patches.cells[parent.cell].area()});
        }
        partOf[side] = cells[cell].part;
        Part& part = parts[cells[cell].part];
        part.instance = parent.instance;
        part.isGatheredAtNodes = input.shown.isGatheredAtNodes(tiles.firstSide(side));
        part.strictness = std::pow(input.scene.instances[parent.instance].noiseFactor, -2.0);
        ++part.sides;
    }
}

std::vector<double> NoisyParts::lightOf(const Noise& noise) const {
    const std::vector<Noise::OfCell>& of = noise.cells();
    std::vector<double> light(tiles.patches().islands.size(), 0), area(light.size(), 0);
    for (const SeenCell& cell : cells) {
        light[cell.island] += of[cell.number].area * of[cell.number].light;
        area[cell.island] += of[cell.number].area;
    }
    const double allArea = std::accumulate(area.begin(), area.end(), 0.0);
    const double mean = std::accumulate(light.begin(), light.end(), 0.0) / std::max(allArea, 1e-30);
    std::vector<double> result(cells.size(), 0);
    for (size_t c = 0; c < cells.size(); ++c) {
        const Noise::OfCell& own = of[cells[c].number];
        if (!(own.area > 0)) continue;
        const uint32_t island = cells[c].island;
        result[c] = std::max(own.light,
                             kDarkPart * kDarkPart * std::min(mean, light[island] / area[island]));
    }
    return result;
}

NoisyParts::Measured NoisyParts::measure(const Noise& noise,
                                         const std::vector<double>& light) const {
    const std::vector<Noise::OfCell>& of = noise.cells();
    Measured result{std::vector<double>(parts.size(), 0), std::vector<double>(parts.size(), 0),
                    std::vector<double>(growth.size(), kUsuallyOverForetold)};
    std::vector<double> areas(parts.size(), 0);  // per part: of the measured cells, m^2
    // Per instance: sums over the cells of the measured and of the predicted squares, and the
    // number of cells.
    std::vector<std::array<double, 3>> sums(growth.size(), {0, 0, 0});
    for (size_t c = 0; c < cells.size(); ++c) {
        const Noise::OfCell& own = of[cells[c].number];
        const double squares = shownNoise.ofCells[cells[c].number];
        if (!(light[c] > 0) || squares < 0) continue;
        const size_t part = cells[c].part, instance = parts[part].instance;
        const double share = std::min(1.0, own.area / cells[c].area);
        const double predicted = bundlesAtCorners(own, growth[instance]);
        result.squares[part] += own.area * squares / light[c];
        areas[part] += own.area;
        result.cells[part] += share;
        sums[instance][0] += share * std::min(squares, kMostOverForetold * predicted) / light[c];
        sums[instance][1] += share * predicted / light[c];
        sums[instance][2] += share;
    }
    for (size_t p = 0; p < parts.size(); ++p)
        if (areas[p] > 0) result.squares[p] /= areas[p];
    for (size_t i = 0; i < growth.size(); ++i) {
        const auto& [squares, predicted, count] = sums[i];
        if (predicted > 0)
            result.overForetold[i] =
                (count * squares / predicted + kOfObject * kUsuallyOverForetold) /
                (count + kOfObject);
    }
    return result;
}

std::vector<double> NoisyParts::foretold(const Noise& noise, const std::vector<double>& light,
                                         const Measured& measured) const {
    const std::vector<Noise::OfCell>& of = noise.cells();
    // Sums of the squared noise of cells: per part, and per object without its noisiest cells. Each
    // cell is weighted by the share of it that is exposed and has a result.
    std::vector<double> squares(parts.size(), 0), weights(parts.size(), 0);
    std::vector<std::vector<std::pair<double, double>>> ofInstance(growth.size());
    for (size_t c = 0; c < cells.size(); ++c) {
        if (!(light[c] > 0)) continue;
        const Noise::OfCell& own = of[cells[c].number];
        const size_t part = cells[c].part, instance = parts[part].instance;
        const double relative = bundlesAtCorners(own, growth[instance]) / light[c];
        const double weight = std::min(1.0, own.area / cells[c].area);
        squares[part] += weight * relative;
        weights[part] += weight;
        ofInstance[instance].push_back({relative, weight});
    }
    std::vector<double> usual(growth.size(), 0);
    for (size_t i = 0; i < usual.size(); ++i) {
        std::vector<std::pair<double, double>>& all = ofInstance[i];
        if (all.empty()) continue;
        const size_t count = std::min(size_t(std::ceil(kUsual * double(all.size()))),
                                      std::max(all.size() - 1, size_t(1)));
        std::nth_element(all.begin(), all.begin() + std::ptrdiff_t(count - 1), all.end());
        double sum = 0, weight = 0;
        for (size_t k = 0; k < count; ++k) {
            sum += all[k].first * all[k].second;
            weight += all[k].second;
        }
        if (weight > 0) usual[i] = sum / weight;
    }
    for (size_t p = 0; p < parts.size(); ++p) {
        const double ofObject = usual[parts[p].instance];
        // Corners that gather see many parts of their object, so the noise of the whole object
        // counts.
        squares[p] = parts[p].isGathered
                         ? ofObject
                         : measured.overForetold[parts[p].instance] *
                               (squares[p] + kOfObject * ofObject) / (weights[p] + kOfObject);
    }
    return squares;
}

std::vector<double> NoisyParts::squaresOf(const SetNoise& noise) const {
    const Noise& ofAll = noise.ofLights().front();
    const std::vector<double> light = lightOf(ofAll);
    const Measured measured = measure(ofAll, light);
    std::vector<double> result = foretold(ofAll, light, measured);
    for (size_t p = 0; p < parts.size(); ++p)
        if (const double count = measured.cells[p]; !parts[p].isGathered)
            result[p] = (count * measured.squares[p] + kOfObject * result[p]) / (count + kOfObject);
    for (size_t k = 1; k < noise.ofLights().size(); ++k) {
        const Noise& one = noise.ofLights()[k];
        const std::vector<double> ofSet = foretold(one, lightOf(one), measured);
        for (size_t p = 0; p < parts.size(); ++p) result[p] = std::max(result[p], ofSet[p]);
    }
    for (size_t p = 0; p < parts.size(); ++p)
        result[p] *= (parts[p].isGathered ? 1 : kByChance) * parts[p].strictness;
    return result;
}

void NoisyParts::look(const SetNoise& noise, uint32_t count, const std::vector<float>& lines,
                      double all, double faces) {
    const std::vector<double> squares = squaresOf(noise);
    for (Part& part : parts) part.lines = 0;
    for (size_t side = 0; side < partOf.size(); ++side) {
        throwIfCancelledAt(side);
        if (partOf[side] != kNone) parts[partOf[side]].lines += double(lines[side]);
    }
    const bool isSeenBefore =
        bundles == 0 && count == before.bundles && before.shareOfParts.size() == parts.size();
    for (size_t p = 0; p < parts.size(); ++p) {
        parts[p].last = squares[p];
        parts[p].wanting = kSamplesByRays;
        parts[p].wantsRays = squares[p] > target * target;
        if (isSeenBefore) {
            parts[p].squares = before.shareOfParts[p] * squares[p];
            continue;
        }
        const double foretold =
            bundles > 0 ? parts[p].squares * std::pow(double(bundles) / count, 2 * kNoiseSlope)
                        : squares[p];
        parts[p].squares = kOfLooksBefore * foretold + (1 - kOfLooksBefore) * squares[p];
    }
    ofObjects = squaresOfObjects(squares, true);
    allLines = all;
    allFaces = faces;
    bundles = count;
}

std::vector<double> NoisyParts::shares() const {
    std::vector<double> result;
    for (const Part& part : parts) result.push_back(part.last > 0 ? part.squares / part.last : 1);
    return result;
}

double NoisyParts::excess() const {
    std::vector<const Part*> noisiest;
    for (const Part& part : parts) noisiest.push_back(&part);
    std::stable_sort(noisiest.begin(), noisiest.end(),
                     [](const Part* a, const Part* b) { return a->squares > b->squares; });
    const double timeOfBundles = allLines + kLinesOfFace * allFaces;  // in lines
    const double most = std::min(kLineOverRays * timeOfBundles, kMostByRays * allLines);
    double lines = 0;
    for (const Part* part : noisiest) {
        lines += part->lines;
        // The rays by which nodes gather clean their light as extra rays clean other sides.
        if ((part->isGathered && !part->isGatheredAtNodes) || lines > most)
            return std::sqrt(part->squares) / target;
    }
    return 0;
}

std::vector<double> NoisyParts::squaresOfObjects(const std::vector<double>& squares,
                                                 bool onlyWantingRays) const {
    std::vector<std::vector<double>> ofParts(growth.size());
    for (size_t p = 0; p < parts.size(); ++p)
        if (!parts[p].isGathered && (parts[p].wantsRays || !onlyWantingRays))
            ofParts[parts[p].instance].push_back(squares[p]);
    std::vector<double> result(growth.size(), 0);
    for (size_t i = 0; i < result.size(); ++i) {
        std::vector<double>& own = ofParts[i];
        if (own.empty()) continue;
        std::sort(own.begin(), own.end());
        result[i] = own[size_t(kMostParts * double(own.size() - 1))];
    }
    return result;
}

double NoisyParts::lookWithRays(const SetNoise& noise, uint32_t furtherPasses) {
    const std::vector<double> squares = squaresOf(noise);
    const std::vector<double> now = squaresOfObjects(squares, true);
    const double all = target * target, nearly = kNearlyClean * kNearlyClean * all,
                 inReach = std::pow(kNearlyClean * std::max(target, kUsualTarget), 2) /
                           std::pow(kLeftByPass, 2 * furtherPasses);
    for (size_t p = 0; p < parts.size(); ++p) {
        Part& part = parts[p];
        const double ofObject = now[part.instance], before = ofObjects[part.instance];
        part.wantsRays = part.wantsRays && squares[p] > nearly && ofObject < inReach &&
                         ofObject < kWorthMoreRays * kWorthMoreRays * before;
        if (part.wantsRays) part.wanting *= std::min(squares[p] / all, kMostGrowth);
    }
    ofObjects = squaresOfObjects(squares, true);
    const std::vector<double> left = squaresOfObjects(squares, false);
    return std::sqrt(*std::max_element(left.begin(), left.end())) / target;
}

std::vector<ExtraRays> NoisyParts::rays(const std::vector<std::array<float, 2>>& samples,
                                        uint32_t most) const {
    std::vector<ExtraRays> result;
    for (uint32_t tile = 0; tile < partOf.size(); ++tile) {
        throwIfCancelledAt(tile);
        if (partOf[tile] == kNone) continue;
        const Part& part = parts[partOf[tile]];
        if (part.isGathered || !part.wantsRays) continue;
        const double enough =
            part.wanting * part.last / (target * target) * part.lines / part.sides;
        const uint32_t first = tiles.firstSide(tile);
        for (uint32_t k = 0; k < tiles.patchCount(tile / 2); ++k) {
            const uint32_t side = first + 2 * k;
            const double met = double(samples[side][0] + samples[side][1]);
            const double missing = std::ldexp(enough, -2 * tiles.level(tile / 2)) - met;
            if (!(missing > 0)) continue;
            const double rays = std::clamp(missing / kLinesOfRay, kFewestRays, double(most));
            result.push_back({side, 2 * uint32_t(std::ceil(rays / 2))});
        }
    }
    return result;
}

}  // namespace raybundle
