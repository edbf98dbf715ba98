// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light that each receiver got from each source. Light is proportional to the strength of its
// source. If only the strengths of some sources changed since the last bake, or some were moved,
// added or removed, the light of the others is kept or scaled instead of gathered again.
//
// The number of samples of a source was chosen for the old strengths. Receivers that need more
// samples with the new strengths are recognised by their error and gathered again, for this bake
// only. All receivers are gathered again if a source has become a much larger part of the light.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "job/cancellation.h"
#include "lights/light_source.h"
#include "lights/receiver.h"

namespace raybundle {

// The light of each source at each receiver, kept for relighting.
class LightBySource {
  public:
    // Reserves memory for `receivers` receivers, or none if that would take too much.
    LightBySource(const LightSources& sources, size_t receivers);

    bool hasRoom() const { return !parts.empty(); }
    // Returns the light of one receiver: one entry per source.
    LightPart* of(size_t receiver) { return parts.data() + receiver * magnitudes.size(); }

    // The result of DirectLight::powerShares, per source in the order of the constructor.
    std::vector<PowerShares> powerShares;
    // Whether all entries have been filled.
    bool isWhole = false;

    // What has become of a source: its index among the present sources, and how many times as
    // strong it is. Without an index the source is gone and gives no light.
    struct Match {
        std::optional<size_t> source;
        glm::vec3 factor{0.0f};
    };
    struct Matches {
        std::vector<Match> ofKept;  // per source whose light is kept
        // Indices of present sources whose light is not: they are new, were moved or were dark.
        std::vector<size_t> fresh;
    };
    // Returns what has become of the sources. Returns nothing if more than half of the present
    // sources are fresh, if a source with parts is, or if a source has become a much larger part of
    // the light.
    std::optional<Matches> match(const LightSources& now) const;

    // Returns the light at all receivers with the present strengths. isUnpowered(source, receiver)
    // takes the index of a present source; see Gathered::unpowered.
    template <class IsUnpowered>
    std::vector<Gathered> scaled(const std::vector<Match>& matches,
                                 const IsUnpowered& isUnpowered) const {
        std::vector<Gathered> results(parts.size() / matches.size());
        parallelFor(size_t(0), results.size(), [&](size_t receiver) {
            results[receiver] = scaled(matches, receiver, isUnpowered);
        });
        return results;
    }

    // Returns the light of a receiver with the old strengths.
    Gathered asItWas(size_t receiver) const;

  private:
    template <class IsUnpowered>
    Gathered scaled(const std::vector<Match>& matches, size_t receiver,
                    const IsUnpowered& isUnpowered) const {
        Gathered result;
        for (size_t k = 0; k < matches.size(); ++k)
            if (const auto source = matches[k].source)
                result.add(uint32_t(*source),
                           parts[receiver * matches.size() + k].scaled(matches[k].factor),
                           isUnpowered(*source, receiver),
                           hash(uint32_t(receiver), uint32_t(*source)));
        return result;
    }

    std::vector<uint64_t> shapes;       // per source
    std::vector<glm::vec3> magnitudes;  // per source
    std::vector<LightPart> parts;       // entry receiver * (number of sources) + source
};

}  // namespace raybundle
