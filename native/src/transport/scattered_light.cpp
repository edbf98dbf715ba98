// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/scattered_light.h"

#include <tbb/parallel_for_each.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "job/cancellation.h"
#include "patches/side.h"
#include "sampling/sphere_sampling.h"
#include "scene/channels.h"
#include "surfaces/lobe.h"
#include "surfaces/side_reflectance.h"

namespace raybundle {
namespace {

constexpr uint32_t kEdge = ScatteredLight::kEdge, kCells = ScatteredLight::kCells;
// Number of sampled directions along an edge of the unit square, and in all. Each direction stands
// for an equal share of the cosine.
constexpr uint32_t kAlong = 2 * kEdge, kDirections = kAlong * kAlong;
// Largest number of steps in a byte, and the number of steps of a cell that is wholly open to the
// sky.
constexpr float kMostSteps = 127;
constexpr float kOpenSteps = 48;
// Light by direction adds or removes power by its noise. Between sides that reflect nearly all of
// it, as in a slit between white boards, this error grows without bound. In a channel that absorbs
// less than this share, light by direction is therefore reduced in proportion. (Without this, there
// was 8 times the light of the sky between books of pure blue under an even sky. In Cycles it is
// 1.0 to 1.1 times.)
constexpr float kLeastAbsorbed = 0.02f;

int8_t rounded(float steps) {
    return int8_t(std::lround(std::clamp(steps, -kMostSteps, kMostSteps)));
}

Eigen::DiagonalMatrix<float, 3> diagonal(const glm::vec3& v) { return {v.x, v.y, v.z}; }

// Returns the inverse of onDisk(), times kEdge.
glm::vec2 cellsAt(glm::vec2 disk) {
    const float r = glm::length(disk), perAngle = 4 * glm::one_over_pi<float>();
    glm::vec2 p(0.0f);
    if (std::abs(disk.x) > std::abs(disk.y)) {
        p.x = std::copysign(r, disk.x);
        p.y = p.x * perAngle * std::atan(disk.y / disk.x);
    } else if (r > 0) {
        p.y = std::copysign(r, disk.y);
        p.x = p.y * perAngle * std::atan(disk.x / disk.y);
    }
    return (0.5f * p + 0.5f) * float(kEdge);
}

// A place with its cells and their weights.
struct Around : ScatteredLight::Place {
    Around() = default;
    explicit Around(const Place& place) : Place(place) {}
    // `point` is a point of the unit square, times kEdge.
    explicit Around(const glm::vec2& point) {
        const glm::vec2 p = glm::clamp(point - 0.5f, 0.0f, float(kEdge - 1));
        const glm::uvec2 low = glm::min(glm::uvec2(p), glm::uvec2(kEdge - 2));
        const glm::vec2 within = float(kWhole) * (p - glm::vec2(low)) + 0.5f;
        first = uint8_t(low.y * kEdge + low.x);
        s = uint8_t(within.x);
        t = uint8_t(within.y);
    }
    std::array<uint32_t, 4> cells() const {
        return {first, first + 1u, first + kEdge, first + kEdge + 1};
    }
    // Returns the bilinear weights of the four cells.
    std::array<float, 4> shares() const {
        const float x = float(s) / kWhole, y = float(t) / kWhole;
        return {(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y};
    }
    // Returns shares() times kWhole squared.
    std::array<int, 4> wholeShares() const {
        const int x = s, y = t;
        return {(kWhole - x) * (kWhole - y), x * (kWhole - y), (kWhole - x) * y, x * y};
    }
};

// Table of the cells around a direction by its place on the disk. To compute an arc tangent for
// each line would take most of the time.
class AroundTable {
  public:
    AroundTable() {
        for (uint32_t k = 0; k < entries.size(); ++k) {
            const glm::vec2 disk =
                (glm::vec2(k % kSteps, k / kSteps) + 0.5f) * 2.0f / float(kSteps) - 1.0f;
            entries[k] = Around(cellsAt(disk));
        }
    }
    // Returns the entry of a direction. `x` and `y` are the axes of the disk, unit vectors.
    const Around& at(const glm::vec3& x, const glm::vec3& y, const glm::vec3& direction) const {
        auto step = [&](const glm::vec3& axis) {
            const float along = (glm::dot(axis, direction) + 1) * (0.5f * kSteps);
            return std::min(uint32_t(std::max(along, 0.0f)), kSteps - 1);
        };
        return entries[step(y) * kSteps + step(x)];
    }

