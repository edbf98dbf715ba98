// SPDX-License-Identifier: GPL-3.0-or-later
#include "stated_error/noise.h"

#include <algorithm>
#include <cmath>

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

// Returns per side of the tiles the index of its cell and side: 2 * cell, + 1 for backs.
std::vector<uint32_t> cellsOf(const Patches& tiles) {
    std::vector<uint32_t> cells(tiles.sideCount());
    for (uint32_t side = 0; side < cells.size(); ++side)
        cells[side] = 2 * tiles.parentAt(side).cell + isBack(side);
    return cells;
}

}  // namespace

Noise::Noise(const Looks& before, const std::vector<float>& weight,
             const std::vector<float>& directError, const std::vector<uint32_t>& cellOf)
    : weight(weight),
      directError(directError),
      cellOf(cellOf),
      looked(before.count),
      before(before) {}

void Noise::measure(const std::array<Irradiance, 2>& half) {
    const size_t n = weight.size();
    difference.resize(n);
    // Sums over the sides of a cell. `weight`: of the weight w. `difference` and `light`: of w
    // times half the difference, and times the mean, of the halves. `direct`: of w^2 times the
    // variance of the first shot. `squares0` to `squares2`: of w^2 times the powers of half the
    // difference, for the noise that differs from side to side. `sides`: number of sides with a
    // weight.
    struct Cell {
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
    std::vector<Cell> cells(n > 0 ? *std::max_element(cellOf.begin(), cellOf.end()) + 1 : 0);
    double squares = 0, direct = 0;
    signal = 0;
    for (size_t side = 0; side < n; ++side) {
        throwIfCancelledAt(side);
        const glm::dvec3 a(half[0].direct[side] + half[0].indirect[side]);
        const glm::dvec3 b(half[1].direct[side] + half[1].indirect[side]);
        const double w = double(weight[side]);
        const double variance = 3 * double(directError[side]) * double(directError[side]);
        difference[side] = glm::vec3(0.5 * (a - b));
        squares += w * 0.25 * glm::dot(a - b, a - b);
        direct += w * variance;
        signal += w * 0.25 * glm::dot(a + b, a + b);
        Cell& cell = cells[cellOf[side]];
        cell.weight += w;
        cell.difference += w * 0.5 * (a - b);
        cell.light += w * 0.5 * (a + b);
        cell.direct += w * w * variance;
        if (!(w > 0)) continue;
        ++cell.sides;
        cell.squares0 += w * w;
        cell.squares1 += w * w * 0.5 * (a - b);
        cell.squares2 += w * w * 0.25 * glm::dot(a - b, a - b);
    }
    double variance = 0;
    ofCells.assign(cells.size(), {});
    for (size_t c = 0; c < cells.size(); ++c) {
        throwIfCancelledAt(c);
        const Cell& cell = cells[c];
        if (!(cell.weight > 0)) continue;
        const double noise = glm::dot(cell.difference, cell.difference) / cell.weight;
        variance += cell.direct / cell.weight;
        ofCells[c] = {cell.weight, noise / cell.weight, cell.random() / cell.weight,
                      cell.direct / (cell.weight * cell.weight),
                      glm::dot(cell.light, cell.light) / (cell.weight * cell.weight)};
    }
    const double scale = signal > 0 ? 1 / signal : 0;
    bundleNoise = squares * scale;
    directNoise = direct * scale;
    directOfCells = variance * scale;
}

void Noise::look(const std::array<Irradiance, 2>& half, uint32_t count, double sharedBias) {
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

void Noise::lookAgain(const std::array<Irradiance, 2>& half) {
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
                   const std::vector<float>& weight, const Patches& tiles)
    : errorOfSets(std::move(errors)), cellOf(cellsOf(tiles)), directError(weight.size()) {
    for (size_t side = 0; side < directError.size(); ++side) {
        double variance = 0;
        for (const std::vector<float>& error : errorOfSets)
            variance += double(error[side]) * double(error[side]);
        directError[side] = float(std::sqrt(variance));
    }
    noises.emplace_back(before, weight, directError, cellOf);
    for (size_t k = 1; k < errorOfSets.size(); ++k)
        noises.emplace_back(before, weight, errorOfSets[k], cellOf);
}

template <class Look>
void SetNoise::lookAtAll(const std::vector<std::array<Irradiance, 2>>& halves, const Look& look) {
    throwIfCancelled();
    if (halves.size() == 1) return look(noises.front(), halves.front());
    std::array<Irradiance, 2> all = halves.front();
    for (size_t k = 1; k < halves.size(); ++k) {
        look(noises[k], halves[k]);
        for (size_t h = 0; h < 2; ++h)
            for (size_t side = 0; side < directError.size(); ++side) {
                all[h].direct[side] += halves[k][h].direct[side];
                all[h].indirect[side] += halves[k][h].indirect[side];
            }
    }
    look(noises.front(), all);
}

void SetNoise::look(const std::vector<std::array<Irradiance, 2>>& halves, uint32_t bundles,
                    double bias) {
    lookAtAll(halves, [&](Noise& noise, const std::array<Irradiance, 2>& half) {
        noise.look(half, bundles, bias);
    });
}

void SetNoise::lookAgain(const std::vector<std::array<Irradiance, 2>>& halves) {
    lookAtAll(halves,
              [](Noise& noise, const std::array<Irradiance, 2>& half) { noise.lookAgain(half); });
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
