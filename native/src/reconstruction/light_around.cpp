// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/light_around.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "job/cancellation.h"
#include "sampling/sobol.h"
#include "scene/channels.h"

namespace raybundle {
namespace {

// The first round looks at one of this many receivers, but at least at kFewestFirst.
constexpr size_t kFirstShare = 64, kFewestFirst = 16;
// One of kTestedShare receivers near other surfaces is tested (see surplus()), and one of as many
// others, but at least kFewestTested and at most kMostTested of each. Receivers are near others if
// the mean inverse distance of the surfaces around is above kNear over the edge of a tile.
constexpr size_t kTestedShare = 32, kFewestTested = 16, kMostTested = 64;
constexpr float kNear = 0.5f;
// Share of the estimated variance that is taken off the squared difference between shown and tested
// light. The estimates may be too large: if all of it was taken off, the error of the props of
// blend_tests/dense_surfaces.py exceeded the stated one in 8 of 40 cases, instead of 2 of 160.
constexpr double kSureNoise = 0.5;
// Seed of the rays of tests.
constexpr uint32_t kTestRays = 8;
// The surplus is above the mean of the tests by this many standard deviations of the mean.
constexpr double kSureSurplus = 2;
// The largest number of probes of a cluster.
constexpr size_t kProbesOfCluster = 16;
// No record reaches further than this many edges of tiles.
constexpr float kReachOfTile = 4;
// An object whose light is below this share of that of the scene is judged as if it had that much.
constexpr float kLeastLight = 0.01f;

}  // namespace

struct LightAround::Effort {
    // Standard error that the light may have, relative to what that of a node may have.
    float laxity;
    // Whether the light is compared with what is shown. It is then gathered by other rays than
    // those of records, and more accurately beside other surfaces.
    bool isTest;
};

// The light of a node is the mean of several records.
constexpr LightAround::Effort LightAround::kRecord{2, false}, LightAround::kSingle{1, false},
    LightAround::kTest{1, true};

LightAround::LightAround(const ReconstructionInput& input, const SetLight& light,
                         const FinalGather& gather, const DenseNodes& nodes, size_t instance,
                         const std::vector<glm::vec3>& lampLight)
    : input(input),
      light(light),
      finalGather(gather),
      nodes(nodes),
      own(nodes[instance]),
      lampLight(lampLight),
      count(own.last - own.first),
      isSurrounded(light.direct.isSurrounding()),
      least(darkestLight()),
      probes(count),
      isRecord(count),
      cache(kReachOfTile * input.patches.islandAt(receiver(0).side).size) {}

// Returns the light that errors are relative to at dark places, W/m^2: the RMS of the object,
// unless it is nearly black or brighter than the scene.
float LightAround::darkestLight() const {
    double squares = 0;
    for (uint32_t r = 0; r < count; ++r) squares += std::pow(double(lightAt(r)), 2);
    const float mean = finalGather.meanLight();
    return std::clamp(float(std::sqrt(squares / count)), kLeastLight * mean, mean);
}

// Returns about the light that a receiver gets, without that of surrounding sources, W/m^2.
float LightAround::lightAt(uint32_t r) const {
    const uint32_t side = receiver(r).side;
    return brightest(lampLight[own.first + r] + light.irradiance.all(side) -
                     light.irradiance.ofSources[side]);
}

CachePlace LightAround::placeOf(uint32_t r) const {
    return {nodes.position(own.first + r), receiver(r).normal, probes[r].nearness};
}

void LightAround::probe() {
    Receivers sorted(count);
    std::iota(sorted.begin(), sorted.end(), 0u);
    auto clusterOf = [&](uint32_t r) { return input.clusters.sideOf(receiver(r).side); };
    tbb::parallel_sort(sorted.begin(), sorted.end(), [&](uint32_t a, uint32_t b) {
        return std::make_pair(clusterOf(a), a) < std::make_pair(clusterOf(b), b);
    });
    std::vector<uint32_t> first;  // in `sorted`, of each cluster; one more entry at the end
    for (uint32_t n = 0; n < count; ++n)
        if (n == 0 || clusterOf(sorted[n]) != clusterOf(sorted[n - 1])) first.push_back(n);
    first.push_back(count);
    parallelFor(size_t(1), first.size(), [&](size_t c) {
        probe(&sorted[first[c - 1]], sorted.data() + first[c], kProbesOfCluster);
    });
}

// Halves the receivers where they spread most, until there are as many parts as probes.
void LightAround::probe(uint32_t* first, uint32_t* last, size_t most) {
    if (most > 1 && last - first > 1) {
        glm::vec3 low(INFINITY), high(-INFINITY);
        for (const uint32_t* r = first; r < last; ++r) {
            low = glm::min(low, nodes.position(own.first + *r));
            high = glm::max(high, nodes.position(own.first + *r));
        }
        const glm::vec3 spread = high - low;
        const int axis = spread.x >= std::max(spread.y, spread.z) ? 0
                         : spread.y >= spread.z                   ? 1
                                                                  : 2;
        uint32_t* const middle = first + (last - first) / 2;
        std::nth_element(first, middle, last, [&](uint32_t a, uint32_t b) {
            return nodes.position(own.first + a)[axis] < nodes.position(own.first + b)[axis];
        });
        probe(first, middle, most / 2);
        probe(middle, last, most - most / 2);
        return;
    }
    std::vector<const Receiver*> these;
    for (const uint32_t* r = first; r < last; ++r) these.push_back(&receiver(*r));
    const FinalGather::Probe found = finalGather.probe(these.data(), these.size());
    for (const uint32_t* r = first; r < last; ++r) probes[*r] = found;
}

std::vector<CachedLight> LightAround::atReceivers() {
    probe();
    Receivers order(count);
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
        return std::make_pair(hash(receiver(a).seed, 7), a) <
               std::make_pair(hash(receiver(b).seed, 7), b);
    });
    std::vector<size_t> placeInOrder(count);
    for (size_t n = 0; n < count; ++n) placeInOrder[order[n]] = n;
    for (size_t begin = 0, end = std::max(kFewestFirst, count / kFirstShare); begin < count;
         begin = end, end *= 2) {
        std::vector<uint8_t> wants(count);
        parallelFor(uint32_t(0), count, [&](uint32_t r) {
            wants[r] = placeInOrder[r] >= begin && placeInOrder[r] < end && wantsRecord(r, at(r));
        });
        if (addRecords(order, wants, kRecord)) cache.update(true);
    }
    std::vector<CachedLight> result(count);
    parallelFor(uint32_t(0), count, [&](uint32_t r) { result[r] = at(r); });
    auto addMore = [&](const Effort& effort, const auto& isWanting) {
        std::vector<uint8_t> wants(count);
        for (uint32_t r = 0; r < count; ++r) wants[r] = isWanting(r);
        const size_t before = cache.count();
        if (!addRecords(order, wants, effort)) return;
        cache.update(false);
        parallelFor(uint32_t(0), count, [&](uint32_t r) {
            if (cache.isReachedSince(before, placeOf(r))) result[r] = at(r);
        });
    };
    // What the shortened reaches of the last rounds have left without good light.
    addMore(kRecord, [&](uint32_t r) { return wantsRecord(r, result[r]); });
    // Records without others around them have too much noise.
    addMore(kSingle, [&](uint32_t r) { return !result[r].isGood(); });
    measureSurplus(order, result);
    return result;
}

