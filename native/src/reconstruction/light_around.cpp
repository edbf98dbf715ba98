// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/light_around.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "job/cancellation.h"
#include "sampling/sobol.h"
#include "scene/channels.h"

namespace raybundle {
namespace {

// Standard error that a record may have, relative to what a node may have. The light of a node is
// the mean of several records.
constexpr float kRecordError = 2;
// The first round looks at one of this many receivers, but at least at kFewestFirst.
constexpr size_t kFirstShare = 64, kFewestFirst = 16;
// One of kTestedShare receivers is tested (see surplus()), but at least kFewestTested and at most
// kMostTested.
constexpr size_t kTestedShare = 32, kFewestTested = 16, kMostTested = 64;
// The surplus is above the mean of the tests by this many standard deviations of the mean.
constexpr double kSureSurplus = 2;
// No record reaches further than this many edges of tiles.
constexpr float kReachOfTile = 4;
// An object whose light is below this share of that of the scene is judged as if it had that much.
constexpr float kLeastLight = 0.01f;

}  // namespace

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

std::vector<CachedLight> LightAround::atReceivers() {
    parallelFor(uint32_t(0), count,
                [&](uint32_t r) { probes[r] = finalGather.probe(receiver(r)); });
    Receivers order(count);
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
        return std::make_pair(hash(receiver(a).seed, 7), a) <
               std::make_pair(hash(receiver(b).seed, 7), b);
    });
    for (size_t begin = 0, end = std::max(kFewestFirst, count / kFirstShare); begin < count;
         begin = end, end *= 2) {
        const Receivers these = wanting(order, begin, std::min(end, size_t(count)));
        if (these.empty()) continue;
        addRecords(these, kRecordError);
        cache.update(true);
    }
    // What the shortened reaches of the last rounds have left without good light.
    addRecords(wanting(order, 0, count), kRecordError);
    cache.update(false);
    std::vector<CachedLight> result(count);
    auto interpolate = [&] {
        parallelFor(uint32_t(0), count, [&](uint32_t r) { result[r] = cache.at(placeOf(r)); });
    };
    interpolate();
    // Records without others around them have too much noise.
    Receivers noisy;
    for (const uint32_t r : order)
        if (!result[r].isGood()) noisy.push_back(r);
    if (!noisy.empty()) {
        addRecords(noisy, 1);
        cache.update(false);
        interpolate();
    }
    measureSurplus(order, result);
    return result;
}

// The places were looked at in random order, so that the last ones are a random sample.
void LightAround::measureSurplus(const Receivers& order, const std::vector<CachedLight>& shown) {
    const size_t wanted = std::clamp(count / kTestedShare, kFewestTested, kMostTested);
    const Receivers tested(order.end() - std::ptrdiff_t(std::min(wanted, order.size())),
                           order.end());
    const std::vector<CachedLight> found = gatherAt(tested, 1);
    double sum = 0, squares = 0;
    for (size_t n = 0; n < tested.size(); ++n) {
        if (isRecord[tested[n]]) continue;  // what is shown has mostly been gathered here
        const CachedLight& own = shown[tested[n]];
        const glm::vec3 difference = own.total() - found[n].total();
        const double surplus =
            double(glm::dot(difference, difference)) / 3 - own.variance - found[n].variance;
        sum += surplus;
        squares += surplus * surplus;
    }
    const double number = double(tested.size()), mean = sum / number;
    const double deviation = std::sqrt(std::max(0.0, squares / number - mean * mean) / number);
    squaredSurplus = std::max(0.0, mean + kSureSurplus * deviation);
}

LightAround::Receivers LightAround::wanting(const Receivers& order, size_t begin,
                                            size_t end) const {
    std::vector<uint8_t> wants(end - begin);
    parallelFor(begin, end, [&](size_t n) {
        const uint32_t r = order[n];
        if (isRecord[r]) return;
        const CachedLight found = cache.at(placeOf(r));
        wants[n - begin] = !found.isGood() || probes[r].contradicts(found.carried + found.reflected,
                                                                    found.open, found.allowed);
    });
    Receivers these;
    for (size_t n = begin; n < end; ++n)
        if (wants[n - begin]) these.push_back(order[n]);
    return these;
}

void LightAround::addRecords(const Receivers& these, float laxity) {
    const std::vector<CachedLight> found = gatherAt(these, laxity);
    for (size_t n = 0; n < these.size(); ++n) {
        cache.add(placeOf(these[n]), found[n]);
        isRecord[these[n]] = true;
    }
}

std::vector<CachedLight> LightAround::gatherAt(const Receivers& these, float laxity) {
    std::vector<CachedLight> found(these.size());
    if (these.empty()) return found;
    std::vector<Gathered> surrounding(these.size());
    if (isSurrounded) surrounding = gatherSurrounding(these, laxity);
    parallelFor(size_t(0), these.size(),
                [&](size_t n) { found[n] = gatherAt(these[n], surrounding[n], laxity); });
    return found;
}

std::vector<Gathered> LightAround::gatherSurrounding(const Receivers& these, float laxity) {
    std::vector<Gathered> gathered = light.direct.gather(
        these.size(),
        [&](size_t n) {
            Receiver result = receiver(these[n]);
            result.of = Receiver::Of::SURROUNDING;
            result.otherLight = lightAt(these[n]);
            result.errorFactor *= laxity;
            return result;
        },
        input.settings.targetError, [](double) { throwIfCancelled(); });
    for (const Gathered& one : gathered) rays += one.rays;
    return gathered;
}

CachedLight LightAround::gatherAt(uint32_t r, const Gathered& surrounding, float laxity) const {
    const Receiver& at = receiver(r);
    const float brightness = std::max(least, lightAt(r) + brightest(surrounding.irradiance));
    const FinalGather::Light rest = finalGather.gather({{&at, 1.0f}}, brightness, laxity);
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
