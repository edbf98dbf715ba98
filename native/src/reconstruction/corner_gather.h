// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light that the corners of meshes gather themselves, instead of taking it from the patches. Every
// gathering corner gathers the light of the sources. The light of other surfaces and of the world
// is gathered only where the interpolation does not follow it (reconstruction/final_gather.h). The
// reconstruction POINT gathers at all corners. If the settings allow it (gathersSparseResults()),
// LEAST_SQUARES gathers too at the corners of objects with sparse results, whose results are few
// among the corners of a finer mesh. Most patches of these objects are not seen, and tracing them
// finely would cost more than the few corners that are shown.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "job/progress.h"
#include "job/settings.h"
#include "reconstruction/corner_receivers.h"
#include "reconstruction/final_gather.h"
#include "reconstruction/node_light.h"
#include "reconstruction/reconstruction_input.h"
#include "reconstruction/shown_light.h"
#include "reconstruction/smooth_regions.h"
#include "scene/scene.h"

namespace raybundle {

// Returns per instance whether its corners gather light.
std::vector<bool> gatheringInstances(const Scene& scene, const Settings& settings);

// The corners of all instances that gather light, and the light of the sources at these corners.
class CornerGather {
  public:
    // Finds the corners that gather, and gathers the light of the sources of all light sets at
    // them. At translucent patches, light is gathered on both sides. `gathers` is per instance, see
    // gatheringInstances(). `ranges` and `regions` are per instance; only the regions of gathering
    // instances are used. `surfaces` holds the exposed shares of exposedOutside(). References must
    // outlive the object.
    CornerGather(const ReconstructionInput& input, const std::vector<InstanceRange>& ranges,
                 const std::vector<bool>& gathers, const std::vector<SmoothRegions>& regions,
                 const LitSurfaces& surfaces, const Progress& progress);

    // Returns whether an instance has sparse results that its corners gather.
    bool isSparse(size_t instance) const {
        return gathersSparse && scene.instances[instance].hasSparseResults;
    }
    // Returns the number of corners with sparse results that gather, over all instances.
    size_t sparseCorners() const { return sparse; }

    // What improve() did at the nodes of an instance.
    struct Outcome {
        size_t smooth = 0;  // nodes that kept the interpolated light, which was good enough
        // For sparse results: number of nodes whose light their corners gathered, and the sum over
        // these nodes of the variance of this light, summed over RGB, (W/m^2)^2.
        size_t gathered = 0;
        double noise = 0;
    };
    // Replaces the light of entry `k` of ReconstructionInput::lights at the nodes of an instance by
    // what the corners gather. Nodes without a gathering corner keep their light. `cornerAngles` is
    // per corner of the mesh, radians. On entry, `light` holds the interpolated light; its indirect
    // and carried light are irradiances of which a node shows only the share `shownShare`, per node
    // and channel. An empty `shownShare` means that all light is shown. Different instances may be
    // improved at once.
    Outcome improve(size_t instance, size_t k, const std::vector<float>& cornerAngles,
                    const std::vector<glm::vec3>& shownShare, NodeLight& light) const;

    // Returns the number of shadow rays that the constructor cast.
    uint64_t shadowRays() const { return rays; }

  private:
    // Finds the corners of all instances that gather.
    void findCorners(const ReconstructionInput& input, const std::vector<bool>& gathers);
    // Gathers the light of the sources at the corners, and prepares the final gather of each light.
    void gatherSources(const ReconstructionInput& input, const Progress& progress);
    // Returns per node of an instance the mean of the light of its corners, weighted by their
    // angles. The mean is empty if the node has no gathering corner. `lightOf` returns the light of
    // a corner, given its index in `corners`.
    template <class LightOf>
    std::vector<std::optional<glm::vec3>> nodeMeans(size_t instance,
                                                    const std::vector<float>& cornerAngles,
                                                    const LightOf& lightOf) const;

    bool showsOwnAlone(size_t corner) const {
        return shown.isOwnAlone(corners[corner].receiver.side);
    }

    const Scene& scene;
    const ShownLight& shown;
    const std::vector<InstanceRange>& ranges;
    const std::vector<SmoothRegions>& regions;
    const LitSurfaces surfaces;
    const Skips skips;
    const bool gathersSparse;
    // The gathering corners of all instances, one instance after the other.
    std::vector<CornerReceiver> corners;
    // Per instance: its first entry in `corners`; one more entry at the end.
    std::vector<size_t> first;
    std::vector<std::vector<glm::vec3>> sources;  // per light and corner: shown irradiance, W/m^2
    std::vector<std::vector<float>> variances;    // of the brightest channel of each, (W/m^2)^2
    uint64_t rays = 0;                            // shadow rays for the light of the sources
    // The final gather per light. Null if the light is dark or the final gather is switched off.
    std::vector<std::unique_ptr<const FinalGather>> others;
    size_t sparse = 0;  // number of gathering corners with sparse results
};

}  // namespace raybundle
