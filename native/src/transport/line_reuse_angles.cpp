// SPDX-License-Identifier: GPL-3.0-or-later
//
// LINE_REUSE on surfaces that are not Lambert's: what the lines bring by the direction of the light
// (transport/directed_light.h), and by the angles at which it leaves and arrives.
//
// Light of the sources is known before the solve, and what it brings by direction with it.
// Reflected light is known after it: then the system is solved once more, with what the solution
// brings by the angle at which it leaves (from under a layer) and makes sides reflect by the angle
// at which it arrives. A third solve would change a share of a share.
//
// A few lines are enough for what is little of the light, or changes slowly from side to side: the
// first ones of each side stand for all.
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>

#include "scene/channels.h"
#include "transport/line_reuse.h"
#include "transport/sobol.h"

namespace raybundle {
namespace {

// Entries of a row, if it has as many, that are looked at in any case.
constexpr size_t kLeastEntries = 64;
constexpr float kMostReflectance = 0.999f;
constexpr size_t kGrain = 256;  // sides per task

template <class Body>
void forEachSide(size_t n, const Body& body) {
    tbb::parallel_for(tbb::blocked_range<size_t>(0, n, kGrain), [&](const auto& range) {
        for (size_t i = range.begin(); i < range.end(); ++i) body(i);
    });
}

}  // namespace

template <class Value, class Sent>
std::vector<Value> LineReuse::alongLines(Half half, const LineWeights& weights, double share,
                                         const Value& zero, const Sent& sent) const {
    const LineRows::LinesOf<float>& lines = LineRows::linesOf<float>();
    const std::vector<float>&x = weights.x, &m = weights.m;
    std::vector<Value> brought(counts.sideCount(), zero);
    forEachSide(brought.size(), [&](size_t i) {
        if (m[i] == 0) return;
        Value all = zero;
        for (size_t h = 0; h < 2; ++h) {
            if (half != Half::BOTH && half != Half(h)) continue;
            const uint32_t* const begin = counts.rows(h).first(uint32_t(i));
            const size_t count = size_t(counts.rows(h).last(uint32_t(i)) - begin);
            const size_t enough =
                std::min(count, std::max(kLeastEntries, size_t(share * double(count))));
            Value sum = zero;
            float taken = 0;
            for (const uint32_t* e = begin; e < begin + enough; ++e) {
                const uint32_t from = LineRows::sideOf(*e);
                taken += lines[*e & 255];
                sum += lines[*e & 255] * x[from] * sent(from, uint32_t(i), uint32_t(e - begin));
            }
            if (taken > 0) all += float(counts.total[i][h] - counts.sky[i][h]) / taken * sum;
        }
        brought[i] = x[i] * all / m[i];
    });
    return brought;
}

std::vector<glm::vec3> LineReuse::directed(Half half, const LineWeights& weights) const {
    if (directedLight.isNone()) return {};
    const std::vector<float> exposed = exposedShare();
    return alongLines(half, weights, directedLight.shareOfLines(), glm::vec3(0.0f),
                      [&](uint32_t from, uint32_t to, uint32_t entry) {
                          if (directedLight.isNone(from) || exposed[from] <= 0)
                              return glm::vec3(0.0f);
                          return directedLight.between(from, to, hash(to, entry)) / exposed[from];
                      });
}

void LineReuse::findAngles(Half half, const LineWeights& weights,
                           const std::vector<glm::vec3>& reflected, const Irradiance& light,
                           ByAngle& byAngle) const {
    // Of light from under a layer, of the angles at which reflected light arrives (angleTerms),
    // each times its brightness, and that.
    using Arriving = Eigen::Array<float, 8, 1>;
    const std::vector<Arriving> arriving = alongLines(
        half, weights, 0, Arriving(Arriving::Zero()),
        [&](uint32_t from, uint32_t to, uint32_t /*entry*/) {
            const glm::vec3 way = directedLight.wayBetween(from, to);
            const glm::vec3 layered = directedLight.hasLayers()
                                          ? directedLight.layer(from, way) * reflected[from]
                                          : glm::vec3(0.0f);
            const float brightness = brightest(reflected[from]);
            const glm::vec4 terms = brightness * angleTerms(-glm::dot(way, patches.normal(to)));
            Arriving value;
            value << layered.x, layered.y, layered.z, terms.x, terms.y, terms.z, terms.w,
                brightness;
            return value;
        });
    const size_t n = arriving.size();
    byAngle.brought.resize(n, glm::vec3(0.0f));
    if (!patches.byAngle.empty()) byAngle.reflected.resize(n);
    forEachSide(n, [&](size_t i) {
        const Arriving& value = arriving[i];
        byAngle.brought[i] += glm::vec3(value[0], value[1], value[2]);
        if (byAngle.reflected.empty() || !(value[7] > 0)) return;
        const glm::vec4 terms = glm::vec4(value[3], value[4], value[5], value[6]) / value[7];
        const glm::vec3 more = sumOfTerms(patches.byAngle[i], terms - kEverywhere);
        byAngle.reflected[i] =
            glm::clamp(more, -patches.reflectance[i], kMostReflectance - patches.reflectance[i]) *
            light.indirect[i];
    });
}

}  // namespace raybundle
