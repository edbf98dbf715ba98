// SPDX-License-Identifier: GPL-3.0-or-later
#include "direct_light/light_by_source.h"

#include <numeric>

namespace raybundle {
namespace {

constexpr size_t kMostParts = size_t(1) << 21;  // 104 MB
// A source whose share of the light has grown by more than this factor would have got more samples.
constexpr double kMostGrowth = 2;

}  // namespace

LightBySource::LightBySource(const LightSources& sources, size_t receivers) {
    if (sources.empty() || receivers > kMostParts / sources.size()) return;
    for (const auto& source : sources) {
        shapes.push_back(source->shape);
        magnitudes.push_back(source->magnitude);
    }
    parts.resize(receivers * sources.size());
}

std::optional<LightBySource::Matches> LightBySource::match(const LightSources& now) const {
    if (!isWhole) return std::nullopt;
    Matches result{std::vector<Match>(shapes.size()), {}};
    std::vector<Match>& matches = result.ofKept;
    for (size_t source = 0; source < now.size(); ++source) {
        // Each present source is matched with the first free source of equal shape that gave light
        // in all its channels.
        const glm::vec3& strength = now[source]->magnitude;
        size_t k = 0;
        auto isMatch = [&] {
            if (matches[k].source || shapes[k] != now[source]->shape) return false;
            for (int c = 0; c < 3; ++c)
                if (!(magnitudes[k][c] > 0) && strength[c] != 0) return false;
            return true;
        };
        while (k < shapes.size() && !isMatch()) ++k;
        if (k == shapes.size()) {
            // Samples of a source with parts follow what receivers see of it, which is found out
            // for all receivers together.
            if (!now[source]->parts().empty()) return std::nullopt;
            result.fresh.push_back(source);
            continue;
        }
        matches[k].source = source;
        for (int c = 0; c < 3; ++c)
            if (magnitudes[k][c] > 0) matches[k].factor[c] = strength[c] / magnitudes[k][c];
    }
    if (2 * result.fresh.size() > now.size()) return std::nullopt;

    // Sum over the receivers of the light in the brightest channel, per source.
    std::vector<double> before(matches.size(), 0.0), after(before);
    for (size_t i = 0; i < parts.size(); ++i) {
        const size_t k = i % matches.size();
        before[k] += double(brightest(parts[i].irradiance));
        after[k] += double(brightest(matches[k].factor * parts[i].irradiance));
    }
    const double allBefore = std::accumulate(before.begin(), before.end(), 0.0);
    double allAfter = std::accumulate(after.begin(), after.end(), 0.0);
    // Fresh sources are taken for those that are gone: most often a lamp was moved a little.
    for (size_t k = 0; k < matches.size(); ++k)
        if (!matches[k].source && !result.fresh.empty()) allAfter += before[k];
    for (size_t k = 0; k < matches.size(); ++k)
        if (after[k] * allBefore > kMostGrowth * before[k] * allAfter) return std::nullopt;
    return result;
}

Gathered LightBySource::asItWas(size_t receiver) const {
    const std::vector<Match> same(shapes.size(), {0, glm::vec3(1.0f)});
    return scaled(same, receiver, [](size_t, size_t) { return false; });
}

}  // namespace raybundle
