// SPDX-License-Identifier: GPL-3.0-or-later
#include "refinement/source_light.h"

#include <cmath>

#include "job/cancellation.h"
#include "sampling/sobol.h"

namespace raybundle {
namespace {

constexpr uint32_t kPlaceSeed = 0x11e5;

}  // namespace

SourceLight gatherSources(const KnownLight& known, const std::vector<Receiver>& receivers,
                          float targetError, const Progress& progress, Report& report) {
    SourceLight result{std::vector<glm::vec3>(receivers.size(), glm::vec3(0.0f)),
                       std::vector<float>(receivers.size(), 0.0f)};
    for (size_t k = 0; k < known.lights.size(); ++k) {
        const Progress part = progress.part(k, known.lights.size());
        const std::vector<Gathered> gathered = known.lights[k].direct.gather(
            receivers.size(), [&](size_t r) { return receivers[r]; }, targetError,
            [&](double done) { part.report(RB_STAGE_RECONSTRUCTION, done); });
        for (size_t r = 0; r < receivers.size(); ++r) {
            result.light[r] += known.shown.byAngle(receivers[r].side, gathered[r].meanAngles()) *
                               gathered[r].irradiance;
            result.variance[r] += gathered[r].variance;
            report.shadowRays += gathered[r].rays;
        }
    }
    return result;
}

std::vector<std::optional<glm::vec3>> SourceSampler::at(const std::vector<FacePlace>& places) {
    std::vector<std::optional<glm::vec3>> result(places.size());
    std::vector<Receiver> receivers;
    std::vector<size_t> gathering;
    for (size_t k = 0; k < places.size(); ++k) {
        throwIfCancelledAt(k);
        const auto receiver = receiverAt(places[k]);
        if (!receiver) continue;
        receivers.push_back(*receiver);
        gathering.push_back(k);
    }
    const SourceLight light = gatherSources(known, receivers, targetError, progress, report);
    for (size_t r = 0; r < gathering.size(); ++r) result[gathering[r]] = light.light[r];
    return result;
}

std::optional<Receiver> SourceSampler::receiverAt(const FacePlace& place) const {
    if (std::isnan(place.at.x)) return {};
    const auto tile = faces.tileAt(place.face, place.at);
    if (!tile) return {};
    return faces.receiver(*tile, place.at, hash(kPlaceSeed, place.seed));
}

}  // namespace raybundle
