// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/interim_light.h"

#include "job/cancellation.h"
#include "patches/side.h"
#include "reconstruction/area_average.h"
#include "reconstruction/instance_side.h"
#include "reconstruction/reconstruction.h"
#include "reconstruction/smooth_regions.h"

namespace raybundle {
namespace {

// Copies the values of nodes to all corners of the nodes.
std::vector<glm::vec3> atCorners(const SmoothRegions& regions,
                                 const std::vector<glm::vec3>& ofNodes) {
    std::vector<glm::vec3> result;
    result.reserve(regions.nodeOf.size());
    for (uint32_t node : regions.nodeOf) result.push_back(ofNodes[node]);
    return result;
}

}  // namespace

std::vector<InstanceLight> interimLight(const Scene& scene, const LitSurfaces& surfaces,
                                        const ShownLight& shown, const Irradiance& light) {
    const Patches& patches = surfaces.patches;
    std::vector<glm::vec3> exitance(patches.sideCount());
    for (size_t side = 0; side < exitance.size(); ++side)
        exitance[side] = patches.opacityOf(uint32_t(patchOf(side))) * patches.emission[side] +
                         shown.color()[side] * light.all(side);
    const std::vector<InstanceRange> ranges = instanceRanges(scene, patches);
    std::vector<InstanceLight> result(scene.instances.size());
    parallelFor(size_t(0), result.size(), [&](size_t i) {
        const Instance& instance = scene.instances[i];
        InstanceLight& out = result[i];
        out.name = instance.name;
        out.isBaked = instance.role == RB_ROLE_BAKE;
        if (!out.isBaked) return;
        const SmoothRegions regions = smoothRegions(scene.meshes[instance.mesh], patches.cells,
                                                    ranges[i].firstCell, ranges[i].lastCell);
        const std::vector<std::vector<glm::vec3>> nodes =
            areaAverage(surfaces, {ranges[i], regions, instance.side},
                        {&light.direct, &light.indirect, &exitance});
        out.direct = atCorners(regions, nodes[0]);
        out.indirect = atCorners(regions, nodes[1]);
        out.exitance = atCorners(regions, nodes[2]);
    });
    return result;
}

}  // namespace raybundle
