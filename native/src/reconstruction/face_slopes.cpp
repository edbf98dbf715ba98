// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/face_slopes.h"

#include <algorithm>
#include <array>

namespace raybundle {
namespace {

// Distance of the points at which light is evaluated from the corners of the face, as a share of
// the way to the middle. At the corner itself, which may lie on the edge of a source, rounding
// would decide the value of the closed form.
constexpr float kOffCorner = 1e-4f;

}  // namespace

void addFaceSlopes(const Patches& patches, const InstanceSide& surface, const ShownLight& shown,
                   const LightOfSources& sources, float targetError,
                   const std::vector<bool>& isKept, NodeLight& nodes) {
    const SetLight& light = sources.light;
    if (light.direct.lightSources().empty()) return;
    const InstanceRange& range = surface.range;
    const SmoothRegions& regions = surface.regions;
    std::vector<uint32_t> cells(regions.nodeCount, 0), patchesOf(range.lastCell - range.firstCell);
    auto forEachNode = [&](const Cell& cell, const auto& visit) {
        for (int k = 0; k < 4; ++k)
            if (cell.corner[k] >= 0) visit(k, regions.nodeOf[size_t(cell.corner[k])]);
    };
    for (uint32_t c = range.firstCell; c < range.lastCell; ++c)
        forEachNode(patches.cells[c], [&](int, uint32_t node) { ++cells[node]; });
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p)
        patchesOf[patches.parents[p].cell - range.firstCell] += patches.parents[p].patchCount();

    for (uint32_t p = range.firstParent; p < range.lastParent; ++p) {
        const Parent& parent = patches.parents[p];
        const Cell& cell = patches.cells[parent.cell];
        if (patchesOf[parent.cell - range.firstCell] != 1) continue;
        bool isAlone = true;
        std::array<glm::vec3, 4> points, values;
        std::array<uint32_t, 4> own;
        size_t count = 0;
        const glm::vec3 middle =
            cell.position(0) + (cell.isTriangle() ? 1 / 3.0f : 0.5f) * (cell.a + cell.b);
        forEachNode(cell, [&](int k, uint32_t node) {
            isAlone = isAlone && cells[node] == 1 && (isKept.empty() || !isKept[node]);
            points[count] = glm::mix(cell.position(k), middle, kOffCorner);
            own[count++] = node;
        });
        const uint32_t at = 2 * parent.firstPatch + uint32_t(surface.side);
        const glm::vec3 arriving = sources.arriving[at];
        // On translucent patches the slopes of the light on both sides would be needed.
        if (!isAlone || arriving == glm::vec3(0.0f) ||
            patches.translucenceOf(at) != glm::vec3(0.0f))
            continue;
        // Slopes that are small compared with the target error are left out.
        light.direct.unblocked(at, points.data(), count, 0.25f * targetError, values.data());
        const glm::vec3 factor = shown.ofSources(at, light.shot);
        glm::vec3 mean(0.0f), share(0.0f);
        for (size_t k = 0; k < count; ++k) mean += values[k] / float(count);
        for (size_t k = 0; k < count; ++k)
            values[k] = glm::max(mean + (values[k] - mean) / (1 - kOffCorner), 0.0f);
        for (int c = 0; c < 3; ++c)
            if (mean[c] > 0) share[c] = std::min(1.0f, arriving[c] / mean[c]);
        for (size_t k = 0; k < count; ++k) {
            glm::vec3 &direct = nodes.direct[own[k]], &exitance = nodes.exitance[own[k]];
            const glm::vec3 flat = direct;
            direct = glm::max(flat + factor * share * (values[k] - mean), 0.0f);
            exitance = glm::max(exitance + shown.color()[at] * (direct - flat), 0.0f);
        }
    }
}

}  // namespace raybundle
