// SPDX-License-Identifier: GPL-3.0-or-later
#include "direct_light/outlook.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "job/cancellation.h"
#include "patches/side.h"

namespace raybundle {
namespace {

// Weight of the normal in the extent of a cluster, as a length relative to the radius of the
// island: near the corner of a room receivers with different normals see different parts.
constexpr float kNormalExtent = 0.5f;
// Weight of the visible share of the enclosing larger cluster, in samples per part.
constexpr float kPriorSamples = 2;
// Weight of a sample of a neighbouring part, because visible regions are connected.
constexpr float kBesideShare = 0.3f;
// Least visible share of a part, relative to the mean of all parts. It limits the largest weight of
// a sample to 1 / kLeastSeen times the mean weight.
constexpr float kLeastSeen = 0.1f;

using Key = std::array<float, 6>;  // position and scaled normal

// Forms clusters by halving and computes the outlook of each.
class Clustering {
  public:
    Clustering(const PartNeighbours& parts, const std::vector<uint32_t>& these,
               const std::vector<Sightings>& sightings, const std::vector<Key>& keys,
               size_t clusterSize, std::vector<uint32_t>& clusterOf, std::vector<Outlook>& clusters)
        : parts(parts),
          clusterSize(clusterSize),
          these(these),
          sightings(sightings),
          keys(keys),
          order(these.size()),
          clusterOf(clusterOf),
          clusters(clusters) {
        std::iota(order.begin(), order.end(), 0u);
        // Each cluster has more than half of clusterSize receivers, which bounds the number of
        // clusters.
        clusters.resize(order.size() / (clusterSize / 2) + 1);
        if (!order.empty()) split(0, order.size(), {});
    }

  private:
    // Halves a range of `order` until it is small enough. `around` holds the visible shares of the
    // cluster that this range is half of.
    void split(size_t first, size_t last, const std::vector<float>& around) {
        Outlook own = look(first, last, around);
        if (last - first <= clusterSize) {
            const size_t index = first / (clusterSize / 2);
            for (size_t k = first; k < last; ++k) clusterOf[order[k]] = uint32_t(index);
            clusters[index] = std::move(own);
            return;
        }
        const size_t axis = longest(first, last), middle = (first + last) / 2;
        std::nth_element(order.begin() + ptrdiff_t(first), order.begin() + ptrdiff_t(middle),
                         order.begin() + ptrdiff_t(last), [&](uint32_t a, uint32_t b) {
                             const float x = keys[a][axis], y = keys[b][axis];
                             return x != y ? x < y : a < b;  // the same order in every build
                         });
        parallelInvoke([&] { split(first, middle, own.seen); },
                       [&] { split(middle, last, own.seen); });
    }

    Outlook look(size_t first, size_t last, const std::vector<float>& around) const {
        std::vector<uint32_t> taken(parts.size(), 0), seen(parts.size(), 0);
        for (size_t k = first; k < last; ++k)
            sightings[these[order[k]]].forEach([&](uint32_t part, bool isSeen) {
                ++taken[part];
                seen[part] += isSeen;
            });
        Outlook own;
        const uint32_t samples = std::accumulate(taken.begin(), taken.end(), 0u);
        const uint32_t seenInAll = std::accumulate(seen.begin(), seen.end(), 0u);
        own.isDark = seenInAll == 0;
        own.receivers = last - first;
        own.mean = float(seenInAll) / float(std::max(1u, samples));
        own.seen.resize(parts.size());
        for (size_t part = 0; part < parts.size(); ++part) {
            float k = float(seen[part]), n = float(taken[part]);
            for (uint32_t other : parts[part]) {
                k += kBesideShare * float(seen[other]);
                n += kBesideShare * float(taken[other]);
            }
            const float prior = around.empty() ? own.mean : around[part];
            own.seen[part] = (k + kPriorSamples * prior) / (n + kPriorSamples);
        }
        return own;
    }

    size_t longest(size_t first, size_t last) const {
        Key low, high;
        low.fill(std::numeric_limits<float>::max());
        high.fill(-std::numeric_limits<float>::max());
        for (size_t k = first; k < last; ++k)
            for (size_t axis = 0; axis < low.size(); ++axis) {
                low[axis] = std::min(low[axis], keys[order[k]][axis]);
                high[axis] = std::max(high[axis], keys[order[k]][axis]);
            }
        size_t best = 0;
        for (size_t axis = 1; axis < low.size(); ++axis)
            if (high[axis] - low[axis] > high[best] - low[best]) best = axis;
        return best;
    }

    const PartNeighbours& parts;
    const size_t clusterSize;
    const std::vector<uint32_t>& these;
    const std::vector<Sightings>& sightings;
    const std::vector<Key>& keys;
    std::vector<uint32_t> order;
    std::vector<uint32_t>& clusterOf;
    std::vector<Outlook>& clusters;
};

}  // namespace

Outlooks::Outlooks(const PartNeighbours& parts, const std::vector<uint32_t>& these,
                   const std::function<Receiver(size_t)>& receiverAt, const Patches& patches,
                   const std::vector<Sightings>& sightings, size_t clusterSize, float power)
    : clusterOf(these.size()) {
    std::vector<Key> keys(these.size());
    parallelFor(size_t(0), these.size(), [&](size_t k) {
        const Receiver receiver = receiverAt(these[k]);
        const glm::vec3 at =
            receiver.point ? *receiver.point : patches.point(patchOf(receiver.side), {0.5f, 0.5f});
        const glm::vec3 normal =
            kNormalExtent * patches.islandAt(receiver.side).radius * receiver.normal;
        keys[k] = {at.x, at.y, at.z, normal.x, normal.y, normal.z};
    });
    Clustering(parts, these, sightings, keys, clusterSize, clusterOf, clusters);
    for (Outlook& outlook : clusters) {
        if (outlook.isDark) outlook.seen.clear();
        for (float& seen : outlook.seen)
            seen = std::pow(std::max(seen, kLeastSeen * outlook.mean), power);
    }
}

const Outlook* Outlooks::of(size_t k) const {
    return clusterOf.empty() ? nullptr : &clusters[clusterOf[k]];
}

}  // namespace raybundle
