// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/reconstruction.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "job/cancellation.h"
#include "reconstruction/area_average.h"
#include "reconstruction/corner_gather.h"
#include "reconstruction/face_slopes.h"
#include "reconstruction/least_squares.h"
#include "reconstruction/shown_light.h"
#include "reconstruction/smooth_regions.h"

namespace raybundle {
namespace {

// An object whose front gets less than this share of the light of its back is probably inside out.
constexpr double kInsideOut = 1e-3;
constexpr size_t kTogether = 16;  // objects

using Field = std::vector<glm::vec3>;

double sum(const glm::dvec3& v) { return v.x + v.y + v.z; }

// The light of one set on the sides, as it goes into a reconstruction: of exitance what COMBINED
// shows, without gloss.
struct SideLight {
    Irradiance shown;
    Field emission;  // W/m^2
    Field exitance;  // emission included, W/m^2
    // For what corners gather: as if all of it were shown, whatever its angle, W/m^2.
    Field carried;  // direct light without that of the sources
    Field indirect;
};

bool isInsideOut(const Patches& patches, const InstanceRange& range, rb_side side,
                 const std::vector<SideLight>& lights) {
    double lit[2] = {0, 0};
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p)
        for (uint32_t k = 0; k < 2 * patches.parents[p].patchCount(); ++k) {
            const uint32_t at = 2 * patches.parents[p].firstPatch + k;
            glm::dvec3 total(0.0);
            for (const SideLight& light : lights) total += light.shown.all(at);
            // The inside of a lamp, whose light nobody asked for.
            if (at % 2 != uint32_t(side)) total += patches.emission[at];
            lit[at % 2] += double(patches.area[at / 2]) * sum(total);
        }
    return lit[side] < kInsideOut * lit[1 - side];
}

std::vector<SideLight> sideLights(const Patches& patches, const ShownLight& shown,
                                  const std::vector<float>& exposed, const SetLights& lights,
                                  bool gathersCorners) {
    std::vector<SideLight> result;
    for (const SetLight& light : lights) {
        SideLight out{
            shown.of(light, exposed), light.direct.emission(), Field(patches.sideCount()), {}, {}};
        for (size_t side = 0; side < out.exitance.size(); ++side) {
            // Of the whole patch, what lets light through included.
            const float opacity = patches.opacityOf(uint32_t(side / 2));
            out.emission[side] *= opacity;
            out.exitance[side] = out.emission[side] + shown.color()[side] * out.shown.all(side);
        }
        if (gathersCorners) {
            Irradiance all = shown.of(light.irradiance, exposed);
            for (size_t side = 0; side < all.direct.size(); ++side)
                all.direct[side] -= all.gathered[side];
            out.carried = std::move(all.direct);
            out.indirect = std::move(all.indirect);
        }
        result.push_back(std::move(out));
    }
    return result;
}

// Of the light at the corners with a result, summed over RGB.
double meanSquare(const Instance& instance, const InstanceLight& light) {
    double sum = 0;
    size_t count = 0;
    for (size_t c = 0; c < light.direct.size(); ++c) {
        if (!instance.hasResultAtVertex(size_t(light.cornerVertices[c]))) continue;
        const glm::dvec3 all(light.direct[c] + light.indirect[c]);
        sum += glm::dot(all, all);
        ++count;
    }
    return count > 0 ? sum / double(count) : 0;
}

// One value per corner from one per node.
CornerLight cornerLight(const SmoothRegions& regions, const Field& direct, const Field& indirect,
                        const Field& exitance) {
    CornerLight light;
    for (uint32_t node : regions.nodeOf) {
        light.direct.push_back(direct[node]);
        light.indirect.push_back(indirect[node]);
        light.exitance.push_back(exitance[node]);
    }
    return light;
}

}  // namespace

