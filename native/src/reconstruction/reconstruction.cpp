// SPDX-License-Identifier: GPL-3.0-or-later
#include "reconstruction/reconstruction.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <optional>

#include "job/cancellation.h"
#include "patches/side.h"
#include "reconstruction/area_average.h"
#include "reconstruction/corner_gather.h"
#include "reconstruction/face_slopes.h"
#include "reconstruction/instance_side.h"
#include "reconstruction/least_squares.h"
#include "reconstruction/node_gather.h"
#include "reconstruction/node_light.h"
#include "reconstruction/shown_light.h"
#include "reconstruction/smooth_regions.h"
#include "scene/channels.h"

namespace raybundle {
namespace {

// An object is probably inside out if its baked sides get less than this share of the light of the
// other sides.
constexpr double kInsideOut = 1e-3;
constexpr size_t kTogether = 16;  // number of objects that are reconstructed at once

using Field = std::vector<glm::vec3>;

// The light of one light set on all patch sides, as input of a reconstruction. The exitance is that
// of the output COMBINED, without gloss.
struct SideLight {
    Irradiance shown;
    Field emission;  // per side, exitance, W/m^2
    Field exitance;  // per side, with emission, W/m^2
    // Set if corners gather: irradiance per side, W/m^2, as if outputs showed all light whatever
    // its angle.
    Field carried;  // direct light without that of the sources
    Field indirect;
};

// Returns whether an object is probably inside out: its baked sides get almost no light, but the
// other sides do.
bool isInsideOut(const Patches& patches, const InstanceRange& range, rb_side side,
                 const std::vector<SideLight>& lights) {
    double lit[2] = {0, 0};
    for (uint32_t p = range.firstParent; p < range.lastParent; ++p)
        for (uint32_t k = 0; k < 2 * patches.parents[p].patchCount(); ++k) {
            const uint32_t at = 2 * patches.parents[p].firstPatch + k;
            glm::dvec3 total(0.0);
            for (const SideLight& light : lights) total += light.shown.all(at);
            // The emission of the other side counts as well: if the baked side is the dark inside
            // of a lamp, the user has probably chosen the wrong side.
            if (isBack(at) != uint32_t(side)) total += patches.emission[at];
            lit[isBack(at)] += double(patches.area[patchOf(at)]) * sumOfChannels(total);
        }
    return lit[side] < kInsideOut * lit[1 - side];
}

// Returns the light of all light sets on the patch sides. `gathersCorners` is true if the corners
// of any instance gather.
std::vector<SideLight> sideLights(const ReconstructionInput& input, bool gathersCorners) {
    const auto& [patches, exposed] = static_cast<const LitSurfaces&>(input);
    std::vector<SideLight> result;
    const ShownLight& shown = input.shown;
    for (const SetLight& light : input.lights) {
        SideLight out{
            shown.of(light, exposed), light.direct.emission(), Field(patches.sideCount()), {}, {}};
        for (size_t side = 0; side < out.exitance.size(); ++side) {
            // Emission is relative to the whole patch, including the share that lets light through.
            const float opacity = patches.opacityOf(uint32_t(patchOf(side)));
            out.emission[side] *= opacity;
            out.exitance[side] = out.emission[side] + shown.color()[side] * out.shown.all(side);
        }
        if (gathersCorners) {
            Irradiance all = shown.of(light.irradiance, exposed);
            for (size_t side = 0; side < all.direct.size(); ++side)
                all.direct[side] -= all.ofSources[side];
            out.carried = std::move(all.direct);
            out.indirect = std::move(all.indirect);
        }
        result.push_back(std::move(out));
    }
    return result;
}

// Returns the mean of the squared irradiance at the corners with a result, summed over RGB,
// (W/m^2)^2.
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

// Copies the light of each node to all corners of the node.
CornerLight cornerLight(const SmoothRegions& regions, const NodeLight& nodes) {
    CornerLight light;
    for (auto* values : {&light.direct, &light.indirect, &light.exitance})
        values->reserve(regions.nodeOf.size());
    for (uint32_t node : regions.nodeOf) {
        light.direct.push_back(nodes.direct[node]);
        light.indirect.push_back(nodes.indirect[node]);
        light.exitance.push_back(nodes.exitance[node]);
    }
    return light;
}

// Fields per side that are reconstructed at the nodes of an instance in one call, each with the
// field per node that receives the result.
class NodeFields {
  public:
    void add(const Field& ofSides, Field& atNodes) {
        sides.push_back(&ofSides);
        nodes.push_back(&atNodes);
    }
    const std::vector<const Field*>& ofSides() const { return sides; }
    void put(std::vector<Field> values) {
        for (size_t k = 0; k < nodes.size(); ++k) *nodes[k] = std::move(values[k]);
    }

