// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/corner_gather.h"

#include <algorithm>
#include <cmath>

#include "job/cancellation.h"

namespace raybundle {
namespace {

// Corners gather no light of their own on a patch side whose exposed share is not above this value:
// they keep the light of the patches.
constexpr float kHalfCovered = 0.5f;

// Sets the allowed errors of the receivers from index `first` on. Corners at one node contribute to
// one mean, and only the error of this mean counts, so that each corner may have a larger error.
void shareErrors(std::vector<CornerReceiver>& corners, size_t first, const SmoothRegions& regions) {
    auto nodeOf = [&](size_t c) { return regions.nodeOf[size_t(corners[c].corner)]; };
    std::vector<uint32_t> count(regions.nodeCount, 0);
    for (size_t c = first; c < corners.size(); ++c) ++count[nodeOf(c)];
    for (size_t c = first; c < corners.size(); ++c)
        corners[c].receiver.errorFactor = std::sqrt(float(count[nodeOf(c)]));
}

}  // namespace

std::vector<bool> gatheringInstances(const Scene& scene, const Settings& settings) {
    std::vector<bool> gathers;
    for (const Instance& instance : scene.instances)
        gathers.push_back(instance.role == RB_ROLE_BAKE &&
                          (settings.reconstruction == Reconstruction::POINT ||
                           (instance.hasSparseResults && gathersSparseResults(settings))));
    return gathers;
}

CornerGather::CornerGather(const ReconstructionInput& input,
                           const std::vector<InstanceRange>& ranges,
                           const std::vector<bool>& gathers,
                           const std::vector<SmoothRegions>& regions, const LitSurfaces& surfaces,
                           const Progress& progress)
    : scene(input.scene),
      shown(input.shown),
      ranges(ranges),
      regions(regions),
      surfaces(surfaces),
      skips(input.settings),
      gathersSparse(gathersSparseResults(input.settings)) {
    findCorners(input, gathers);
    gatherSources(input, progress);
}

void CornerGather::findCorners(const ReconstructionInput& input, const std::vector<bool>& gathers) {
    const Patches& patches = input.patches;
    const Visibility& visibility = input.visibility;
    for (size_t i = 0; i < ranges.size(); ++i) {
        first.push_back(corners.size());
        if (!gathers[i]) continue;
        std::vector<CornerReceiver> all = cornerReceivers(scene, patches, uint32_t(i), ranges[i]);
        const std::vector<int32_t>& vertices =
            scene.meshes[size_t(scene.instances[i].mesh)].cornerVertices;
        std::vector<uint8_t> isFree(all.size());
        parallelFor(size_t(0), all.size(), [&](size_t c) {
            const Receiver& receiver = all[c].receiver;
            if (!scene.instances[i].hasResultAtVertex(size_t(vertices[size_t(all[c].corner)])))
                return;
            leaveGap(all[c], patches, visibility);
            isFree[c] = surfaces.exposed[receiver.side] > kHalfCovered &&
                        !isTouched(receiver, patches, visibility);
        });
        for (size_t c = 0; c < all.size(); ++c)
            if (isFree[c]) corners.push_back(all[c]);
        shareErrors(corners, first.back(), regions[i]);
        if (isSparse(i)) sparse += corners.size() - first.back();
    }
    first.push_back(corners.size());
}

void CornerGather::gatherSources(const ReconstructionInput& input, const Progress& progress) {
    const SetLights& lights = input.lights;
    const Settings& settings = input.settings;
    // The receivers are all corners, followed by the other sides of the corners at translucent
    // patches, which show light of both sides. `behind` lists these corners.
    std::vector<uint32_t> behind;
    for (size_t c = 0; c < corners.size(); ++c)
        if (!showsOwnAlone(c)) behind.push_back(uint32_t(c));
    auto receiverAt = [&](size_t k) {
        if (k < corners.size()) return corners[k].receiver;
        Receiver other = corners[behind[k - corners.size()]].receiver;
        other.side ^= 1;
        other.normal = -other.normal;
        return other;
    };
    for (size_t k = 0; k < lights.size(); ++k) {
        const Progress part = progress.part(k, lights.size());
        const std::vector<Gathered> gathered = lights[k].direct.gather(
            corners.size() + behind.size(), receiverAt, settings.targetError,
            [&](double done) { part.report(RB_STAGE_RECONSTRUCTION, done); });
        std::vector<glm::vec3>& light = sources.emplace_back();
        std::vector<float>& variance = variances.emplace_back();
        for (size_t c = 0; c < corners.size(); ++c) variance.push_back(gathered[c].variance);
        for (size_t c = 0; c < corners.size(); ++c)
            light.push_back(shown.byAngle(corners[c].receiver.side, gathered[c].meanAngles()) *
                            gathered[c].irradiance);
        for (size_t b = 0; b < behind.size(); ++b) {
            glm::vec3& own = light[behind[b]];
            own = shown.of(corners[behind[b]].receiver.side, own,
                           gathered[corners.size() + b].irradiance, surfaces.exposed);
        }
        for (const Gathered& one : gathered) rays += one.rays;
        const double mean = meanLight(scene, surfaces, ranges, lights[k].irradiance);
        others.push_back(settings.finalGather && mean > 0
                             ? std::make_unique<const FinalGather>(
                                   surfaces, input.visibility, input.clusters, lights[k],
                                   lights[k].irradiance, float(mean), settings.targetError)
                             : nullptr);
    }
}

CornerGather::Outcome CornerGather::improve(size_t instance, size_t k,
                                            const std::vector<float>& cornerAngles,
                                            const std::vector<glm::vec3>& shownShare,
                                            NodeLight& light) const {
    Outcome outcome;
    const std::vector<uint32_t>& nodeOf = regions[instance].nodeOf;
    const uint32_t nodeCount = regions[instance].nodeCount;
    const size_t begin = first[instance], end = first[instance + 1];
    // Variance of the light that the final gather found, per node, mean over the channels,
    // (W/m^2)^2.
    std::vector<double> gathered(nodeCount, 0.0);
    if (others[k]) {
        const FinalGather& gather = *others[k];
        std::vector<bool> wanted(nodeCount, true);
        if (skips.skipGather && !isSparse(instance)) {
            wanted = gather.isWanted(ranges[instance], regions[instance],
                                     scene.instances[instance].side, light.carried, light.indirect);
            std::vector<uint8_t> isNear(end - begin);
            parallelFor(begin, end, [&](size_t c) {
                isNear[c - begin] = showsOwnAlone(c) && !wanted[nodeOf[corners[c].corner]] &&
                                    (corners[c].isBesideGap || gather.isNear(corners[c].receiver));
            });
            for (size_t c = begin; c < end; ++c)
                if (isNear[c - begin]) wanted[nodeOf[corners[c].corner]] = true;
        }
        // The final gather does not collect light from behind, which translucent patches show too.
        for (size_t c = begin; c < end; ++c)
            if (!showsOwnAlone(c)) wanted[nodeOf[corners[c].corner]] = false;
        std::vector<std::vector<FinalGather::Share>> receivers(nodeCount);
        for (size_t c = begin; c < end; ++c) {
            const uint32_t node = nodeOf[corners[c].corner];
            const float angle = cornerAngles[corners[c].corner];
            if (wanted[node] && angle > 0) receivers[node].push_back({&corners[c].receiver, angle});
        }
        parallelFor(size_t(0), receivers.size(), [&](size_t node) {
            if (receivers[node].empty()) return;
            float sum = 0;
            for (const FinalGather::Share& share : receivers[node]) sum += share.share;
            for (FinalGather::Share& share : receivers[node]) share.share /= sum;
            const FinalGather::Light found = gather.gather(
                receivers[node],
                std::max(gather.meanLight(), brightest(light.direct[node] + light.indirect[node])));
            gathered[node] = found.variance;
            light.carried[node] = found.carried;
            light.indirect[node] = found.reflected;
        });
        outcome.smooth = size_t(std::count(wanted.begin(), wanted.end(), false));
    }
    const auto means = nodeMeans(instance, cornerAngles, [&](size_t c) { return sources[k][c]; });
    for (size_t node = 0; node < shownShare.size(); ++node) {
        light.carried[node] *= shownShare[node];
        light.indirect[node] *= shownShare[node];
    }
    for (size_t node = 0; node < means.size(); ++node)
        if (means[node]) light.direct[node] = light.carried[node] + *means[node];
    if (!isSparse(instance)) return outcome;
    std::vector<double> variance(nodeCount, 0.0), weights(nodeCount, 0.0);
    for (size_t c = begin; c < end; ++c) {
        const double angle = double(cornerAngles[corners[c].corner]);
        variance[nodeOf[corners[c].corner]] += angle * angle * double(variances[k][c]);
        weights[nodeOf[corners[c].corner]] += angle;
    }
    for (size_t node = 0; node < nodeCount; ++node) {
        if (!(weights[node] > 0)) continue;
        ++outcome.gathered;
        outcome.noise += 3 * (variance[node] / (weights[node] * weights[node]) + gathered[node]);
    }
    return outcome;
}

template <class LightOf>
std::vector<std::optional<glm::vec3>> CornerGather::nodeMeans(
    size_t instance, const std::vector<float>& cornerAngles, const LightOf& lightOf) const {
    const uint32_t nodeCount = regions[instance].nodeCount;
    std::vector<glm::vec3> sums(nodeCount, glm::vec3(0.0f));
    std::vector<float> weights(nodeCount, 0.0f);
    for (size_t c = first[instance]; c < first[instance + 1]; ++c) {
        const uint32_t node = regions[instance].nodeOf[corners[c].corner];
        const float angle = cornerAngles[corners[c].corner];
        sums[node] += angle * lightOf(c);
        weights[node] += angle;
    }
    std::vector<std::optional<glm::vec3>> means(nodeCount);
    for (size_t node = 0; node < means.size(); ++node)
        if (weights[node] > 0) means[node] = sums[node] / weights[node];
    return means;
}

}  // namespace raybundle
