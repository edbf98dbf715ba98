// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/draft_light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "scene/channels.h"

namespace raybundle {
namespace {

// Light above this is computed anew when strengths change, W/m^2, and so is light whose sources
// have grown by more than the factor. The product of both is far from the largest float.
constexpr float kMostLight = 1e30f;
constexpr double kMostGrowth = 1e3;

void add(std::vector<glm::vec3>& sum, const std::vector<glm::vec3>& light, const glm::vec3& times) {
    for (size_t k = 0; k < light.size(); ++k) sum[k] += times * light[k];
}

void add(CornerLight& sum, const CornerLight& light, const glm::vec3& times) {
    add(sum.direct, light.direct, times);
    add(sum.indirect, light.indirect, times);
    add(sum.exitance, light.exitance, times);
}

bool isModerate(const CornerLight& light) {
    for (const auto* values : {&light.direct, &light.indirect, &light.exitance})
        for (const glm::vec3& value : *values)
            if (!(brightest(glm::abs(value)) < kMostLight)) return false;
    return true;
}

}  // namespace

bool DraftLight::isPossible(const Settings& settings) {
    return settings.draft && settings.countsLines() && settings.gathersFirstShot();
}

void DraftLight::part(std::vector<size_t> sources, const Irradiance& ofSources,
                      const Report::Energy& energy, std::vector<InstanceLight>& light) {
    parted.emplace();
    parted->sources = std::move(sources);
    parted->energy = energy;
    parted->onSides.direct = ofSources.direct;
    parted->onSides.ofSources = ofSources.ofSources;
    parted->onSides.indirect = ofSources.indirect;
    for (InstanceLight& instance : light) {
        parted->mayGrow = parted->mayGrow && isModerate(instance);
        parted->error.push_back(instance.error);
        CornerLight& own = parted->atCorners.emplace_back();
        if (instance.sets.empty()) continue;  // not reconstructed
        own = std::move(instance.sets.back());
        instance.sets.pop_back();
    }
}

std::vector<size_t> DraftLight::sourcesToPart(const SourceStrengths& now) const {
    if (!now.areOfSameBake(present)) return {};
    return now.changedSince(present);
}

std::optional<Report> DraftLight::scale(const SourceStrengths& now,
                                        std::vector<InstanceLight>& light, Irradiance& irradiance) {
    if (!now.areOfSameBake(strengths)) return std::nullopt;
    const std::vector<size_t> changed = now.changedSince(strengths);
    glm::dvec3 factor(1.0);
    if (parted) {
        if (!std::includes(parted->sources.begin(), parted->sources.end(), changed.begin(),
                           changed.end()))
            return std::nullopt;
        const auto growth = now.growthSince(strengths, parted->sources);
        const bool isTooMuch =
            growth && glm::any(glm::greaterThan(*growth, glm::dvec3(kMostGrowth)));
        if (!growth || isTooMuch || !parted->mayGrow) return std::nullopt;
        factor = *growth;
    } else if (!changed.empty()) {
        return std::nullopt;
    }
    Report result = report;
    result.seconds = {};
    result.totalSeconds = 0;
    result.shadowRays = 0;
    result.skip(SkippedWork::SCALED_DRAFT, 1);
    if (!parted) return result;
    result.energy.add(parted->energy, factor - 1.0);
    const glm::vec3 step(factor - parted->factor);
    add(irradiance.direct, parted->onSides.direct, step);
    add(irradiance.ofSources, parted->onSides.ofSources, step);
    add(irradiance.indirect, parted->onSides.indirect, step);
    // A cancellation must not leave the light half scaled.
    tbb::task_group_context whole(tbb::task_group_context::isolated);
    tbb::parallel_for(
        size_t(0), light.size(), [&](size_t i) { scaleInstance(i, factor, light[i]); }, whole);
    parted->factor = factor;
    present = now;
    return result;
}

void DraftLight::scaleInstance(size_t instance, const glm::dvec3& factor,
                               InstanceLight& light) const {
    const CornerLight& own = parted->atCorners[instance];
    const glm::vec3 step(factor - parted->factor), back(1.0 - parted->factor);
    for (size_t c = 0; c < light.error.size(); ++c) {
        const glm::vec3 all = light.direct[c] + light.indirect[c];
        const glm::vec3 apart = own.direct[c] + own.indirect[c];
        const float then = brightest(all + back * apart), now = brightest(all + step * apart);
        light.error[c] =
            parted->error[instance][c] * (then > 0 ? std::max(0.0f, now / then) : 1.0f);
    }
    add(light, own, step);
}

}  // namespace raybundle
