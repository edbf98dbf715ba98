// SPDX-License-Identifier: GPL-3.0-or-later
#include "lights/enclosing.h"

#include <algorithm>

namespace raybundle {
namespace {

// Largest number of pairs (surface, parent) that emptyInsides compares. Above it, no inside is
// taken to be empty.
constexpr size_t kMostPairs = size_t(1) << 26;

}  // namespace

Extent boxOf(const Patches& patches, const Parent& parent) {
    Extent box;
    for (size_t k = 0; k < (parent.isTriangle ? 3 : 4); ++k)
        box.add(glm::dvec3(patches.vertices[parent.vertex[k]]));
    return box;
}

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
    std::vector<uint32_t> candidates;
    for (uint32_t p = 0; p < patches.count(); ++p)
        if (emission[2 * p + 1] != glm::vec3(0.0f))
            candidates.push_back(patches.parentAt(2 * p).surface);
    if (candidates.empty()) return {};
    std::sort(candidates.begin(), candidates.end());
    candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());

    const std::vector<Enclosing> surfaces = enclosingSurfaces(patches);
    std::vector<bool> isEmpty(surfaces.size(), false);
    if (candidates.size() * patches.parents.size() > kMostPairs) return isEmpty;
    for (uint32_t s : candidates) isEmpty[s] = surfaces[s].hides[1];
    for (const Parent& parent : patches.parents) {
        if (scene.instances[parent.instance].side == RB_SIDE_BACK) isEmpty[parent.surface] = false;
        for (uint32_t p = parent.firstPatch; p < parent.firstPatch + parent.patchCount(); ++p)
            if (patches.opacityOf(p) < 1 || patches.translucenceOf(2 * p + 1) != glm::vec3(0.0f))
                isEmpty[parent.surface] = false;
        // A parent that only touches the surface from outside does not lie inside it.
        const Extent box = boxOf(patches, parent);
        const double touch = double(patches.islands[parent.island].touchDistance);
        for (uint32_t s : candidates)
            if (s != parent.surface && box.isNear(surfaces[s].box, -touch)) isEmpty[s] = false;
    }
    return isEmpty;
}

}  // namespace raybundle
