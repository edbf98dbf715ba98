// SPDX-License-Identifier: GPL-3.0-or-later
#include "visibility/exposed_share.h"

#include "job/cancellation.h"
#include "patches/side.h"
#include "sampling/sobol.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

// If a straight edge covers a part of a side, this number of points measures the part to half a
// percent.
constexpr uint32_t kPoints = 256;

float shareExposed(uint32_t side, const Visibility& visibility, const Clusters& clusters,
                   uint32_t seed) {
    const Patches& surface = clusters.members();
    const SobolPoints points(hash(seed, side));
    uint32_t covered = 0;
    for (uint32_t k = 0; k < kPoints; ++k) {
        const uint32_t from = clusters.memberOf(side, k);
        const glm::vec3 normal = surface.normal(from);
        float distance = 0;
        const auto met =
            visibility.firstHit(from, surface.point(patchOf(from), {points[k].x, points[k].y}),
                                normal, &distance, surface.touchDistance);
        covered += met && isCovered(surface, from, *met, normal, distance);
    }
    return float(kPoints - covered) / float(kPoints);
}

}  // namespace

std::vector<float> exposedShareOf(const std::vector<uint32_t>& sides, const Visibility& visibility,
                                  const Clusters& clusters, uint32_t seed) {
    std::vector<float> share(sides.size());
    parallelFor(size_t(0), sides.size(), [&](size_t k) {
        throwIfCancelledAt(k);
        share[k] = shareExposed(sides[k], visibility, clusters, seed);
    });
    return share;
}

}  // namespace raybundle
