// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light gathered at the corners of meshes themselves: that of the sources at all of them, and that
// of other surfaces and the world where interpolation does not follow it (final_gather.h). Of
// POINT, and of objects whose results are few among the corners of a finer mesh: there the patches,
// of which most are not seen, would cost more than what is shown of them.
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

// Whether sparse results (Instance::hasSparseResults) are gathered instead of the light of patches.
bool gathersSparseResults(const Settings& settings);

// Per instance: whether its corners gather light.
std::vector<bool> gatheringInstances(const Scene& scene, const Settings& settings);

class CornerGather {
  public:
    // Gathers the light of the sources, of all light sets, on both sides where both show. gathers:
    // see gatheringInstances. ranges, regions: per instance, the latter of those that gather.
    // surfaces: with what of each side counts (exposedOutside). References must outlive the object.
    CornerGather(const ReconstructionInput& input, const std::vector<InstanceRange>& ranges,
                 const std::vector<bool>& gathers, const std::vector<SmoothRegions>& regions,
                 const LitSurfaces& surfaces, const Progress& progress);

    // Whether an instance has sparse results that its corners gather, and the number of all such.
    bool isSparse(size_t instance) const {
        return gathersSparse && scene.instances[instance].hasSparseResults;
    }
    size_t sparseCorners() const { return sparse; }

    struct Outcome {
        size_t smooth = 0;  // nodes where interpolation was good enough
        // Of sparse results: nodes whose light is their corners', and the sum of its variances over
        // RGB there, (W/m^2)^2.
        size_t gathered = 0;
        double noise = 0;
    };
    // Puts what corners gather of light k in place of that which interpolation has at the nodes of
    // an instance; nodes none of whose corners can gather keep their light. The indirect and the
    // carried light are as they arrive; shownShare: per node, what is shown of them; empty: all.
    Outcome improve(size_t instance, size_t k, const std::vector<float>& cornerAngles,
                    const std::vector<glm::vec3>& shownShare, NodeLight& light) const;

    uint64_t shadowRays() const { return rays; }

  private:
    // The corners that gather, of all instances.
    void findCorners(const ReconstructionInput& input, const std::vector<bool>& gathers);
    // The light of the sources at them, and what gathers that of other surfaces.
    void gatherSources(const ReconstructionInput& input, const Progress& progress);
    // Per node the mean of its corners' light, weighted by angle; nothing where it has no corners.
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
    std::vector<CornerReceiver> corners;
    std::vector<size_t> first;                    // per instance, into corners
    std::vector<std::vector<glm::vec3>> sources;  // per light and corner: irradiance, W/m^2
    std::vector<std::vector<float>> variances;    // of its brightest channel, (W/m^2)^2
    uint64_t rays = 0;                            // for them
    // Per light; null where it is dark, or where that is switched off.
    std::vector<std::unique_ptr<const FinalGather>> others;
    size_t sparse = 0;  // of the corners
};

}  // namespace raybundle
