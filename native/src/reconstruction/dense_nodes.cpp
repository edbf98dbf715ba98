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
// A face has one receiver only if its cells are smaller than squares of this share of a tile's
// edge, and the cosine between their normals is at least kFlatQuad.
constexpr double kWholeFace = 0.5, kFlatQuad = 0.98;

}  // namespace

struct DenseNodes::Faces {
    // Per node: whether it lies on a dense face, whether on another one, and the number of faces.
    std::vector<uint8_t> isDense, isOther;
    std::vector<uint32_t> count;
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
    std::vector<int32_t> last(region.nodeCount, -1);  // per node: its last face so far
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        throwIfCancelledAt(p);
        const uint32_t cell = input.patches.parents[p].cell;
        faces.parent[cell - range.firstCell] = p;
        ++faces.parentCount[cell - range.firstCell];
        const bool isOfDense = input.shown.isGatheredAtNodes(sideOfParent(instance, p));
        for (const int32_t corner : input.patches.cells[cell].corner) {
            if (corner < 0) continue;
            const uint32_t node = region.nodeOf[size_t(corner)];
            (isOfDense ? faces.isDense : faces.isOther)[node] = true;
            const int32_t face = input.patches.cells[cell].face;
            faces.count[node] += last[node] != face;
            last[node] = face;
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

// Adds a receiver in the middle of the largest cell of a face, if the face is a small triangle or
// quad that is nearly flat, shares no node with other faces, and all of its nodes gather. Its cells
// are `first` to `end` - 1.
std::optional<uint32_t> DenseNodes::addWholeFace(
    size_t instance, const Faces& faces, const std::vector<std::optional<CornerReceiver>>& chosen,
    uint32_t first, uint32_t end) {
    const std::vector<Cell>& cells = input.patches.cells;
    uint32_t largest = first;
    if (end - first > 2) return std::nullopt;
    for (uint32_t c = first; c < end; ++c) {
        if (glm::dot(cells[c].normal(), cells[first].normal()) < kFlatQuad) return std::nullopt;
        if (faces.parentCount[c - ranges[instance].firstCell] != 1) return std::nullopt;
        for (const int32_t corner : cells[c].corner) {
            if (corner < 0) continue;
            const uint32_t node = regions[instance].nodeOf[size_t(corner)];
            if (faces.count[node] != 1 || !chosen[node]) return std::nullopt;
        }
        if (cells[c].area() > cells[largest].area()) largest = c;
    }
    const uint32_t node = regions[instance].nodeOf[size_t(cells[largest].corner[0])];
    Receiver receiver = chosen[node]->receiver;
    receiver.side = sideOfParent(instance, faces.parent[largest - ranges[instance].firstCell]);
    const double most = kWholeFace * double(input.patches.islandAt(receiver.side).size);
    if (cells[largest].area() > most * most) return std::nullopt;
    receiver.normal = input.patches.normal(receiver.side);
    receiver.point = input.patches.point(patchOf(receiver.side), glm::vec2(0.5f));
    return add(receiver, *receiver.point, true);
}

void DenseNodes::addReceivers(size_t instance) {
    const InstanceRange& range = ranges[instance];
    const SmoothRegions& region = regions[instance];
    const Faces faces = facesOf(instance);
    const std::vector<std::optional<CornerReceiver>> chosen = chooseCorners(instance, faces);
    OfInstance& own = ofInstances[instance];
    own.receiverOf.assign(region.nodeCount, kNone);
    const std::vector<Cell>& cells = input.patches.cells;
    for (uint32_t c = range.firstCell, end = c; c < range.lastCell; c = end) {
        throwIfCancelledAt(c);
        while (end < range.lastCell && cells[end].face == cells[c].face) ++end;
        if (const std::optional<uint32_t> shared = addWholeFace(instance, faces, chosen, c, end)) {
            for (uint32_t k = c; k < end; ++k)
                for (const int32_t corner : cells[k].corner)
                    if (corner >= 0) own.receiverOf[region.nodeOf[size_t(corner)]] = *shared;
            continue;
        }
        for (uint32_t k = c; k < end; ++k) {
            if (faces.parentCount[k - range.firstCell] == 0) continue;
            for (const int32_t corner : cells[k].corner) {
                if (corner < 0) continue;
                const uint32_t node = region.nodeOf[size_t(corner)];
                if (chosen[node] && own.receiverOf[node] == kNone)
                    own.receiverOf[node] = add(chosen[node]->receiver, chosen[node]->vertex, false);
            }
        }
    }
    own.isAllDense =
        std::find(faces.isOther.begin(), faces.isOther.end(), true) == faces.isOther.end();
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
