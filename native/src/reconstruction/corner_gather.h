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
#include "patches/patches.h"
#include "reconstruction/corner_receivers.h"
#include "reconstruction/final_gather.h"
#include "reconstruction/least_squares.h"
#include "reconstruction/shown_light.h"
#include "reconstruction/smooth_regions.h"
#include "scene/scene.h"
#include "transport/set_light.h"
#include "visibility/visibility.h"

namespace raybundle {

// Whether sparse results (Instance::hasSparseResults) are gathered instead of the light of patches.
bool gathersSparseResults(const Settings& settings);

// Per instance: whether its corners gather light.
std::vector<bool> gatheringInstances(const Scene& scene, const Settings& settings);

class CornerGather {
  public:
    // Gathers the light of the sources, of all light sets, on both sides where both show. gathers:
    // see gatheringInstances. regions: per instance, of those. exposed: per side, the share of it
    // that nothing covers; surfaces not further apart than touchDistance (m) touch. References must
    // outlive the object.
    CornerGather(const Scene& scene, const Patches& patches, const Visibility& visibility,
                 float touchDistance, const SetLights& lights, const ShownLight& shown,
                 const std::vector<InstanceRange>& ranges, const std::vector<bool>& gathers,
                 const std::vector<SmoothRegions>& regions, const std::vector<float>& exposed,
                 const Settings& settings, const Progress& progress);

    // Whether an instance has sparse results that its corners gather, and the number of all such.
    bool isSparse(size_t instance) const {
        return gathersSparse && scene.instances[instance].hasSparseResults;
    }
    size_t sparseCorners() const { return sparse; }

    // Light at the nodes of an instance, as interpolation has it, W/m^2.
    struct NodeLight {
        std::vector<glm::vec3> direct, indirect;
        std::vector<glm::vec3> carried;  // of the direct light what is not from sources
        // What is shown of the indirect and the carried light, which are as they arrive; empty:
        // all.
        std::vector<glm::vec3> shownShare;
    };

    struct Outcome {
        size_t smooth = 0;  // nodes where interpolation was good enough
        // Of sparse results: nodes whose light is their corners', and the sum of its variances over
        // RGB there, (W/m^2)^2.
        size_t gathered = 0;
        double noise = 0;
    };
    // Puts what corners gather of light k in its place; nodes none of whose corners can gather keep
    // their light.
    Outcome improve(size_t instance, size_t k, const std::vector<float>& cornerAngles,
                    NodeLight& light) const;

    uint64_t shadowRays() const { return rays; }

  private:
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
    const std::vector<float>& exposed;
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
