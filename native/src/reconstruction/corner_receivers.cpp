// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/corner_receivers.h"

#include <algorithm>
#include <cmath>

#include "job/cancellation.h"
#include "patches/side.h"
#include "sampling/sobol.h"
#include "visibility/local_lines.h"

namespace raybundle {
namespace {

// Distance of a corner's receiver from the corner, as a share of the way to the middle of the cell.
constexpr float kTowardsMiddle = 0.01f;
// Smallest cosine between the shading normal and the normal of the face for which the shading
// normal is used. Below it, the shading normal is as good as perpendicular to the face's normal,
// and rounding decides to which side it points. The face's normal is used then.
constexpr float kUpright = 1e-3f;
// A gap is narrow if it is less than kNarrowGap times as wide as the receiver's distance from its
// corner. The receiver is then moved to kInsideGap times the width of the gap from the corner. At
// the edges of two parallel plates that are as long as they are wide, the receiver then gets 3 %
// less of the light around the plates.
constexpr float kNarrowGap = 8, kInsideGap = 1.0f / 32;

}  // namespace

std::vector<CornerReceiver> cornerReceivers(const Scene& scene, const Patches& patches,
                                            uint32_t instance, const InstanceRange& range) {
    const Instance& placed = scene.instances[instance];
    const Mesh& mesh = scene.meshes[placed.mesh];
    const glm::dmat3 normalToWorld = glm::transpose(glm::inverse(glm::dmat3(placed.transform)));
    const float turn = placed.side == RB_SIDE_BACK ? -1.0f : 1.0f;

    // Each receiver lies on the parent of the corner's cells that contains its point or is nearest
    // to it. `nearest` is per corner: the smallest result of Parent::outside() so far.
    std::vector<float> nearest(mesh.cornerCount(), INFINITY);
    std::vector<CornerReceiver> receivers(mesh.cornerCount());
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        throwIfCancelledAt(p);
        const Parent& parent = patches.parents[p];
        const Cell& cell = patches.cells[parent.cell];
        const int n = cell.cornerCount();
        glm::vec3 centre(0.0f);
        for (int k = 0; k < n; ++k) centre += cell.position(k) / float(n);
        for (int k = 0; k < n; ++k) {
            const int32_t corner = cell.corner[k];
            const glm::vec3 point = glm::mix(cell.position(k), centre, kTowardsMiddle);
            const glm::vec2 st = parent.affineAt(point);
            const float off = parent.outside(st);
            if (off >= nearest[corner]) continue;
            nearest[corner] = off;
            receivers[corner].corner = corner;
            receivers[corner].vertex = cell.position(k);
            Receiver& receiver = receivers[corner].receiver;
            receiver.side =
                2 * (parent.firstPatch + parent.patchAt(st.x, st.y)) + uint32_t(placed.side);
            receiver.point = point;
            receiver.targetFactor = placed.noiseFactor;
            receiver.seed = hash(instance, uint32_t(corner));
            receiver.normal = patches.normal(receiver.side);
            if (mesh.cornerNormals.empty()) continue;
            const glm::dvec3 shading = normalToWorld * glm::dvec3(mesh.cornerNormals[corner]);
            const glm::vec3 normal = turn * glm::vec3(glm::normalize(shading));
            if (glm::dot(normal, receiver.normal) > kUpright) receiver.normal = normal;
        }
    }
    std::vector<CornerReceiver> result;
    for (const CornerReceiver& corner : receivers)
        if (corner.receiver.point) result.push_back(corner);
    return result;
}

void leaveGap(CornerReceiver& corner, const Patches& patches, const Visibility& visibility) {
    Receiver& receiver = corner.receiver;
    const float inside = glm::distance(*receiver.point, corner.vertex);
    float gap = 0;
    if (!visibility.firstHit(receiver.side, *receiver.point, patches.normal(receiver.side), &gap,
                             kNarrowGap * inside))
        return;
    corner.isBesideGap = true;
    receiver.point = glm::mix(corner.vertex, *receiver.point,
                              std::min(1.0f, kInsideGap * gap / std::max(inside, 1e-30f)));
    receiver.side = 2 * patches.patchAt(patches.parentOf[patchOf(receiver.side)], *receiver.point) +
                    isBack(receiver.side);
}

bool isTouched(const Receiver& receiver, const Patches& patches, const Visibility& visibility) {
    const glm::vec3 normal = patches.normal(receiver.side);
    float distance = 0;
    const auto met = visibility.firstHit(receiver.side, *receiver.point, normal, &distance,
                                         2 * patches.islandAt(receiver.side).touchDistance);
    return met && isCovered(patches, receiver.side, *met, normal, distance);
}

}  // namespace raybundle