  private:
    std::vector<const Field*> sides;
    std::vector<Field*> nodes;
};

using FieldList = std::vector<const Field*>;

LeastSquaresFit byLeastSquares(const LitSurfaces& surfaces, const InstanceSide& surface,
                               const Settings& settings, const FieldList& fields) {
    return leastSquares(surfaces, surface, settings.regularization, fields,
                        settings.draft ? kDraftFit : kExactFit);
}

LeastSquaresFit byAreaAverage(const LitSurfaces& surfaces, const InstanceSide& surface,
                              const Settings& /*settings*/, const FieldList& fields) {
    return {areaAverage(surfaces, surface, fields)};
}

// A row of the table of reconstructions. In POINT, the light that corners gather replaces the
// fitted light.
struct Kind {
    Reconstruction value;
    // Reconstructs fields per node from fields per side.
    LeastSquaresFit (*fit)(const LitSurfaces& surfaces, const InstanceSide& surface,
                           const Settings& settings, const FieldList& fields);
    bool addsSlopes;  // on instances that gather nothing, see reconstruction/face_slopes.h
};

constexpr Kind kKinds[] = {
    {Reconstruction::LEAST_SQUARES, byLeastSquares, true},
    {Reconstruction::AREA_AVERAGE, byAreaAverage, false},
    {Reconstruction::POINT, byLeastSquares, false},
};
static_assert(hasEveryValue(kKinds));

// Reconstructs the instances independently of each other.
class InstanceReconstruction {
  public:
    InstanceReconstruction(const ReconstructionInput& input, const Progress& progress)
        : input(input),
          kind(kKinds[size_t(input.settings.reconstruction)]),
          ranges(instanceRanges(input.scene, input.patches)),
          outside(exposedOutside(input, input.visibility)),
          gathers(gatheringInstances(input.scene, input.settings)),
          isDense(denseInstances(input.scene, input.patches, input.shown)),
          onSides(sideLights(input, anyGathers())),
          regionsOf(input.scene.instances.size()),
          warnings(input.scene.instances.size()) {
        parallelFor(size_t(0), regionsOf.size(), [&](size_t i) {
            if (gathers[i] || isDense[i]) regionsOf[i] = findRegions(i);
        });
        if (anyGathers())
            atCorners.emplace(input, ranges, gathers, regionsOf,
                              LitSurfaces{input.patches, outside}, progress.part(0, 4));
        if (anyDense())
            atNodes.emplace(input, ranges, isDense, regionsOf, LitSurfaces{input.patches, outside},
                            progress.part(1, 4));
    }

    bool anyGathers() const {
        return std::find(gathers.begin(), gathers.end(), true) != gathers.end();
    }
    bool anyDense() const {
        return std::find(isDense.begin(), isDense.end(), true) != isDense.end();
    }

    // Reconstructs instance `i`, and sets its entry `said` of the report. Different instances may
    // be reconstructed at once.
    void reconstruct(size_t i, InstanceLight& out, Report::Object& said) {
        const Instance& instance = input.scene.instances[i];
        const Mesh& mesh = input.scene.meshes[instance.mesh];
        out.name = instance.name;
        said = {instance.name, mesh.cornerCount(), "occluder", {}};
        out.isBaked = instance.role == RB_ROLE_BAKE;
        if (!out.isBaked && input.settings.skipOccluders) {
            ++occluders;
            return;
        }
        if (out.isBaked) said.status = "baked";
        out.cornerVertices = mesh.cornerVertices;
        out.vertexCount = mesh.vertices.size();
        out.cornerAngles = cornerAngles(mesh);
        if (!gathers[i] && !isDense[i]) regionsOf[i] = findRegions(i);
        const GatheredErrors errors = addLight(i, out);
        regionsOf[i] = {};
        if (isSparse(i) || isDense[i])
            if (const double signal = meanSquare(instance, out); signal > 0) {
                out.gatheredNoise = float(std::sqrt(errors.noise / signal));
                out.gatheredSurplus = float(std::sqrt(errors.surplus / signal));
            }
        if (out.isBaked && isInsideOut(input.patches, ranges[i], instance.side, onSides)) {
            said.status = "baked; no light on this side";
            warnings[i] = {WarningId::NO_LIGHT_ON_SIDE,
                           "object \"" + instance.name +
                               "\": almost no light reaches the baked sides of the faces, but the "
                               "other sides are lit; flip the normals, or bake the other side"};
        }
    }

