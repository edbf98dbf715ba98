// SPDX-License-Identifier: GPL-3.0-or-later
//
// An outlook: which parts of a source that surrounds the scene are visible to a cluster of
// receivers. Indoors the sky is visible only through a window. Few samples taken in proportion to
// its radiance get there; the blocked samples cause most of the noise of the light and most of the
// time. The first samples of all nearby receivers show which parts of the source are visible at
// all. Later samples are taken in proportion to the visible share too.
//
// Sources: Donikian, Walter, Bala, Fernandez and Greenberg, "Accurate Direct Illumination Using
// Iterative Adaptive Sampling" (2006), which learns distributions over lights for blocks of pixels.
// Differs:
// - The blocks are clusters of receivers that are near each other and have similar normals. The
//   distributions are over the parts of one source. Each part keeps a least share, so that the
//   samples are unbiased.
// - A distribution is learnt twice and then kept: from the samples of the coarse shot for wide
//   clusters, and from more samples for near ones. The samples are counted in integers, so that the
//   number of threads does not matter.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "lights/light_source.h"
#include "lights/receiver.h"
#include "patches/patches.h"
#include "patches/side.h"

namespace raybundle {

// If at least this share of the samples reaches a source, its closed form times the visible share
// has less error than samples that follow the visible parts.
constexpr float kWellSeen = 0.5f;

// The parts of a source that the first samples of one receiver went to, and whether each was
// visible.
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
    // Calls visit(part, isSeen) for each sample.
    template <class Visit>
    void forEach(const Visit& visit) const {
        for (size_t k = 0; k < count; ++k) visit(uint32_t(patchOf(parts[k])), isBack(parts[k]));
    }

  private:
    std::array<uint16_t, kMost> parts;
    uint8_t count = 0;
};

// What a cluster of receivers sees of a source.
struct Outlook {
    // Per part of the source: the factor of its share of the samples, above 0. Empty if all parts
    // are sampled alike.
    std::vector<float> seen;
    float mean = 0;        // visible share of the samples
    size_t receivers = 1;  // number of receivers in the cluster
    bool isDark = true;    // whether no sample was visible
};
// The outlooks of all clusters of some receivers.

class Outlooks {
  public:
    Outlooks() = default;
    // Clusters the receivers `these` and learns their outlooks from `sightings`, which is indexed
    // by receiver. `clusterSize` is the largest number of receivers in a cluster. The visible share
    // of a part raised to `power` is the factor of its samples: 1 fits a share that is well known;
    // 1/2 has the least variance if the samples of a part are visible at random.
    Outlooks(const PartNeighbours& parts, const std::vector<uint32_t>& these,
             const std::function<Receiver(size_t)>& receiverAt, const Patches& patches,
             const std::vector<Sightings>& sightings, size_t clusterSize, float power);

    // Returns the outlook of receiver these[k]; null if there are no outlooks.
    const Outlook* of(size_t k) const;

  private:
    std::vector<uint32_t> clusterOf;  // per index in `these`
    std::vector<Outlook> clusters;
};

}  // namespace raybundle