std::vector<InstanceRange> instanceRanges(const Scene& scene, const Patches& patches) {
    std::vector<InstanceRange> ranges(scene.instances.size());
    for (uint32_t c = 0; c < patches.cells.size(); ++c) {
        throwIfCancelledAt(c);
        InstanceRange& range = ranges[patches.cells[c].instance];
        if (range.lastCell == 0) range.firstCell = c;
        range.lastCell = c + 1;
    }
    for (uint32_t p = 0; p < patches.parents.size(); ++p) {
        throwIfCancelledAt(p);
        InstanceRange& range = ranges[patches.parents[p].instance];
        if (range.lastParent == 0) range.firstParent = p;
        range.lastParent = p + 1;
    }
    return ranges;
}

std::vector<InstanceLight> reconstruct(const Scene& scene, const Patches& patches,
                                       const Visibility& visibility, float touchDistance,
                                       const SetLights& lights, const ShownLight& shown,
                                       const std::vector<float>& exposed, const Settings& settings,
                                       const Progress& progress, Report& report) {
    const std::vector<InstanceRange> ranges = instanceRanges(scene, patches);
    const std::vector<float> outside = exposedOutside(patches, visibility, exposed);
    const std::vector<bool> gathers = gatheringInstances(scene, settings);
    const bool anyGathers = std::find(gathers.begin(), gathers.end(), true) != gathers.end();
    const std::vector<SideLight> onSides = sideLights(patches, shown, exposed, lights, anyGathers);
    auto findRegions = [&](size_t i) {
        return smoothRegions(scene.meshes[scene.instances[i].mesh], patches.cells,
                             ranges[i].firstCell, ranges[i].lastCell);
    };
    std::vector<SmoothRegions> regionsOf(scene.instances.size());  // of those that gather
    parallelFor(size_t(0), regionsOf.size(), [&](size_t i) {
        if (gathers[i]) regionsOf[i] = findRegions(i);
    });
    std::optional<CornerGather> atCorners;
    if (anyGathers)
        atCorners.emplace(scene, patches, visibility, touchDistance, lights, shown, ranges, gathers,
                          regionsOf, outside, settings, progress.part(0, 2));

    std::vector<InstanceLight> result(scene.instances.size());
    report.objects.resize(scene.instances.size());
    std::atomic<size_t> occluders = 0, smooth = 0;
    std::vector<std::optional<Warning>> warnings(scene.instances.size());
    auto reconstructInstance = [&](size_t i) {
        const Instance& instance = scene.instances[i];
        const Mesh& mesh = scene.meshes[instance.mesh];
        InstanceLight& out = result[i];
        out.name = instance.name;
        report.objects[i] = {instance.name, mesh.cornerCount(), "occluder", {}};
        out.isBaked = instance.role == RB_ROLE_BAKE;
        if (!out.isBaked && settings.skipOccluders) {
            ++occluders;
            return;
        }
        if (out.isBaked) report.objects[i].status = "baked";
        out.cornerVertices = mesh.cornerVertices;
        out.vertexCount = mesh.vertices.size();
        out.cornerAngles = cornerAngles(mesh);
        const bool isGathered = gathers[i];
        if (!isGathered) regionsOf[i] = findRegions(i);
        const SmoothRegions& regions = regionsOf[i];
        // Three fields of each light, one after the other; where corners gather the colour, and
        // what is shown of light from everywhere, are the last.
        std::vector<const Field*> fields;
        for (const SideLight& light : onSides) {
            fields.push_back(&light.shown.direct);
            if (isGathered)
                fields.insert(fields.end(), {&light.indirect, &light.carried});
            else
                fields.insert(fields.end(), {&light.shown.indirect, &light.exitance});
        }
        for (const SideLight& light : onSides)
            if (isGathered) fields.push_back(&light.emission);
        if (isGathered) fields.push_back(&shown.color());
        if (isGathered && !shown.everywhere().empty()) fields.push_back(&shown.everywhere());
        std::vector<Field> nodes;
        // Of sparse results only corners that cannot gather have the light of patches.
        if (settings.reconstruction == "AREA_AVERAGE" || (isGathered && atCorners->isSparse(i))) {
            nodes = areaAverage(patches, ranges[i], regions, instance.side, outside, fields);
        } else {
            LeastSquaresFit fit = leastSquares(patches, ranges[i], regions, instance.side, outside,
                                               settings.regularization, fields);
            nodes = std::move(fit.fields);
            if (!fit.isSolved)
                warnings[i] = {
                    WarningId::UNSOLVED_FIT,
                    "object \"" + instance.name +
                        "\": the least squares came to no solution, and its vertices have the "
                        "mean of the light around them; merge vertices by distance, or choose "
                        "the reconstruction AREA_AVERAGE"};
        }
        double noise = 0;  // of what corners gather: mean square
        for (size_t k = 0; k < lights.size(); ++k) {
            Field &direct = nodes[3 * k], &indirect = nodes[3 * k + 1];
            Field& exitance = nodes[3 * k + 2];
            if (isGathered) {
                CornerGather::NodeLight atNodes{
                    std::move(direct), std::move(indirect), std::move(exitance), {}};
                if (!shown.everywhere().empty()) atNodes.shownShare = nodes.back();
                const CornerGather::Outcome outcome =
                    atCorners->improve(i, k, out.cornerAngles, atNodes);
                smooth += outcome.smooth;
                if (outcome.gathered > 0) noise += outcome.noise / double(outcome.gathered);
                direct = std::move(atNodes.direct);
                indirect = std::move(atNodes.indirect);
                exitance.resize(direct.size());
                const Field& emission = nodes[3 * lights.size() + k];
                const Field& colors = nodes[4 * lights.size()];
                for (size_t v = 0; v < direct.size(); ++v)
                    exitance[v] = emission[v] + colors[v] * (direct[v] + indirect[v]);
            } else if (settings.reconstruction == "LEAST_SQUARES") {
                addFaceSlopes(patches, ranges[i], regions, instance.side, shown, lights[k],
                              settings.targetError, direct, exitance);
            }
            CornerLight light = cornerLight(regions, direct, indirect, exitance);
            if (k == 0)
                static_cast<CornerLight&>(out) = std::move(light);
            else
                out.sets.push_back(std::move(light));
        }
        for (const CornerLight& light : out.sets) out.add(light);
        regionsOf[i] = {};
        if (isGathered && atCorners->isSparse(i))
            if (const double signal = meanSquare(instance, out); signal > 0)
                out.gatheredNoise = float(std::sqrt(noise / signal));

        if (out.isBaked && isInsideOut(patches, ranges[i], instance.side, onSides)) {
            report.objects[i].status = "baked; no light on this side";
            warnings[i] = {WarningId::NO_LIGHT_ON_SIDE,
                           "object \"" + instance.name +
                               "\": the baked sides of its faces get no light but the other sides "
                               "do; flip its normals or choose the other side"};
        }
    };
    // Some at a time, so that this thread can report, and cancel, between them.
    for (size_t i = 0; i < scene.instances.size(); i += kTogether) {
        const double share = double(i) / double(scene.instances.size());
        progress.report(RB_STAGE_RECONSTRUCTION, anyGathers ? 0.5 + 0.5 * share : share);
        parallelFor(i, std::min(i + kTogether, scene.instances.size()), reconstructInstance);
    }
    for (std::optional<Warning>& warning : warnings)
        if (warning) report.warnings.push_back(std::move(*warning));
    if (atCorners) {
        report.shadowRays += atCorners->shadowRays();
        report.skip(SkippedWork::SMOOTH_CORNERS, smooth.load());
        report.skip(SkippedWork::SPARSE_CORNERS, atCorners->sparseCorners());
    }
    if (occluders) report.skip(SkippedWork::OCCLUDERS, occluders.load());
    progress.report(RB_STAGE_RECONSTRUCTION, 1);
    return result;
}

}  // namespace raybundle
