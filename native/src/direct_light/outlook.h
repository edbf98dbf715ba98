// SPDX-License-Identifier: GPL-3.0-or-later
//
// What receivers beside each other see of a source that surrounds them. Indoors the sky is behind
// a window: of samples in proportion to its radiance few get there, and most of the light's noise
// and time is their being blocked. The first samples of all receivers around tell which parts of
// the source are seen from there at all; later ones are taken in proportion to that too.
//
// Sources: Donikian, Walter, Bala, Fernandez and Greenberg, "Accurate Direct Illumination Using
// Iterative Adaptive Sampling" (2006), who learn distributions over lights for blocks of pixels.
// Differs:
// - Blocks are clusters of receivers that are near and face alike, and distributions are over the
//   parts of one source, each of which keeps a least share: samples stay without bias.
// - Learnt twice, and then kept: from the coarse shot's samples by wide clusters, and from more
//   samples by near ones. As counts, so that the number of threads does not matter.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "lights/light_source.h"
#include "lights/receiver.h"
#include "patches/patches.h"

namespace raybundle {

// From this share of the samples on a source is seen so well that its closed form, times the share,
// tells more than samples of what is seen of it.
constexpr float kWellSeen = 0.5f;

// Where the first samples of a receiver went.
class Sightings {
  public:
    static constexpr int kMost = 64;

    void add(uint32_t part, bool isSeen) {
        if (count < parts.size()) parts[count++] = uint16_t(2 * part + uint32_t(isSeen));
    }
    float seenShare() const {
        float seen = 0;
        forEach([&](uint32_t, bool isSeen) { seen += isSeen; });
        return seen / float(std::max<uint8_t>(1, count));
    }
    // Calls visit(part, isSeen) for each.
    template <class Visit>
    void forEach(const Visit& visit) const {
        for (size_t k = 0; k < count; ++k) visit(uint32_t(parts[k] / 2), parts[k] % 2 == 1);
    }

  private:
    std::array<uint16_t, kMost> parts;
    uint8_t count = 0;
};

// Of the receivers of a cluster.
struct Outlook {
    // Per part of the source: how many samples it should get for its light; above 0. Empty: all
    // alike.
    std::vector<float> seen;
    float mean = 0;  // share of the samples that were visible
    size_t receivers = 1;
    bool isDark = true;  // none was
};

class Outlooks {
  public:
    Outlooks() = default;
    // these: receivers, whose sightings are those of the same number. clusterSize: receivers, at
    // most. power: of the visible share of a part, in what it gets of the samples: 1 where that is
    // well known; 1/2 has the least variance where samples of a part are seen at random.
    Outlooks(const PartNeighbours& parts, const std::vector<uint32_t>& these,
             const std::function<Receiver(size_t)>& receiverAt, const Patches& patches,
             const std::vector<Sightings>& sightings, size_t clusterSize, float power);

    // Of the k-th of these; null without any.
    const Outlook* of(size_t k) const;

  private:
    std::vector<uint32_t> clusterOf;  // per receiver
    std::vector<Outlook> clusters;
};

}  // namespace raybundle
