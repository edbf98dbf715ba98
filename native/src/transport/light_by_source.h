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

#include "transport/light_source.h"
#include "transport/receiver.h"

namespace raybundle {

class LightBySource {
  public:
    // At so many receivers; has room for none of it if that would take too much memory.
    LightBySource(const std::vector<std::unique_ptr<LightSource>>& sources, size_t receivers);

    bool hasRoom() const { return !parts.empty(); }
    // Of a receiver: an entry a source.
    LightPart* of(size_t receiver) { return parts.data() + receiver * magnitudes.size(); }

    // See DirectLight.
    std::vector<glm::dvec3> escapedShares;
    // Whether all of it was filled in.
    bool isWhole = false;

    // How many times as strong the sources are now; none if anything else in them differs, or if
    // one has become much more of the light.
    std::optional<std::vector<glm::vec3>> factors(
        const std::vector<std::unique_ptr<LightSource>>& now) const;

    // The light at all receivers with these factors. isUnpowered(source, receiver): see Gathered.
    template <class IsUnpowered>
    std::vector<Gathered> scaled(const std::vector<glm::vec3>& factors,
                                 const IsUnpowered& isUnpowered) const {
        std::vector<Gathered> results(parts.size() / magnitudes.size());
        for (size_t receiver = 0; receiver < results.size(); ++receiver)
            for (size_t k = 0; k < magnitudes.size(); ++k)
                results[receiver].add(parts[receiver * magnitudes.size() + k].scaled(factors[k]),
                                      isUnpowered(k, receiver));
        return results;
    }

  private:
    std::vector<uint64_t> shapes;       // per source
    std::vector<glm::vec3> magnitudes;  // the same
    std::vector<LightPart> parts;       // receiver by receiver, source by source
};

}  // namespace raybundle