    // Adds to the report the warnings and counts of all instances that were reconstructed.
    void addTo(Report& report) const {
        for (const std::optional<Warning>& warning : warnings)
            if (warning) report.warnings.push_back(*warning);
        if (atCorners) {
            report.shadowRays += atCorners->shadowRays();
            report.skip(SkippedWork::SMOOTH_CORNERS, smooth.load());
            report.skip(SkippedWork::SPARSE_CORNERS, atCorners->sparseCorners());
        }
        if (atNodes) {
            report.shadowRays += atNodes->shadowRays();
            report.skip(SkippedWork::DENSE_NODES, interpolated.load());
        }
        if (occluders) report.skip(SkippedWork::OCCLUDERS, occluders.load());
    }

  private:
    SmoothRegions findRegions(size_t i) const {
        return smoothRegions(input.scene.meshes[input.scene.instances[i].mesh], input.patches.cells,
                             ranges[i].firstCell, ranges[i].lastCell);
    }
    bool isSparse(size_t i) const { return gathers[i] && atCorners->isSparse(i); }

    // Mean squares of the errors of the light that corners gathered, summed over RGB, (W/m^2)^2; 0
    // if they gathered none: of its noise, and of its interpolation.
    struct GatheredErrors {
        double noise = 0, surplus = 0;
    };
    // The light that is reconstructed at the nodes of an instance.
    struct AtNodes {
        std::vector<NodeLight> lights;  // per light
        // On instances whose corners gather, per node: the shown reflectance, and the share that is
        // shown of light from everywhere (empty: all of it).
        Field color, shownShare;
    };
    // Computes the light of all light sets at the corners of an instance. Returns the errors of the
    // light that its corners gathered.
    GatheredErrors addLight(size_t i, InstanceLight& out) {
        const InstanceSide surface{ranges[i], regionsOf[i], input.scene.instances[i].side};
        AtNodes nodes = fitted(i, surface);
        GatheredErrors errors;
        for (size_t k = 0; k < nodes.lights.size(); ++k) {
            NodeLight& light = nodes.lights[k];
            if (gathers[i]) errors.noise += gather(i, k, out.cornerAngles, nodes);
            if (isDense[i]) {
                const NodeGather::Outcome outcome =
                    atNodes->replace(i, k, out.cornerAngles, onSides[k].emission, light);
                if (outcome.nodes > 0) {
                    errors.noise += outcome.noise / double(outcome.nodes);
                    errors.surplus += outcome.surplus / double(outcome.nodes);
                }
                interpolated += outcome.interpolated;
            }
            if (!gathers[i] && kind.addsSlopes) addSlopes(i, k, surface, light);
            CornerLight atCorner = cornerLight(regionsOf[i], light);
            if (k == 0)
                static_cast<CornerLight&>(out) = std::move(atCorner);
            else
                out.sets.push_back(std::move(atCorner));
        }
        for (const CornerLight& light : out.sets) out.add(light);
        return errors;
    }

    void addSlopes(size_t i, size_t k, const InstanceSide& surface, NodeLight& light) const {
        const Irradiance& irradiance =
            isDense[i] ? atNodes->irradiance(k) : input.lights[k].irradiance;
        addFaceSlopes(input.patches, surface, input.shown, {input.lights[k], irradiance.ofSources},
                      input.settings.targetError,
                      isDense[i] ? atNodes->gatheredThemselves(i) : std::vector<bool>(), light);
    }

