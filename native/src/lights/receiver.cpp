// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/receiver.h"

#include <algorithm>
#include <cmath>

namespace raybundle {
namespace {

// Receivers darker than this share of the mean may have the error of one that bright.
constexpr float kDarkShare = 0.25f;
// Where few receivers have noise, each may have up to so many times the error that it may have
// elsewhere, while all of them together keep to this share of the target.
constexpr float kMostLaxity = 1.5f;
constexpr double kLaxShare = 0.25;
// For this target receivers have enough by the most samples of sources; for a lower one they may
// have so many times as many: what Sobol's points leave of an error falls with nearly their number.
constexpr float kUsualTarget = 0.02f, kGrowthPower = 1.33f, kMostGrowth = 64;
// A shadow's edge lies between two neighbours where so much more of the light is visible to one, or
// where one has more of its contrast by so many times the error that it may have.
constexpr float kStep = 0.15f, kEdgeTimes = 2;

int mostGrowth(float targetError) {
    return int(std::clamp(std::pow(kUsualTarget / targetError, kGrowthPower), 1.0f, kMostGrowth));
}

// How many times these tolerances the errors may be, so that all of them together are no more than
// `most` at each receiver that has light: where few receivers have any, each may have more. Of
// those that count.
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

// See Aim::besideShadow: of receivers that have a neighbour with an edge of a shadow, or that lies
// behind one. Of a source that surrounds them all samples count as having missed a part in any
// case. tolerance: W/m^2.
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

Aims aimsAfter(const std::vector<Gathered>& results, const Patches& patches,
               const std::function<Receiver(size_t)>& receiverAt,
               const std::vector<ReceiverPair>& neighbours, float targetError) {
    // Of what is shown, if any light reaches that: a sunny yard says nothing of a room.
    double lit[2] = {0, 0}, litArea[2] = {0, 0};
    std::vector<float> light(results.size());
    for (size_t k = 0; k < results.size(); ++k) {
        const Receiver receiver = receiverAt(k);
        light[k] = brightest(results[k].irradiance) + receiver.otherLight;
        if (const double h = light[k]; h > 0) {
            const double weight = receiver.point ? 1 : double(patches.area[receiver.side / 2]);
            lit[receiver.isShown] += weight * h;
            litArea[receiver.isShown] += weight;
        }
    }
    const bool anyShown = litArea[true] > 0;
    // Not its square: a few receivers beside a lamp may have most of that.
    const double meanLight = litArea[anyShown] > 0 ? lit[anyShown] / litArea[anyShown] : 0;
    const float floor = kDarkShare * float(meanLight);
    std::vector<float> tolerance(results.size());
    std::vector<bool> counts(results.size());
    for (size_t k = 0; k < results.size(); ++k) {
        const Receiver receiver = receiverAt(k);
        counts[k] = receiver.isShown || !anyShown;
        tolerance[k] =
            receiver.errorFactor * kDirectShare * targetError * std::max(floor, light[k]);
    }
    const float factor = laxity(results, counts, tolerance, kLaxShare * targetError * meanLight);
    for (float& error : tolerance) error *= factor;
    const std::vector<float> besideShadow = besideShadows(results, neighbours, tolerance);
    Aims further;
    const int growth = mostGrowth(targetError);
    for (uint32_t k = 0; k < results.size(); ++k)
        if (besideShadow[k] > 0 || std::sqrt(results[k].variance) > tolerance[k]) {
            further.receivers.push_back(k);
            further.aims.push_back({tolerance[k], kFirstSamples, growth, besideShadow[k]});
        }
    return further;
}

}  // namespace raybundle
