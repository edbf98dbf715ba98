// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/irradiance_cache.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "job/cancellation.h"
#include "sampling/mix_bits.h"
#include "sampling/sphere_sampling.h"

namespace raybundle {
namespace {

// Reach of a record as a share of the harmonic mean distance of the surfaces around, and the
// largest distance between the unit normals of a record and of a place that it is used at.
constexpr float kReach = 0.35f, kAngle = 0.4f;
// Smallest reach, relative to the largest. It keeps the numbers of cells within the range of int.
constexpr float kLeastReach = 0x1p-14f;
// Distances along the normal count this many times: records on another layer of a surface are not
// used.
constexpr float kAlongNormal = 4;
// Weight of the assumption that light does not vary, relative to the weight of all records. It
// decides where there are too few records to tell, or where position and normal vary together. With
// a weight of 0.05, the slopes were half as steep as the light, and the errors of four props in
// three scenes 1.1 to 1.7 times as large.
constexpr double kEven = 0.003;
// More records than this around a place gain nothing, so that their reach is shortened.
constexpr double kMostAround = 24;
// A record reaches kShorter times as far as before if the mean squared difference around it exceeds
// noise by more than kMostSurplus times what is allowed, and by kCertain of its standard
// deviations.
constexpr float kShorter = 0.7f;
constexpr double kMostSurplus = 1, kCertain = 1;

double powerOf(const glm::vec3& v) { return double(glm::dot(v, v)) / 3; }

}  // namespace

size_t IrradianceCache::CellHash::operator()(const Cell& cell) const {
    uint64_t mixed = mixBits(uint64_t(cell.level));
    for (int k = 0; k < 3; ++k) mixed = mixBits(mixed ^ uint32_t(cell.at[k]));
    return size_t(mixed);
}

float IrradianceCache::reachOf(const CachePlace& place) const {
    return std::clamp(kReach / std::max(place.nearness, 1e-30f), kLeastReach * largestReach,
                      largestReach);
}

void IrradianceCache::add(const CachePlace& place, const CachedLight& light) {
    records.push_back({place, light, reachOf(place), kAngle});
}

float IrradianceCache::weightOf(const Found& record, const CachePlace& place, float ownReach) {
    const glm::vec3 off = place.position - record.position;
    const float reach = std::min(record.reach, ownReach);
    const float apart = glm::dot(off, off);
    if (apart >= reach * reach) return 0;
    const float along = kAlongNormal * glm::dot(off, record.normal + place.normal) / 2;
    const float distance = std::sqrt(apart + along * along);
    if (distance >= reach) return 0;
    const float turn = glm::distance(record.normal, place.normal);
    return (1 - distance / reach) * std::max(0.0f, 1 - turn / record.angle);
}

// Returns the cell of a grid of this width, counted from that of the first record.
glm::ivec3 IrradianceCache::cellAt(const glm::vec3& position, float width) const {
    return glm::ivec3(glm::floor((position - records.front().place.position) / width));
}

void IrradianceCache::buildIndex() {
    cells.clear();
    levelsIn.clear();
    // The width of the cells is between two and four times the reach.
    auto levelOf = [](const Record& record) {
        return std::clamp(int(std::ceil(std::log2(2 * record.reach))), -kLevels / 2,
                          kLevels / 2 - 1);
    };
    largestLevel = -kLevels / 2;
    for (const Record& record : records) largestLevel = std::max(largestLevel, levelOf(record));
    for (uint32_t k = 0; k < records.size(); ++k) {
        throwIfCancelledAt(k);
        const Record& record = records[k];
        const glm::vec3& position = record.place.position;
        const int level = levelOf(record), outer = std::min(largestLevel - level, 31);
        const float width = std::ldexp(1.0f, level);
        const glm::ivec3 low = cellAt(position - record.reach, width),
                         high = cellAt(position + record.reach, width);
        for (int x = low.x; x <= high.x; ++x)
            for (int y = low.y; y <= high.y; ++y)
                for (int z = low.z; z <= high.z; ++z) {
                    cells[{level, {x, y, z}}].push_back(
                        {position, record.place.normal, record.reach, record.angle, k});
                    levelsIn[{largestLevel, {x >> outer, y >> outer, z >> outer}}] |=
                        uint64_t(1) << (level + kLevels / 2);
                }
    }
}

template <class Visit>
void IrradianceCache::forEachAround(const CachePlace& place, size_t before,
                                    const Visit& visit) const {
    if (records.empty()) return;
    const auto levels =
        levelsIn.find({largestLevel, cellAt(place.position, std::ldexp(1.0f, largestLevel))});
    if (levels == levelsIn.end()) return;
    const float ownReach = reachOf(place);
    for (int k = 0; k < kLevels; ++k) {
        if (!(levels->second >> k & 1)) continue;
        const int level = k - kLevels / 2;
        const auto found = cells.find({level, cellAt(place.position, std::ldexp(1.0f, level))});
        if (found == cells.end()) continue;
        const std::vector<Found>& of = found->second;  // in the order of the records
        for (auto one = of.rbegin(); one != of.rend() && one->record >= before; ++one) {
            const float weight = weightOf(*one, place, ownReach);
            if (weight > 0 && !visit(*one, weight)) return;
        }
    }
}

bool IrradianceCache::isReachedSince(size_t before, const CachePlace& place) const {
    bool isReached = false;
    forEachAround(place, before, [&](const Found&, float) {
        isReached = true;
        return false;
    });
    return isReached;
}

// The light near a place is a linear function of position and normal in the plane of the place,
// fitted to the records around it. The light is therefore a sum of the light of the records, with
// factors that add up to 1.
CachedLight IrradianceCache::interpolate(const CachePlace& place, uint32_t without,
                                         const glm::vec3& off) const {
    constexpr int kTerms = 5;
    using Terms = std::array<double, kTerms>;
    struct Around {
        const Found* found;
        double weight;
        Terms terms;
    };
    std::vector<Around> around;
    around.reserve(size_t(2 * kMostAround));
    double sum = 0;
    float reach = 0, angle = 0;
    forEachAround(place, 0, [&](const Found& found, float weight) {
        if (found.record == without) return true;
        around.push_back({&found, double(weight), Terms{}});
        sum += double(weight);
        reach += weight * found.reach;
        angle += weight * found.angle;
        return true;
    });
    CachedLight light;
    light.variance = INFINITY;
    if (!(sum > 0)) return light;
    // The terms are relative to what the records reach, so that kEven weighs all of them alike.
    reach /= float(sum);
    angle /= float(sum);
    const auto [x, y] = frame(place.normal);
    auto termsAt = [&, x = x, y = y](const glm::vec3& from, const glm::vec3& normal) {
        return Terms{1, double(glm::dot(from, x) / reach), double(glm::dot(from, y) / reach),
                     double(glm::dot(normal, x) / angle), double(glm::dot(normal, y) / angle)};
    };
    // Only the lower half of the symmetric matrix is set.
    Eigen::Matrix<double, kTerms, kTerms> matrix = Eigen::Matrix<double, kTerms, kTerms>::Zero();
    for (auto& [found, weight, terms] : around) {
        terms = termsAt(found->position - place.position, found->normal);
        for (int i = 0; i < kTerms; ++i)
            for (int j = 0; j <= i; ++j) matrix(i, j) += weight * terms[i] * terms[j];
    }
    for (int k = 1; k < kTerms; ++k) matrix(k, k) += kEven * sum;
    const Terms wanted = termsAt(off, place.normal);
    const Eigen::Matrix<double, kTerms, 1> solution =
        matrix.llt().solve(Eigen::Map<const Eigen::Matrix<double, kTerms, 1>>(wanted.data()));
    light.variance = 0;
    for (const auto& [found, weight, terms] : around) {
        const double factor =
            weight * std::inner_product(terms.begin(), terms.end(), solution.data(), 0.0);
        const CachedLight& own = records[found->record].light;
        light.carried += float(factor) * own.carried;
        light.reflected += float(factor) * own.reflected;
        light.surrounding += float(factor) * own.surrounding;
        light.open += float(factor) * own.open;
        light.variance += factor * factor * own.variance;
        light.allowed += weight / sum * own.allowed;
    }
    for (glm::vec3* part : {&light.carried, &light.reflected, &light.surrounding})
        *part = glm::max(*part, 0.0f);
    return light;
}

void IrradianceCache::update(bool compares) {
    buildIndex();
    if (!compares) return;
    // Per record: the squared difference from what others predict beyond the noise, and the noise,
    // (W/m^2)^2. The noise is negative if no other record reaches it.
    struct Test {
        double surplus = 0, noise = -1;
    };
    std::vector<Test> tests(records.size());
    parallelFor(size_t(0), records.size(), [&](size_t k) {
        const Record& own = records[k];
        const CachedLight others = interpolate(own.place, uint32_t(k));
        if (std::isinf(others.variance)) return;
        tests[k].noise = own.light.variance + others.variance;
        tests[k].surplus = powerOf(own.light.total() - others.total()) - tests[k].noise;
    });
    std::vector<float> factor(records.size(), 1.0f);
    std::vector<uint8_t> isShortened(records.size());
    parallelFor(size_t(0), records.size(), [&](size_t k) {
        double surplus = 0, noise = 0, sum = 0, squares = 0, count = 0;
        forEachAround(records[k].place, 0, [&](const Found& other, float weight) {
            ++count;
            const Test& test = tests[other.record];
            if (test.noise < 0) return true;
            surplus += double(weight) * test.surplus;
            noise += double(weight) * test.noise;
            sum += double(weight);
            squares += double(weight * weight);
            return true;
        });
        // The number of records around a place grows with the square of their reach.
        factor[k] = float(std::sqrt(std::min(1.0, kMostAround / std::max(1.0, count))));
        if (!(sum > 0)) return;
        // The square of a normally distributed difference deviates by sqrt(2) times its mean.
        const double deviation = std::sqrt(2 * squares) / sum * noise / sum;
        isShortened[k] =
            surplus / sum > kMostSurplus * records[k].light.allowed + kCertain * deviation;
    });
    bool isAnyShorter = false;
    for (size_t k = 0; k < records.size(); ++k) {
        const float shorter = isShortened[k] ? std::min(factor[k], kShorter) : factor[k];
        isAnyShorter |= shorter < 1;
        records[k].reach = std::max(shorter * records[k].reach, kLeastReach * largestReach);
        if (isShortened[k]) records[k].angle *= kShorter;
    }
    if (isAnyShorter) buildIndex();
}

}  // namespace raybundle