// The light of few receivers near other surfaces may be far off, so that they are tested apart from
// the others. `order` is random, so that the first of each kind are a random sample.
void LightAround::measureSurplus(const Receivers& order, const std::vector<CachedLight>& shown) {
    const float near = kNear / input.patches.islandAt(receiver(0).side).size;
    double sum = 0, variance = 0;
    for (bool isNear : {false, true}) {
        Receivers these;
        for (const uint32_t r : order)
            if ((probes[r].nearness > near) == isNear) these.push_back(r);
        const double share = double(these.size()) / double(order.size());
        these.resize(std::min(these.size(),
                              std::clamp(these.size() / kTestedShare, kFewestTested, kMostTested)));
        if (these.empty()) continue;
        const std::vector<CachedLight> found = gatherAt(these, kTest);
        double mean = 0, squares = 0;
        for (size_t n = 0; n < these.size(); ++n) {
            const CachedLight& own = shown[these[n]];
            const glm::vec3 difference = own.total() - found[n].total();
            const double surplus = double(glm::dot(difference, difference)) / 3 -
                                   kSureNoise * (own.variance + found[n].variance);
            mean += surplus / double(these.size());
            squares += surplus * surplus / double(these.size());
        }
        sum += share * mean;
        variance += share * share * std::max(0.0, squares - mean * mean) / double(these.size());
    }
    squaredSurplus = std::max(0.0, sum + kSureSurplus * std::sqrt(variance));
}

