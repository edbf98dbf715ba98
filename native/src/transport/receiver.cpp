// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/receiver.h"

#include <algorithm>

namespace raybundle {
namespace {

// Receivers darker than this share of the mean may have the error of one that bright.
constexpr float kDarkShare = 0.25f;
// Where few receivers have noise, each may have up to so many times the error that it may have
// elsewhere, while all of them together keep to this share of the target.
constexpr float kMostLaxity = 3;
constexpr double kLaxShare = 0.25;
// A shadow's edge lies between two neighbours where so much more of the light is visible to one, or
// where one has more of its contrast by so many times the error that it may have.
constexpr float kStep = 0.15f, kEdgeTimes = 2;

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

// Receivers whose samples may have missed the edge of a shadow: one beside them has it, or is as
// dark as behind one. tolerance: W/m^2.
std::vector<bool> besideShadows(const std::vector<Gathered>& results,
                                const std::vector<ReceiverPair>& neighbours,
                                const std::vector<float>& tolerance) {
    std::vector<bool> beside(results.size(), false);
    for (const auto& [a, b] : neighbours) {
        const bool isStep = std::abs(results[a].visibleShare() - results[b].visibleShare()) > kStep;
        const float edge = results[b].contrast - results[a].contrast;
        if (isStep || edge > kEdgeTimes * tolerance[a]) beside[a] = true;
        if (isStep || -edge > kEdgeTimes * tolerance[b]) beside[b] = true;
    }
    return beside;
}

}  // namespace

Aims aimsAfter(const std::vector<Gathered>& results, const Patches& patches,
               const std::function<Receiver(size_t)>& receiverAt,
               const std::vector<ReceiverPair>& neighbours, float targetError) {
    // Of what is shown, if any light reaches that: a sunny yard says nothing of a room.
    double lit[2] = {0, 0}, litArea[2] = {0, 0};
    for (size_t k = 0; k < results.size(); ++k)
        if (const double h = brightest(results[k].irradiance); h > 0) {
            const Receiver receiver = receiverAt(k);
            const double weight = receiver.point ? 1 : double(patches.area[receiver.side / 2]);
            lit[receiver.isShown] += weight * h;
            litArea[receiver.isShown] += weight;
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
        tolerance[k] = receiver.errorFactor * kDirectShare * targetError *
                       std::max(floor, brightest(results[k].irradiance));
    }
    const float factor = laxity(results, counts, tolerance, kLaxShare * targetError * meanLight);
    for (float& error : tolerance) error *= factor;
    const std::vector<bool> besideShadow = besideShadows(results, neighbours, tolerance);
    Aims further;
    for (uint32_t k = 0; k < results.size(); ++k)
        if (besideShadow[k] || std::sqrt(results[k].variance) > tolerance[k]) {
            further.receivers.push_back(k);
            further.aims.push_back({tolerance[k], kFirstSamples, besideShadow[k]});
        }
    return further;
}

}  // namespace raybundle