    static const AroundTable& instance() {
        static const AroundTable table;
        return table;
    }

  private:
    static constexpr uint32_t kSteps = 64;
    std::array<Around, kSteps * kSteps> entries;
};

// The sampled directions, around the z axis, and how values of cells follow from values of
// directions.
struct Samples {
    std::array<glm::vec3, kDirections> directions;
    std::array<glm::vec4, kCells> terms{};  // mean angle terms (scene/angles.h) of each cell
    // Share that each cell gets of light from all directions; the sum is 1.
    ScatteredLight::Hemisphere even{};
    // Matrix that fits values of cells to values of directions: bilinear interpolation between the
    // centres of the cells is then nearest to the values of directions (least squares). Light that
    // is added to cells spreads over four cells, and the transpose of this matrix compensates for
    // that.
    Eigen::Matrix<float, kCells, kDirections> fit;

    Samples() {
        Eigen::Matrix<float, kDirections, kCells> shares;
        shares.setZero();
        for (uint32_t k = 0; k < kDirections; ++k) {
            const glm::vec2 square = (glm::vec2(k % kAlong, k / kAlong) + 0.5f) / float(kAlong);
            const glm::vec2 d = onDisk(square);
            directions[k] = {d, std::sqrt(std::max(0.0f, 1 - glm::dot(d, d)))};
            const glm::uvec2 cell(square * float(kEdge));
            terms[cell.y * kEdge + cell.x] +=
                angleTerms(directions[k].z) * (float(kCells) / kDirections);
            const Around around(square * float(kEdge));
            for (size_t corner = 0; corner < 4; ++corner) {
                shares(k, around.cells()[corner]) += around.shares()[corner];
                even[around.cells()[corner]] += around.shares()[corner] / kDirections;
            }
        }
        fit = (shares.transpose() * shares).ldlt().solve(shares.transpose());
    }

    static const Samples& instance() {
        static const Samples samples;
        return samples;
    }
};

}  // namespace

// How a surface sends arriving light on: exitance towards a cell (row) over irradiance from a cell
// (column).
struct ScatteredLight::Transfer {
    using Matrix = Eigen::Matrix<float, kCells, kCells>;
    // `white` and `edge` are gloss with an f0 of 1 and of 0; gloss of another f0 is a linear
    // combination of them. `rough` is the diffuse part of a rough surface that reflects all light.
    Matrix white = Matrix::Zero(), edge = white, rough = white;
    std::vector<Matrix> lobes;  // per lobe of the surface
    // Means over all entries of the matrices above.
    float whiteMean = 0, edgeMean = 0;
    std::vector<float> lobeMeans;

    explicit Transfer(const Scattering& surface) {
        const glm::vec3 z(0, 0, 1);
        auto gloss = [&](float f0) {
            return between(
                [&](const glm::vec3& from) {
                    return Lobe::gloss(z, from, surface.glossMasking, surface.glossRoughness,
                                       glm::vec3(f0));
                },
                true);
        };
        if (surface.hasGloss()) {
            white = gloss(1);
            edge = gloss(0);
            whiteMean = white.mean();
            edgeMean = edge.mean();
        }
        for (const LobeReflectance& lobe : surface.lobes) {
            lobes.push_back(between(
                [&](const glm::vec3& from) { return Lobe::of(lobe.kind, z, from, lobe.roughness); },
                true));
            lobeMeans.push_back(lobes.back().mean());
        }
        if (surface.isRough())
            rough = between(
                [&](const glm::vec3& from) {
                    return Lobe::diffuse(z, from, surface.diffuseModel, surface.diffuseRoughness);
                },
                false);
    }

