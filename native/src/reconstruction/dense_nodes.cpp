// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/dense_nodes.h"

#include <algorithm>
#include <numeric>

#include "job/cancellation.h"
#include "patches/side.h"

namespace raybundle {
namespace {

// Two receivers at one vertex compare their shadows if the cosine of their normals is at least
// this.
constexpr float kAlike = 0.8f;

}  // namespace

struct DenseNodes::Faces {
    // Per node: whether it lies on a dense face, whether on another one, and its number of cells.
    std::vector<uint8_t> isDense, isOther;
    std::vector<uint32_t> cells;
    // Per cell of the instance: the number of its parents, and the last of them.
    std::vector<uint32_t> parentCount, parent;
};

std::vector<bool> denseInstances(const Scene& scene, const Patches& patches,
                                 const ShownLight& shown) {
    std::vector<bool> result(scene.instances.size(), false);
    for (uint32_t side = 0; side < patches.sideCount(); ++side)
        if (shown.isGatheredAtNodes(side)) result[patches.parentAt(side).instance] = true;
    return result;
}

DenseNodes::DenseNodes(const ReconstructionInput& input, const std::vector<InstanceRange>& ranges,
                       const std::vector<bool>& isDense, const std::vector<SmoothRegions>& regions)
    : input(input), ranges(ranges), regions(regions), ofInstances(ranges.size()) {
    for (size_t i = 0; i < ranges.size(); ++i) {
        ofInstances[i].first = uint32_t(all.size());
        if (isDense[i]) addReceivers(i);
        ofInstances[i].last = uint32_t(all.size());
    }
}

uint32_t DenseNodes::sideOfParent(size_t instance, uint32_t parent) const {
    return sideOf(input.patches.parents[parent].firstPatch,
                  uint32_t(input.scene.instances[instance].side));
}

DenseNodes::Faces DenseNodes::facesOf(size_t instance) const {
    const InstanceRange& range = ranges[instance];
    const SmoothRegions& region = regions[instance];
    const size_t cellCount = range.lastCell - range.firstCell;
    Faces faces{std::vector<uint8_t>(region.nodeCount), std::vector<uint8_t>(region.nodeCount),
                std::vector<uint32_t>(region.nodeCount), std::vector<uint32_t>(cellCount),
                std::vector<uint32_t>(cellCount)};
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        throwIfCancelledAt(p);
        const uint32_t cell = input.patches.parents[p].cell;
        faces.parent[cell - range.firstCell] = p;
        const bool isFirst = ++faces.parentCount[cell - range.firstCell] == 1;
        const bool isOfDense = input.shown.isGatheredAtNodes(sideOfParent(instance, p));
        for (const int32_t corner : input.patches.cells[cell].corner) {
            if (corner < 0) continue;
            const uint32_t node = region.nodeOf[size_t(corner)];
            (isOfDense ? faces.isDense : faces.isOther)[node] = true;
            faces.cells[node] += isFirst;
        }
    }
    return faces;
}

