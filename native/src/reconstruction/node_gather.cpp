// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/node_gather.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "job/cancellation.h"
#include "patches/side.h"
#include "reconstruction/light_around.h"
#include "scene/channels.h"

namespace raybundle {

NodeGather::NodeGather(const ReconstructionInput& input, const std::vector<InstanceRange>& ranges,
                       const std::vector<bool>& isDense, const std::vector<SmoothRegions>& regions,
                       const LitSurfaces& surfaces, const Progress& progress)
    : input(input), ranges(ranges), regions(regions), nodes(input, ranges, isDense, regions) {
    gatherLamps(progress);
    for (size_t k = 0; k < input.lights.size(); ++k) {
        const SetLight& light = input.lights[k];
        sharp.emplace_back();
        others.emplace_back();
        const double mean = meanLight(input.scene, surfaces, ranges, light.irradiance);
        if (!(mean > 0)) continue;
        sharp[k] = sharpened(k);
        others[k] = std::make_unique<const FinalGather>(surfaces, input.visibility, input.clusters,
                                                        light, irradiance(k), float(mean),
                                                        input.settings.targetError);
    }
}

// Gathers object by object, because the error that is allowed is relative to the light of an
// object: a sunny yard must not set that of a room.
void NodeGather::gatherLamps(const Progress& progress) {
    const size_t count = nodes.receivers().size();
    for (size_t k = 0; k < input.lights.size(); ++k)
        lamps.push_back({std::vector<glm::vec3>(count), std::vector<glm::vec3>(count),
                         std::vector<float>(count)});
    for (size_t i = 0; i < nodes.instanceCount(); ++i) {
        if (nodes[i].isEmpty()) continue;
        progress.report(RB_STAGE_RECONSTRUCTION, double(nodes[i].first) / double(count));
        const std::vector<ReceiverPair> neighbours = nodes.neighbours(i);
        for (size_t k = 0; k < input.lights.size(); ++k) gatherLamps(i, k, neighbours);
    }
}

void NodeGather::gatherLamps(size_t instance, size_t k,
                             const std::vector<ReceiverPair>& neighbours) {
    const uint32_t first = nodes[instance].first;
    const Irradiance& all = input.lights[k].irradiance;
    const std::vector<Gathered> gathered = input.lights[k].direct.gather(
        nodes[instance].last - first,
        [&](size_t n) {
            Receiver receiver = nodes.receivers()[first + n];
            // The mean over a face shows how far the edge of a shadow reaches into it.
            if (nodes.isWholeFace(uint32_t(first + n))) receiver.point.reset();
            receiver.of = Receiver::Of::OTHERS;
            receiver.otherLight = brightest(all.all(receiver.side) - all.ofSources[receiver.side]);
            return receiver;
        },
        input.settings.targetError, [](double) { throwIfCancelled(); }, {}, neighbours);
    for (size_t n = 0; n < gathered.size(); ++n) {
        const uint32_t side = nodes.receivers()[first + n].side;
        lamps[k].arriving[first + n] = gathered[n].irradiance;
        lamps[k].shown[first + n] =
            input.shown.byAngle(side, gathered[n].meanAngles()) * gathered[n].irradiance;
        lamps[k].variance[first + n] = gathered[n].variance;
        rays += gathered[n].rays;
    }
}

// Returns the irradiance of a light with that by lamps as the dense nodes get it, instead of what
// one side has gathered for its whole cluster. Rays that meet these sides nearby then see their
// shadows. Returns null if that changes nothing, or if the light of lamps is not known apart from
// that of a source that surrounds the scene.
std::unique_ptr<const Irradiance> NodeGather::sharpened(size_t k) const {
    const SetLight& light = input.lights[k];
    if (light.direct.lightSources().empty() || light.direct.isSurrounding()) return nullptr;
    auto result = std::make_unique<Irradiance>(light.irradiance);
    std::vector<glm::vec3> sums(input.patches.sideCount(), glm::vec3(0.0f));
    std::vector<float> counts(sums.size(), 0.0f);
    for (size_t i = 0; i < nodes.instanceCount(); ++i) {
        if (nodes[i].isEmpty()) continue;
        nodes.forEachCorner(i, [&](uint32_t side, uint32_t receiver) {
            sums[side] += lamps[k].arriving[receiver];
            ++counts[side];
        });
    }
    for (size_t side = 0; side < sums.size(); ++side) {
        if (!(counts[side] > 0)) continue;
        const glm::vec3 mean = sums[side] / counts[side];
        result->direct[side] += mean - result->ofSources[side];
        result->ofSources[side] = mean;
    }
    return result;
}

NodeGather::Outcome NodeGather::replace(size_t instance, size_t k,
                                        const std::vector<float>& cornerAngles,
                                        const std::vector<glm::vec3>& emission,
                                        NodeLight& light) const {
    Outcome outcome;
    const DenseNodes::OfInstance& own = nodes[instance];
    if (own.isEmpty()) return outcome;
    std::optional<LightAround> gather;
    std::vector<CachedLight> around(own.last - own.first);
    if (others[k]) {
        gather.emplace(input, input.lights[k], *others[k], nodes, instance, lamps[k].arriving);
        around = gather->atReceivers();
        outcome.interpolated = around.size() - gather->recordCount();
        rays += gather->shadowRays();
    }
    // The colour and the emission of the faces around each node, weighted by angle.
    const size_t count = own.receiverOf.size();
    std::vector<glm::vec3> color(count, glm::vec3(0.0f)), emitted(count, glm::vec3(0.0f)),
        where(count);
    std::vector<float> weight(count, 0.0f);
    const InstanceRange& range = ranges[instance];
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        const Parent& parent = input.patches.parents[p];
        const uint32_t side =
            sideOf(parent.firstPatch, uint32_t(input.scene.instances[instance].side));
        const Cell& cell = input.patches.cells[parent.cell];
        for (int c = 0; c < 4; ++c) {
            const int32_t corner = cell.corner[size_t(c)];
            if (corner < 0) continue;
            const uint32_t node = regions[instance].nodeOf[size_t(corner)];
            where[node] = cell.position(c);
            const float angle = std::max(cornerAngles[size_t(corner)], 1e-6f);
            color[node] += angle * input.shown.color()[side];
            emitted[node] += angle * emission[side];
            weight[node] += angle;
        }
    }
    const std::vector<glm::vec3>& everywhere = input.shown.everywhere();
    for (size_t node = 0; node < count; ++node) {
        const uint32_t receiver = own.receiverOf[node];
        if (receiver == DenseNodes::kNone) continue;
        // The nodes of a face that gathers in its middle get the slope of the light over it.
        const CachedLight rest = gather && nodes.isWholeFace(receiver)
                                     ? gather->at(receiver - own.first, where[node])
                                     : around[receiver - own.first];
        const glm::vec3 share =
            everywhere.empty() ? glm::vec3(1.0f) : everywhere[nodes.receivers()[receiver].side];
        glm::vec3 &direct = light.direct[node], &indirect = light.indirect[node];
        direct = lamps[k].shown[receiver] + rest.surrounding + share * rest.carried;
        indirect = share * rest.reflected;
        light.exitance[node] = (emitted[node] + color[node] * (direct + indirect)) / weight[node];
        ++outcome.nodes;
        outcome.noise += 3 * (double(lamps[k].variance[receiver]) + rest.variance);
    }
    if (gather) outcome.surplus = 3 * gather->surplus() * double(outcome.nodes);
    return outcome;
}

std::vector<bool> NodeGather::gatheredThemselves(size_t instance) const {
    const std::vector<uint32_t>& receiverOf = nodes[instance].receiverOf;
    std::vector<bool> result(receiverOf.size());
    for (size_t node = 0; node < result.size(); ++node)
        result[node] =
            receiverOf[node] != DenseNodes::kNone && !nodes.isWholeFace(receiverOf[node]);
    return result;
}

}  // namespace raybundle