  private:
    template <class LobeOf>
    static Matrix between(const LobeOf& lobeOf, bool timesMean) {
        const Samples& samples = Samples::instance();
        Eigen::MatrixXf values(kDirections, kDirections);
        for (uint32_t in = 0; in < kDirections; ++in) {
            const Lobe lobe = lobeOf(samples.directions[in]);
            for (uint32_t out = 0; out < kDirections; ++out)
                values(out, in) = lobe.towards(samples.directions[out]).x;
            values.col(in) *= (timesMean ? lobe.mean().x : 1) / values.col(in).mean();
        }
        return samples.fit * values * samples.fit.transpose();
    }
};

ScatteredLight::ScatteredLight(const Patches& patches, const FirstShot& shot, bool seesSky)
    : patches(patches) {
    if (patches.scattering.empty()) return;
    indices.assign(patches.sideCount(), kNone);
    for (uint32_t side = 0; side < indices.size(); ++side) {
        const Scattering& surface = SideReflectance(patches, side).scattering();
        if (!patches.parentAt(side).exchanges ||
            !(surface.hasGloss() || !surface.lobes.empty() || surface.isRough()))
            continue;
        const auto [x, y] = frame(patches.normal(side));
        indices[side] = uint32_t(sent.size());
        sent.push_back({x, y});
    }
    if (sent.empty()) {
        indices.clear();
        return;
    }
    findTransfers();
    if (seesSky) open.resize(sent.size());
    if (shot.incoming.empty()) return;
    parallelFor(uint32_t(0), uint32_t(indices.size()), [&](uint32_t side) {
        if (isNone(side) || shot.irradiance[side] == glm::vec3(0.0f)) return;
        Cells arriving{};
        for (size_t k = 0; k < Incoming::kCount; ++k)
            add(side, shot.incoming[side].direction(k),
                shot.incoming[side].weight / float(Incoming::kCount) * shot.irradiance[side],
                arriving);
        set(side, arriving);
    });
}

ScatteredLight ScatteredLight::renumbered(const std::vector<uint32_t>& sides) const {
    ScatteredLight other = *this;
    other.indices.clear();
    if (isNone()) return other;
    other.indices.reserve(sides.size());
    for (const uint32_t side : sides) other.indices.push_back(indices[side]);
    return other;
}

void ScatteredLight::findTransfers() {
    // Surfaces whose roughnesses are equal to within a hundredth share a transfer.
    auto rounded = [](float roughness) { return float(std::lround(100 * roughness)) / 100; };
    // For gloss, lobes and the diffuse part: whether they exist, their kind and their roughness.
    using Kind = std::tuple<bool, rb_masking, float, std::vector<std::pair<LobeKind, float>>,
                            rb_diffuse_model, float>;
    std::map<Kind, std::vector<size_t>> alike;
    transfers.resize(patches.scattering.size());
    for (size_t k = 0; k < transfers.size(); ++k) {
        const Scattering& surface = patches.scattering[k];
        const float gloss = std::clamp(surface.glossRoughness, Lobe::kLeastRoughness, 1.0f);
        std::vector<std::pair<LobeKind, float>> lobes;
        for (const LobeReflectance& lobe : surface.lobes)
            lobes.emplace_back(lobe.kind, rounded(lobe.roughness));
        alike[{surface.hasGloss(), surface.glossMasking, surface.hasGloss() ? rounded(gloss) : 0,
               lobes, surface.diffuseModel,
               surface.isRough() ? rounded(surface.diffuseRoughness) : 0}]
            .push_back(k);
    }
    tbb::parallel_for_each(alike.begin(), alike.end(), [&](const auto& kind) {
        const std::vector<size_t>& members = kind.second;
        const auto transfer = std::make_shared<Transfer>(patches.scattering[members.front()]);
        for (const size_t k : members) transfers[k] = transfer;
    });
}

void ScatteredLight::add(uint32_t side, const glm::vec3& direction, const glm::vec3& light,
                         Cells& cells) const {
    const Sent& target = sent[indices[side]];
    const Around& around = AroundTable::instance().at(target.x, target.y, direction);
    const std::array<uint32_t, 4> at = around.cells();
    const std::array<float, 4> shares = around.shares();
    for (size_t k = 0; k < 4; ++k)
        for (int c = 0; c < 3; ++c) cells[size_t(c)][at[k]] += shares[k] * light[c];
}

void ScatteredLight::add(uint32_t side, const glm::vec3& direction, float share,
                         Hemisphere& cells) const {
    const Sent& target = sent[indices[side]];
    const Around& around = AroundTable::instance().at(target.x, target.y, direction);
    for (size_t k = 0; k < 4; ++k) cells[around.cells()[k]] += around.shares()[k] * share;
}

void ScatteredLight::setOpen(uint32_t side, const Hemisphere& met, float sky) {
    const Hemisphere& even = Samples::instance().even;
    const float left = 1 - std::accumulate(met.begin(), met.end(), 0.0f);
    const float scale = left > 0 ? sky / left : 0;
    Open& target = open[indices[side]];
    // With few lines, more lines may meet surfaces in a cell than the cell can hold. The negative
    // value remains, because otherwise the other cells would be too open.
    for (uint32_t k = 0; k < kCells; ++k)
        target[k] = rounded(scale * (even[k] - met[k]) / even[k] * kOpenSteps);
}

std::pair<glm::vec4, float> ScatteredLight::addSky(uint32_t side, const glm::vec3& exitance,
                                                   Cells& cells) const {
    const Samples& samples = Samples::instance();
    glm::vec4 terms(0.0f);
    float sum = 0;
    for (uint32_t k = 0; k < kCells; ++k) {
        const float share = samples.even[k] * float(open[indices[side]][k]) / kOpenSteps;
        terms += share * samples.terms[k];
        sum += share;
        for (int c = 0; c < 3; ++c) cells[size_t(c)][k] += share * exitance[c];
    }
    return {terms, sum};
}

void ScatteredLight::set(uint32_t side, const Cells& arriving) {
    const SideReflectance surface(patches, side);
    const Transfer& transfer = *transfers[2 * patches.parentAt(side).scattering + isBack(side)];
    using Light = Eigen::Matrix<float, kCells, 3>;
    const Light light = Eigen::Map<const Light>(arriving.front().data());
    Light leaving = Light::Zero();
    if (surface.scattering().hasGloss()) {
        const glm::vec3 f0 = surface.f0(), rest = 1.0f - f0;
        const glm::vec3 scale =
            surface.mirroredMean() / (f0 * transfer.whiteMean + rest * transfer.edgeMean);
        leaving = (transfer.white * light) * diagonal(f0 * scale) +
                  (transfer.edge * light) * diagonal(rest * scale);
    }
    for (size_t k = 0; k < transfer.lobes.size(); ++k) {
        const glm::vec3 mean = surface.lobeMean(surface.scattering().lobes[k]);
        leaving += (transfer.lobes[k] * light) * diagonal(mean / transfer.lobeMeans[k]);
    }
    if (surface.scattering().isRough()) {
        Light diffuse = light;
        for (uint32_t in = 0; in < kCells; ++in) {
            const glm::vec3 share = surface.diffuseAt(Samples::instance().terms[in]);
            for (int c = 0; c < 3; ++c) diffuse(in, c) *= share[c];
        }
        leaving += transfer.rough * diffuse;
    }
    leaving.rowwise() -= leaving.colwise().mean().eval();
    leaving *= diagonal(glm::min((1.0f - patches.reflectance[side]) / kLeastAbsorbed, 1.0f));
    Sent& target = sent[indices[side]];
    target.unit = leaving.cwiseAbs().maxCoeff() / kMostSteps;
    if (!(target.unit > 0)) return;
    const Eigen::Array<float, kCells, 3> steps =
        (leaving.array() / target.unit).rint().min(kMostSteps).max(-kMostSteps);
    for (uint32_t out = 0; out < kCells; ++out)
        for (int c = 0; c < 3; ++c) target.cells[out][size_t(c)] = int8_t(steps(out, c));
}

ScatteredLight::Place ScatteredLight::placeOf(const glm::vec3& normal, const glm::vec3& direction) {
    const auto [x, y] = frame(normal);
    return AroundTable::instance().at(x, y, direction);
}

glm::vec3 ScatteredLight::towards(uint32_t side, const glm::vec3& direction) const {
    const Sent& source = sent[indices[side]];
    return towards(side, AroundTable::instance().at(source.x, source.y, direction));
}

glm::vec3 ScatteredLight::towards(uint32_t side, const Place& place) const {
    const Sent& source = sent[indices[side]];
    const Around around(place);
    // The sum is in integers, because this needs fewer conversions to float.
    glm::ivec3 sum(0);
    const std::array<uint32_t, 4> at = around.cells();
    const std::array<int, 4> shares = around.wholeShares();
    for (size_t k = 0; k < 4; ++k) {
        const auto& cell = source.cells[at[k]];
        sum += shares[k] * glm::ivec3(cell[0], cell[1], cell[2]);
    }
    return source.unit / (Place::kWhole * Place::kWhole) * glm::vec3(sum);
}

float ScatteredLight::contrast(uint32_t side) const {
    const Sent& source = sent[indices[side]];
    float sum = 0;
    for (const auto& cell : source.cells) {
        const float most = brightest(glm::abs(glm::vec3(cell[0], cell[1], cell[2])));
        sum += most * most;
    }
    return source.unit * std::sqrt(sum / kCells);
}

}  // namespace raybundle
