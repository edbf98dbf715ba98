// SPDX-License-Identifier: GPL-3.0-or-later
#include "stated_error/noise.h"

#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "job/cancellation.h"
#include "patches/side.h"

namespace raybundle {
namespace {

// Relative increase of the stated noise at the first look. It decreases with the square of the
// number of looks.
constexpr double kSmallSample = 0.15;
// Smallest share of the target that the noise of bundles is required to reach. A smaller share
// would take many bundles and would hardly be noticeable beside the noise of the first shot.
constexpr double kLeastOfBundles = 0.6;
// Weight of the earlier looks in the average.
constexpr double kMemory = 0.5;

// Number of cells whose noise one task sums up. Sums do not depend on the number of threads, because
// this number is fixed.
constexpr size_t kCellsOfTask = 4096;

// Sums over sides, as relative squares multiplied by the signal: the noise of bundles, that of the
// first shot, and that of the first shot in the means over cells; and the signal.
struct SceneSums {
    double ofBundles = 0, direct = 0, directOfCells = 0, signal = 0;

    friend SceneSums operator+(const SceneSums& a, const SceneSums& b) {
        return {a.ofBundles + b.ofBundles, a.direct + b.direct, a.directOfCells + b.directOfCells,
                a.signal + b.signal};
    }
};

// Sums over the sides of a cell. `weight`: of the weight w. `difference` and `light`: of w times
// half the difference, and times the mean, of the halves. `direct`: of w^2 times the variance of
// the first shot. `squares0` to `squares2`: of w^2 times the powers of half the difference, for the
// noise that differs from side to side. `sides`: number of sides with a weight.
struct CellSums {
    double weight = 0, direct = 0, sides = 0;
    glm::dvec3 difference{0.0}, light{0.0};
    double squares0 = 0, squares2 = 0;
    glm::dvec3 squares1{0.0};

