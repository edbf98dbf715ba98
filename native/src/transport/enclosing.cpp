// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/enclosing.h"

namespace raybundle {
namespace {

// Pairs of surfaces and parents that are looked at.
constexpr size_t kMostPairs = size_t(1) << 26;

Enclosure boxOf(const Patches& patches, const Parent& parent) {
    Enclosure box;
    for (size_t k = 0; k < (parent.isTriangle ? 3 : 4); ++k)
        box.add(patches.vertices[parent.vertex[k]]);
    return box;
}

}  // namespace

void Enclosing::add(const Enclosing& other) {
    box.add(other.box);
    for (int k = 0; k < 2; ++k) hides[k] = hides[k] && other.hides[k];
}

std::vector<Enclosing> enclosingSurfaces(const Patches& patches) {
    std::vector<Enclosing> surfaces;
    for (const Parent& parent : patches.parents) {
        if (parent.surface >= surfaces.size()) surfaces.resize(parent.surface + 1);
        const bool isShell = parent.isSolid && parent.stopsDirect && parent.exchanges;
        surfaces[parent.surface].add(
            {boxOf(patches, parent), {isShell && parent.isInward, isShell && !parent.isInward}});
    }
    return surfaces;
}

std::vector<bool> emptyInsides(const Scene& scene, const Patches& patches,
                               const std::vector<glm::vec3>& emission) {
    const std::vector<Enclosing> surfaces = enclosingSurfaces(patches);
    std::vector<bool> isEmpty(surfaces.size(), false), isSeen(surfaces.size(), false);
    for (const Parent& parent : patches.parents) {
        if (scene.instances[parent.instance].side == RB_SIDE_BACK) isSeen[parent.surface] = true;
        for (uint32_t p = parent.firstPatch; p < parent.firstPatch + parent.patchCount(); ++p) {
            if (emission[2 * p + 1] != glm::vec3(0.0f)) isEmpty[parent.surface] = true;
            if (patches.opacityOf(p) < 1 || patches.translucenceOf(2 * p + 1) != glm::vec3(0.0f))
                isSeen[parent.surface] = true;
        }
    }
    std::vector<uint32_t> candidates;
    for (uint32_t s = 0; s < surfaces.size(); ++s) {
        isEmpty[s] = isEmpty[s] && surfaces[s].hides[1] && !isSeen[s];
        if (isEmpty[s]) candidates.push_back(s);
    }
    if (candidates.size() * patches.parents.size() > kMostPairs)
        return std::vector<bool>(surfaces.size(), false);
    for (const Parent& parent : patches.parents) {
        if (candidates.empty()) break;
        const Enclosure box = boxOf(patches, parent);
        const float touchDistance = patches.islands[parent.island].touchDistance;
        for (uint32_t s : candidates)
            if (s != parent.surface && box.meets(surfaces[s].box, touchDistance))
                isEmpty[s] = false;
    }
    return isEmpty;
}

}  // namespace raybundle