// Returns per node the corner that gathers for it, if it gathers. The corners of a node differ in
// little but the face that they lie on, so that one of them stands for all: the one whose face is
// closest to upright below the shading normal, unless another surface touches it.
std::vector<std::optional<CornerReceiver>> DenseNodes::chooseCorners(size_t instance,
                                                                     const Faces& faces) const {
    const SmoothRegions& region = regions[instance];
    const std::vector<CornerReceiver> corners =
        cornerReceivers(input.scene, input.patches, uint32_t(instance), ranges[instance]);
    // The corners of each node are order[first[node]] to order[first[node + 1] - 1].
    std::vector<uint32_t> first(region.nodeCount + 1), order(corners.size());
    for (const CornerReceiver& corner : corners) ++first[region.nodeOf[size_t(corner.corner)] + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<uint32_t> next(first.begin(), first.end() - 1);
    for (uint32_t c = 0; c < corners.size(); ++c)
        order[next[region.nodeOf[size_t(corners[c].corner)]]++] = c;
    auto upright = [&](uint32_t c) {
        const Receiver& receiver = corners[c].receiver;
        return glm::dot(receiver.normal, input.patches.normal(receiver.side));
    };
    std::vector<std::optional<CornerReceiver>> chosen(region.nodeCount);
    parallelFor(uint32_t(0), region.nodeCount, [&](uint32_t node) {
        if (!faces.isDense[node] || faces.isOther[node]) return;
        const auto begin = order.begin() + first[node], end = order.begin() + first[node + 1];
        std::stable_sort(begin, end,
                         [&](uint32_t a, uint32_t b) { return upright(a) > upright(b); });
        for (auto it = begin; it != end && !chosen[node]; ++it) {
            CornerReceiver corner = corners[*it];
            leaveGap(corner, input.patches, input.visibility);
            if (!isTouched(corner.receiver, input.patches, input.visibility)) chosen[node] = corner;
        }
    });
    return chosen;
}

uint32_t DenseNodes::add(const Receiver& receiver, const glm::vec3& position, bool isWholeFace) {
    all.push_back(receiver);
    positions.push_back(position);
    wholeFaces.push_back(isWholeFace);
    return uint32_t(all.size() - 1);
}

void DenseNodes::addReceivers(size_t instance) {
    const InstanceRange& range = ranges[instance];
    const SmoothRegions& region = regions[instance];
    const Faces faces = facesOf(instance);
    const std::vector<std::optional<CornerReceiver>> chosen = chooseCorners(instance, faces);
    OfInstance& own = ofInstances[instance];
    own.receiverOf.assign(region.nodeCount, kNone);
    for (uint32_t c = range.firstCell; c < range.lastCell; ++c) {
        throwIfCancelledAt(c);
        const uint32_t parents = faces.parentCount[c - range.firstCell];
        if (parents == 0) continue;
        std::vector<uint32_t> nodes;
        for (const int32_t corner : input.patches.cells[c].corner)
            if (corner >= 0) nodes.push_back(region.nodeOf[size_t(corner)]);
        const bool isAlone =
            parents == 1 && std::all_of(nodes.begin(), nodes.end(), [&](uint32_t node) {
                return faces.cells[node] == 1 && chosen[node];
            });
        if (isAlone) {
            Receiver receiver = chosen[nodes.front()]->receiver;
            receiver.side = sideOfParent(instance, faces.parent[c - range.firstCell]);
            receiver.normal = input.patches.normal(receiver.side);
            receiver.point = input.patches.point(patchOf(receiver.side), glm::vec2(0.5f));
            const uint32_t shared = add(receiver, *receiver.point, true);
            for (const uint32_t node : nodes) own.receiverOf[node] = shared;
            continue;
        }
        for (const uint32_t node : nodes)
            if (chosen[node] && own.receiverOf[node] == kNone)
                own.receiverOf[node] = add(chosen[node]->receiver, chosen[node]->vertex, false);
    }
    own.gathersAll = true;
    for (uint32_t c = range.firstCell; c < range.lastCell; ++c)
        for (const int32_t corner : input.patches.cells[c].corner)
            if (corner >= 0 && receiverAt(instance, corner) == kNone) own.gathersAll = false;
}

std::vector<ReceiverPair> DenseNodes::neighbours(size_t instance) const {
    std::vector<ReceiverPair> pairs;
    const OfInstance& own = ofInstances[instance];
    auto pair = [&](uint32_t a, uint32_t b) {
        if (a != kNone && b != kNone && a != b) pairs.push_back({a - own.first, b - own.first});
    };
    const Mesh& mesh = input.scene.meshes[size_t(input.scene.instances[instance].mesh)];
    std::vector<uint32_t> lastOf(mesh.vertices.size(), kNone);  // per vertex
    for (uint32_t c = ranges[instance].firstCell; c < ranges[instance].lastCell; ++c) {
        throwIfCancelledAt(c);
        const Cell& cell = input.patches.cells[c];
        uint32_t before = receiverAt(instance, cell.corner[size_t(cell.cornerCount() - 1)]);
        for (int k = 0; k < cell.cornerCount(); ++k) {
            const int32_t corner = cell.corner[size_t(k)];
            const uint32_t receiver = receiverAt(instance, corner);
            pair(before, receiver);
            before = receiver;
            if (receiver == kNone) continue;
            uint32_t& last = lastOf[size_t(mesh.cornerVertices[size_t(corner)])];
            if (last != kNone && glm::dot(all[last].normal, all[receiver].normal) >= kAlike)
                pair(last, receiver);
            last = receiver;
        }
    }
    return pairs;
}

}  // namespace raybundle