    // Returns `weight` times the part of the squared noise of the cell's mean that is caused by
    // random differences between its sides.
    double random() const {
        if (sides < 2) return 0;
        const glm::dvec3 mean = difference / weight;
        const double sum =
            squares2 - 2 * glm::dot(mean, squares1) + glm::dot(mean, mean) * squares0;
        return std::max(0.0, sum) / weight * sides / (sides - 1);
    }
};

}  // namespace

SidesOfCells::SidesOfCells(const Patches& tiles)
    : sides(tiles.sideCount()), first(2 * tiles.cells.size() + 2, 0) {
    auto cellAt = [&](uint32_t side) { return 2 * tiles.parentAt(side).cell + isBack(side); };
    for (uint32_t side = 0; side < sides.size(); ++side) ++first[cellAt(side) + 2];
    for (size_t c = 2; c < first.size(); ++c) first[c] += first[c - 1];
    for (uint32_t side = 0; side < sides.size(); ++side) sides[first[cellAt(side) + 1]++] = side;
    first.pop_back();
}

Noise::Noise(const Looks& before, const std::vector<float>& weight,
             const std::vector<float>& directError, const SidesOfCells& cells)
    : weight(weight),
      directError(directError),
      sidesOf(cells),
      looked(before.count),
      before(before) {}

void Noise::measure(const LightOfHalves& half) {
    difference.resize(weight.size());
    ofCells.resize(sidesOf.count());
    auto measureCell = [&](size_t c, SceneSums& sums) {
        CellSums cell;
        for (size_t k = sidesOf.first[c]; k < sidesOf.first[c + 1]; ++k) {
            const uint32_t side = sidesOf.sides[k];
            const glm::dvec3 a(half[0][side]), b(half[1][side]);
            difference[side] = glm::vec3(0.5 * (a - b));
            const double w = double(weight[side]);
            if (!(w > 0)) continue;
            const double variance = 3 * double(directError[side]) * double(directError[side]);
            const double squares = 0.25 * glm::dot(a - b, a - b);
            sums.ofBundles += w * squares;
            sums.direct += w * variance;
            sums.signal += w * 0.25 * glm::dot(a + b, a + b);
            cell.weight += w;
            cell.difference += w * 0.5 * (a - b);
            cell.light += w * 0.5 * (a + b);
            cell.direct += w * w * variance;
            ++cell.sides;
            cell.squares0 += w * w;
            cell.squares1 += w * w * 0.5 * (a - b);
            cell.squares2 += w * w * squares;
        }
        ofCells[c] = {};
        if (!(cell.weight > 0)) return;
        const double noise = glm::dot(cell.difference, cell.difference) / cell.weight;
        sums.directOfCells += cell.direct / cell.weight;
        ofCells[c] = {cell.weight, noise / cell.weight, cell.random() / cell.weight,
                      cell.direct / (cell.weight * cell.weight),
                      glm::dot(cell.light, cell.light) / (cell.weight * cell.weight)};
    };
    const SceneSums sums = tbb::parallel_deterministic_reduce(
        tbb::blocked_range<size_t>(0, ofCells.size(), kCellsOfTask), SceneSums{},
        [&](const auto& range, SceneSums before) {
            for (size_t c = range.begin(); c < range.end(); ++c) measureCell(c, before);
            return before;
        },
        std::plus<SceneSums>());
    throwIfCancelled();
    signal = sums.signal;
    const double scale = signal > 0 ? 1 / signal : 0;
    bundleNoise = sums.ofBundles * scale;
    directNoise = sums.direct * scale;
    directOfCells = sums.directOfCells * scale;
}

void Noise::look(const LightOfHalves& half, uint32_t count, double sharedBias) {
    measure(half);
    bias = sharedBias;
    if (bundles == 0 && count == before.bundles) {
        // An earlier bake has already looked at these lines.
        pooled = before.share * bundleNoise;
    } else {
        // The noise that the earlier looks predict for this number of bundles.
        const double foretold =
            bundles > 0 ? pooled * std::pow(double(bundles) / count, 2 * kNoiseSlope) : bundleNoise;
        pooled = kMemory * foretold + (1 - kMemory) * bundleNoise;
        ++looked;
    }
    bundles = count;
}

void Noise::lookAgain(const LightOfHalves& half) {
    const double share = looks().share;
    measure(half);
    pooled = share * bundleNoise;
}

double Noise::factor() const { return 1 + kSmallSample / (double(looked) * looked); }

double Noise::relative() const {
    return signal > 0 ? std::hypot(ofBundles(), std::sqrt(directNoise)) : 0;
}

double Noise::ofBundles() const {
    return signal > 0 ? std::hypot(factor() * std::sqrt(pooled), bias) : 0;
}

double Noise::excess(double target) const {
    const double all = target * target, least = kLeastOfBundles * kLeastOfBundles * all;
    const double left = all - directNoise;
    return ofBundles() / std::sqrt(left > least ? left : std::max(least, all - directOfCells));
}

Looks Noise::looks() const { return {looked, bundles, bundleNoise > 0 ? pooled / bundleNoise : 1}; }

double Noise::scale() const {
    return bundleNoise > 0 ? factor() * factor() * pooled / bundleNoise : 0;
}

std::vector<glm::vec3> Noise::perSide() const {
    const float factor = float(std::sqrt(scale()));
    std::vector<glm::vec3> result = difference;
    for (glm::vec3& d : result) d *= factor;
    return result;
}

SetNoise::SetNoise(const Looks& before, std::vector<std::vector<float>> errors,
                   const std::vector<float>& weight, const SidesOfCells& cells)
    : errorOfSets(std::move(errors)), directError(weight.size()) {
    for (size_t side = 0; side < directError.size(); ++side) {
        double variance = 0;
        for (const std::vector<float>& error : errorOfSets)
            variance += double(error[side]) * double(error[side]);
        directError[side] = float(std::sqrt(variance));
    }
    noises.emplace_back(before, weight, directError, cells);
    for (size_t k = 1; k < errorOfSets.size(); ++k)
        noises.emplace_back(before, weight, errorOfSets[k], cells);
}

template <class Look>
void SetNoise::lookAtAll(const std::vector<LightOfHalves>& halves, const Look& look) {
    throwIfCancelled();
    if (halves.size() == 1) return look(noises.front(), halves.front());
    LightOfHalves all = halves.front();
    for (size_t k = 1; k < halves.size(); ++k) {
        look(noises[k], halves[k]);
        for (size_t h = 0; h < 2; ++h)
            parallelFor(size_t(0), all[h].size(),
                        [&](size_t side) { all[h][side] += halves[k][h][side]; });
    }
    look(noises.front(), all);
}

void SetNoise::look(const std::vector<LightOfHalves>& halves, uint32_t bundles, double bias) {
    lookAtAll(halves,
              [&](Noise& noise, const LightOfHalves& half) { noise.look(half, bundles, bias); });
}

void SetNoise::lookAgain(const std::vector<LightOfHalves>& halves) {
    lookAtAll(halves, [](Noise& noise, const LightOfHalves& half) { noise.lookAgain(half); });
}

std::vector<double> SetNoise::relative() const {
    std::vector<double> result;
    for (const Noise& noise : noises) result.push_back(noise.relative());
    return result;
}

double SetNoise::excess(double target) const {
    double most = 0;
    for (const Noise& noise : noises) most = std::max(most, noise.excess(target));
    return most;
}

SideNoise SetNoise::perSide() const {
    SideNoise result(0);
    result.ofBundles = noises.front().perSide();
    result.direct = directError;
    return result;
}

}  // namespace raybundle