    // Returns the light at the nodes of an instance, reconstructed from the light of the patches.
    AtNodes fitted(size_t i, const InstanceSide& surface) {
        AtNodes nodes;
        nodes.lights.resize(onSides.size());
        NodeFields fields;
        for (size_t k = 0; k < onSides.size(); ++k) {
            const SideLight& side = onSides[k];
            NodeLight& node = nodes.lights[k];
            fields.add(side.shown.direct, node.direct);
            if (gathers[i]) {
                fields.add(side.indirect, node.indirect);
                fields.add(side.carried, node.carried);
                fields.add(side.emission, node.emission);
            } else {
                fields.add(side.shown.indirect, node.indirect);
                fields.add(side.exitance, node.exitance);
            }
        }
        if (gathers[i]) fields.add(input.shown.color(), nodes.color);
        if (gathers[i] && !input.shown.everywhere().empty())
            fields.add(input.shown.everywhere(), nodes.shownShare);
        // With sparse results, and on dense faces, only the few corners that cannot gather show the
        // light of patches.
        const auto fit =
            isSparse(i) || (isDense[i] && atNodes->isAllDense(i)) ? byAreaAverage : kind.fit;
        LeastSquaresFit result =
            fit({input.patches, outside}, surface, input.settings, fields.ofSides());
        fields.put(std::move(result.fields));
        if (!result.isSolved)
            warnings[i] = {
                WarningId::UNSOLVED_FIT,
                "object \"" + input.scene.instances[i].name +
                    "\": the reconstruction LEAST_SQUARES did not converge, so that the vertices "
                    "get the mean of the light around them; merge vertices (Merge by Distance), or "
                    "choose the reconstruction AREA_AVERAGE"};
        return nodes;
    }

    // Replaces the fitted light of light `k` by what the corners gather. Returns the mean square of
    // the noise of the gathered light, summed over RGB, (W/m^2)^2.
    double gather(size_t i, size_t k, const std::vector<float>& cornerAngles, AtNodes& nodes) {
        NodeLight& light = nodes.lights[k];
        const CornerGather::Outcome outcome =
            atCorners->improve(i, k, cornerAngles, nodes.shownShare, light);
        smooth += outcome.smooth;
        light.exitance.resize(light.direct.size());
        for (size_t v = 0; v < light.direct.size(); ++v)
            light.exitance[v] =
                light.emission[v] + nodes.color[v] * (light.direct[v] + light.indirect[v]);
        return outcome.gathered > 0 ? outcome.noise / double(outcome.gathered) : 0;
    }

    const ReconstructionInput& input;
    const Kind& kind;
    const std::vector<InstanceRange> ranges;
    const std::vector<float> outside;  // per side: the share that counts, see exposedOutside()
    const std::vector<bool> gathers;   // per instance
    const std::vector<bool> isDense;   // per instance: whether nodes gather, see NodeGather
    const std::vector<SideLight> onSides;
    // Per instance: set if the instance gathers, or while it is reconstructed.
    std::vector<SmoothRegions> regionsOf;
    std::optional<CornerGather> atCorners;
    std::optional<NodeGather> atNodes;
    std::atomic<size_t> occluders = 0, smooth = 0, interpolated = 0;
    std::vector<std::optional<Warning>> warnings;  // per instance
};

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

std::vector<InstanceLight> reconstruct(const ReconstructionInput& input, const Progress& progress,
                                       Report& report) {
    InstanceReconstruction reconstruction(input, progress);
    const size_t count = input.scene.instances.size();
    std::vector<InstanceLight> result(count);
    report.objects.resize(count);
    // A few instances at a time, so that this thread can report progress and cancel in between.
    for (size_t i = 0; i < count; i += kTogether) {
        const double share = double(i) / double(count);
        progress.report(
            RB_STAGE_RECONSTRUCTION,
            reconstruction.anyGathers() || reconstruction.anyDense() ? 0.5 + 0.5 * share : share);
        parallelFor(i, std::min(i + kTogether, count),
                    [&](size_t k) { reconstruction.reconstruct(k, result[k], report.objects[k]); });
    }
    reconstruction.addTo(report);
    progress.report(RB_STAGE_RECONSTRUCTION, 1);
    return result;
}

}  // namespace raybundle
