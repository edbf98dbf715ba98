// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/receiver.h"

#include <algorithm>
#include <cmath>

#include "job/cancellation.h"
#include "patches/side.h"

namespace raybundle {
namespace {

// Receivers whose light is below this share of the mean light may have the absolute error of a
// receiver at this share.
constexpr float kDarkShare = 0.25f;
// Where few receivers have noise, the error of each may be up to kMostLaxity times its usual
// tolerance, as long as the error of all receivers together stays below kLaxShare times the target.
constexpr float kMostLaxity = 1.5f;
constexpr double kLaxShare = 0.25;
// At the target kUsualTarget, the usual maximum number of samples of a source suffices. At a lower
// target the maximum grows, by a power a little above 1, since the error of Sobol points falls
// nearly in proportion to their number. Where a face has two or three patches, its corners show up
// to four times their error. At a target of 2 %, twice the usual maximum is therefore allowed: the
// direct light at the corners of the monitors of office, beside the edges of shadows, had 5 to 11 %
// of noise at the 95th percentile with the usual maximum, and has 4 to 9 % with this one.
constexpr float kUsualTarget = 0.034f, kGrowthPower = 1.33f, kMostGrowth = 64;
// The edge of a shadow lies between two neighbours if their visible shares of the light differ by
// more than kStep, or if the contrast of one exceeds that of the other by more than kEdgeTimes its
// tolerance.
constexpr float kStep = 0.15f, kEdgeTimes = 2;

int mostGrowth(float targetError) {
    return int(std::clamp(std::pow(kUsualTarget / targetError, kGrowthPower), 1.0f, kMostGrowth));
}

// Returns the factor by which all tolerances may grow, at least 1, such that the sum of the squared
// errors stays below most^2 times the number of receivers that have light. If few receivers have
// errors, each may have a larger one. Only receivers with `counts` are considered. `tolerance` (per
// receiver) and `most` are in W/m^2.
float laxity(const std::vector<Gathered>& results, const std::vector<bool>& counts,
             const std::vector<float>& tolerance, double most) {
    double allowed = 0;
    for (size_t k = 0; k < results.size(); ++k)
        if (counts[k] && brightest(results[k].irradiance) > 0) allowed += most * most;
    for (float factor = kMostLaxity; factor > 1; factor *= 0.8f) {
        double left = 0;
        for (size_t k = 0; k < results.size(); ++k)
            if (counts[k])
                left += double(
                    std::min(results[k].variance, factor * factor * tolerance[k] * tolerance[k]));
        if (left <= allowed) return factor;
    }
    return 1;
}

// Returns Aim::besideShadow per receiver. The value is positive for receivers with a neighbour that
// sees the edge of a shadow or lies beyond the edge. The contrast of a source that surrounds the
// receivers is left out, since its samples are always taken to have missed a part. `tolerance` is
// per receiver, W/m^2.
std::vector<float> besideShadows(const std::vector<Gathered>& results,
                                 const std::vector<ReceiverPair>& neighbours,
                                 const std::vector<float>& tolerance) {
    std::vector<float> beside(results.size(), 0.0f);
    for (const auto& [a, b] : neighbours) {
        const bool isStep = std::abs(results[a].visibleShare() - results[b].visibleShare()) > kStep;
        auto note = [&](uint32_t k, float edge) {
            if (!isStep && !(edge > kEdgeTimes * tolerance[k])) return;
            if (isStep) edge = INFINITY;
            beside[k] = beside[k] > 0 ? std::min(beside[k], edge) : edge;
        };
        const float edge = results[b].shadowContrast - results[a].shadowContrast;
        note(a, edge);
        note(b, -edge);
    }
    return beside;
}

}  // namespace

std::vector<bool> haveNeighbours(size_t count, const std::vector<ReceiverPair>& neighbours) {
    std::vector<bool> result(count, false);
    for (const auto& [a, b] : neighbours) result[a] = result[b] = true;
    return result;
}

Aims aimsAfter(const std::vector<Gathered>& results, const Patches& patches,
               const std::function<Receiver(size_t)>& receiverAt,
               const std::vector<ReceiverPair>& neighbours, float targetError) {
    // The mean light is that of the shown receivers, if they get any light. A sunny yard must not
    // set the error of a room.
    struct Wanted {
        float light, weight, target, errorFactor;
        bool isShown;
    };
    std::vector<Wanted> wanted(results.size());
    parallelFor(size_t(0), results.size(), [&](size_t k) {
        const Receiver receiver = receiverAt(k);
        wanted[k] = {brightest(results[k].irradiance) + receiver.otherLight,
                     receiver.point ? 1 : patches.area[patchOf(receiver.side)],
                     receiver.targetFactor * targetError, receiver.errorFactor, receiver.isShown};
    });
    double lit[2] = {0, 0}, litArea[2] = {0, 0};
    for (const Wanted& receiver : wanted)
        if (receiver.light > 0) {
            lit[receiver.isShown] += double(receiver.weight) * double(receiver.light);
            litArea[receiver.isShown] += double(receiver.weight);
        }
    const bool anyShown = litArea[true] > 0;
    // The mean of the light is used, not the mean of its square, most of which may come from a few
    // receivers beside a lamp.
    const double meanLight = litArea[anyShown] > 0 ? lit[anyShown] / litArea[anyShown] : 0;
    const float floor = kDarkShare * float(meanLight);
    std::vector<float> tolerance(results.size());
    std::vector<bool> counts(results.size());
    for (size_t k = 0; k < results.size(); ++k) {
        const Wanted& receiver = wanted[k];
        counts[k] = receiver.isShown || !anyShown;
        tolerance[k] =
            receiver.errorFactor * kDirectShare * receiver.target * std::max(floor, receiver.light);
    }
    const float factor = laxity(results, counts, tolerance, kLaxShare * targetError * meanLight);
    for (float& error : tolerance) error *= factor;
    const std::vector<float> besideShadow = besideShadows(results, neighbours, tolerance);
    const std::vector<bool> hasNeighbour = haveNeighbours(results.size(), neighbours);
    Aims further;
    for (uint32_t k = 0; k < results.size(); ++k)
        if (besideShadow[k] > 0 || std::sqrt(results[k].variance) > tolerance[k]) {
            further.receivers.push_back(k);
            further.aims.push_back({tolerance[k], kFirstSamples, mostGrowth(wanted[k].target),
                                    besideShadow[k], nullptr, !hasNeighbour[k]});
        }
    return further;
}

}  // namespace raybundle
