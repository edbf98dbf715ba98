// SPDX-License-Identifier: GPL-3.0-or-later
//
// What each receiver got from each source. Light is linear in the strengths of its sources: where
// nothing else changed since the last bake, what a source brought is scaled and not shot again.
//
// What differs from shooting again: each source has the samples that it needed beside the others
// as they were. Receivers that need more of them now are found by their error and shot again, for
// this bake alone; all are where a source has become much more of the light.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "lights/light_source.h"
#include "lights/receiver.h"

namespace raybundle {

class LightBySource {
  public:
    // At so many receivers; has room for none of it if that would take too much memory.
    LightBySource(const std::vector<std::unique_ptr<LightSource>>& sources, size_t receivers);

    bool hasRoom() const { return !parts.empty(); }
    // Of a receiver: an entry a source.
    LightPart* of(size_t receiver) { return parts.data() + receiver * magnitudes.size(); }

    // See DirectLight; in the order of the sources that it was made of.
    std::vector<PowerShares> powerShares;
    // Whether all of it was filled in.
    bool isWhole = false;

    // What has become of a source: which one it is now, and how many times as strong. One that is
    // gone is dark.
    struct Match {
        std::optional<size_t> source;
        glm::vec3 factor{0.0f};
    };
    // Of each source; none if anything but strengths differs, or if one has become much more of the
    // light.
    std::optional<std::vector<Match>> match(
        const std::vector<std::unique_ptr<LightSource>>& now) const;

    // The light at all receivers. isUnpowered(source, receiver), of sources as they are now: see
    // Gathered.
    template <class IsUnpowered>
    std::vector<Gathered> scaled(const std::vector<Match>& matches,
                                 const IsUnpowered& isUnpowered) const {
        std::vector<Gathered> results(parts.size() / matches.size());
        for (size_t receiver = 0; receiver < results.size(); ++receiver)
            for (size_t k = 0; k < matches.size(); ++k)
                if (const auto source = matches[k].source)
                    results[receiver].add(
                        uint32_t(*source),
                        parts[receiver * matches.size() + k].scaled(matches[k].factor),
                        isUnpowered(*source, receiver),
                        hash(uint32_t(receiver), uint32_t(*source)));
        return results;
    }

    // Per receiver: all its light as it was, and the variance of that.
    std::vector<Gathered> asItWas() const;

  private:
    std::vector<uint64_t> shapes;       // per source
    std::vector<glm::vec3> magnitudes;  // the same
    std::vector<LightPart> parts;       // receiver by receiver, source by source
};

}  // namespace raybundle
