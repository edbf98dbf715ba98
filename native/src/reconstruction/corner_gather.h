// SPDX-License-Identifier: GPL-3.0-or-later
//
// Light gathered at the corners of meshes themselves: that of the sources at all of them, and that
// of other surfaces and the world where interpolation does not follow it (final_gather.h).
#pragma once

#include <atomic>
#include <optional>
#include <vector>

#include "bake/progress.h"
#include "bake/settings.h"
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

class CornerGather {
  public:
    // Gathers the light of the sources, of all light sets, on both sides where both show. exposed:
    // per side, the share of it that nothing covers; surfaces not further apart than touchDistance
    // (m) touch. References must outlive the object.
    CornerGather(const Scene& scene, const Patches& patches, const Visibility& visibility,
                 float touchDistance, const SetLights& lights, const ShownLight& shown,
                 const std::vector<InstanceRange>& ranges, const std::vector<float>& exposed,
                 const Settings& settings, const Progress& progress);

    // Light at the nodes of an instance, as interpolation has it, W/m^2.
    struct NodeLight {
        std::vector<glm::vec3> direct, indirect;
        std::vector<glm::vec3> carried;  // of the direct light what is not from sources
        // What is shown of the indirect and the carried light, which are as they arrive; empty: all.
        std::vector<glm::vec3> shownShare;
    };

    // Puts what corners gather of light k in its place; nodes none of whose corners can gather keep
    // their light.
    void improve(size_t instance, size_t k, const SmoothRegions& regions,
                 const std::vector<float>& cornerAngles, NodeLight& light);

    uint64_t shadowRays() const { return rays; }
    // Nodes so far where interpolation was good enough.
    size_t smoothNodes() const { return smooth; }

  private:
    // Per node the mean of its corners' light, weighted by angle; nothing where it has no corners.
    template <class LightOf>
    std::vector<std::optional<glm::vec3>> nodeMeans(size_t instance, const SmoothRegions& regions,
                                                    const std::vector<float>& cornerAngles,
                                                    const LightOf& lightOf) const;

    bool showsOwnAlone(size_t corner) const {
        return shown.isOwnAlone(corners[corner].receiver.side);
    }

    const Scene& scene;
    const ShownLight& shown;
    const std::vector<InstanceRange>& ranges;
    const std::vector<float>& exposed;
    const Skips skips;
    std::vector<CornerReceiver> corners;
    std::vector<size_t> first;                    // per instance, into corners
    std::vector<std::vector<glm::vec3>> sources;  // per light and corner: irradiance, W/m^2
    uint64_t rays = 0;                            // for them
    std::vector<FinalGather> others;              // per light; none where it is switched off
    std::atomic<size_t> smooth = 0;
};

}  // namespace raybundle