bool LightAround::wantsRecord(uint32_t r, const CachedLight& found) const {
    return !isRecord[r] &&
           (!found.isGood() ||
            probes[r].contradicts(found.carried + found.reflected, found.open, found.allowed));
}

bool LightAround::addRecords(const Receivers& order, const std::vector<uint8_t>& wants,
                             const Effort& effort) {
    Receivers these;
    for (const uint32_t r : order)
        if (wants[r]) these.push_back(r);
    const std::vector<CachedLight> found = gatherAt(these, effort);
    for (size_t n = 0; n < these.size(); ++n) {
        cache.add(placeOf(these[n]), found[n]);
        isRecord[these[n]] = true;
    }
    return !these.empty();
}

Receiver LightAround::receiverFor(uint32_t r, const Effort& effort) const {
    Receiver result = receiver(r);
    if (effort.isTest) result.seed = hash(result.seed, kTestRays);
    return result;
}

std::vector<CachedLight> LightAround::gatherAt(const Receivers& these, const Effort& effort) {
    std::vector<CachedLight> found(these.size());
    if (these.empty()) return found;
    std::vector<Gathered> surrounding(these.size());
    if (isSurrounded) surrounding = gatherSurrounding(these, effort);
    parallelFor(size_t(0), these.size(),
                [&](size_t n) { found[n] = gatherAt(these[n], surrounding[n], effort); });
    return found;
}

std::vector<Gathered> LightAround::gatherSurrounding(const Receivers& these, const Effort& effort) {
    std::vector<Gathered> gathered = light.direct.gather(
        these.size(),
        [&](size_t n) {
            Receiver result = receiverFor(these[n], effort);
            result.of = Receiver::Of::SURROUNDING;
            result.otherLight = lightAt(these[n]);
            result.errorFactor *= effort.laxity;
            return result;
        },
        input.settings.targetError, [](double) { throwIfCancelled(); });
    for (const Gathered& one : gathered) rays += one.rays;
    return gathered;
}

CachedLight LightAround::gatherAt(uint32_t r, const Gathered& surrounding,
                                  const Effort& effort) const {
    const Receiver at = receiverFor(r, effort);
    const float brightness = std::max(least, lightAt(r) + brightest(surrounding.irradiance));
    const FinalGather::Light rest =
        finalGather.gather({{&at, 1.0f}}, brightness, effort.laxity, effort.isTest);
    CachedLight result;
    result.carried = rest.carried;
    result.reflected = rest.reflected;
    result.surrounding =
        input.shown.byAngle(at.side, surrounding.meanAngles()) * surrounding.irradiance;
    result.open = rest.open;
    // That of the brightest channel. Noise has the colour of the light.
    const double brightestPart = double(brightest(surrounding.irradiance));
    const double inChannels =
        brightestPart > 0 ? double(glm::dot(surrounding.irradiance, surrounding.irradiance)) / 3 /
                                (brightestPart * brightestPart)
                          : 1;
    result.variance = rest.variance + inChannels * double(surrounding.variance);
    result.allowed =
        std::pow(double(finalGather.allowedError(at, brightness)), 2) * (isSurrounded ? 2 : 1);
    return result;
}

}  // namespace raybundle
