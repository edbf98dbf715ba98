// SPDX-License-Identifier: GPL-3.0-or-later
//
// The light at the nodes of dense surfaces (Patches::isDense). The patches of such a surface are
// much smaller than the distances over which most light varies. They exchange light in clusters
// (patches/clusters.h), and what is shown is gathered at the nodes: the light of lamps at each of
// them, the light from around at few (reconstruction/light_around.h).
//
// Sources: Willmott, Heckbert and Garland, "Face Cluster Radiosity" (1999), for the exchange
// between clusters; Reichert (1992), see reconstruction/final_gather.h, for the gather.
// Differs: no light by direction is kept for clusters. The gather finds what each node gets with
// its own normal.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "job/progress.h"
#include "reconstruction/dense_nodes.h"
#include "reconstruction/final_gather.h"
#include "reconstruction/node_light.h"
#include "reconstruction/reconstruction_input.h"
#include "reconstruction/smooth_regions.h"

namespace raybundle {

// The nodes of dense surfaces of all instances, and the light of lamps at them.
class NodeGather {
  public:
    // Finds the nodes of the instances for which `isDense` is true, and gathers the light of lamps
    // at them. `ranges` and `regions` are per instance; only the regions of dense instances are
    // used. `surfaces` holds the exposed shares of exposedOutside(). References must outlive the
    // object.
    NodeGather(const ReconstructionInput& input, const std::vector<InstanceRange>& ranges,
               const std::vector<bool>& isDense, const std::vector<SmoothRegions>& regions,
               const LitSurfaces& surfaces, const Progress& progress);

    // Returns whether all faces of an instance are dense.
    bool isAllDense(size_t instance) const { return nodes[instance].isAllDense; }

    // What replace() has done.
    struct Outcome {
        size_t nodes = 0;         // nodes that got gathered light
        size_t interpolated = 0;  // places whose light from around was interpolated
        // Sums over these nodes, of squares summed over RGB, (W/m^2)^2: the variance of their
        // light, and its error by interpolation.
        double noise = 0, surplus = 0;
    };
    // Replaces the light of entry `k` of ReconstructionInput::lights at the dense nodes of an
    // instance. `cornerAngles` is per corner of the mesh, radians. `emission` is per side, exitance
    // of the light, W/m^2. Different instances may be replaced at once.
    Outcome replace(size_t instance, size_t k, const std::vector<float>& cornerAngles,
                    const std::vector<glm::vec3>& emission, NodeLight& light) const;

    // Returns the irradiance that entry `k` of ReconstructionInput::lights gives to the patches,
    // with the light of lamps on dense faces as their nodes got it, if that is known.
    const Irradiance& irradiance(size_t k) const {
        return sharp[k] ? *sharp[k] : input.lights[k].irradiance;
    }
    // Returns per node of an instance whether light was gathered at the node itself, and not in the
    // middle of its face.
    std::vector<bool> gatheredThemselves(size_t instance) const;

    // Returns the number of shadow rays cast so far.
    uint64_t shadowRays() const { return rays; }

  private:
    // Per receiver: irradiance by lamps, and what is shown of it, W/m^2; variance of the brightest
    // channel, (W/m^2)^2.
    struct Lamps {
        std::vector<glm::vec3> arriving, shown;
        std::vector<float> variance;
    };
    void gatherLamps(const Progress& progress);
    void gatherLamps(size_t instance, size_t k, const std::vector<ReceiverPair>& neighbours);
    std::unique_ptr<const Irradiance> sharpened(size_t k) const;

    const ReconstructionInput& input;
    const std::vector<InstanceRange>& ranges;
    const std::vector<SmoothRegions>& regions;
    const DenseNodes nodes;
    std::vector<Lamps> lamps;                                // per light
    std::vector<std::unique_ptr<const Irradiance>> sharp;    // per light; null: that of the light
    std::vector<std::unique_ptr<const FinalGather>> others;  // per light; null if it is dark
    mutable std::atomic<uint64_t> rays = 0;
};

}  // namespace raybundle
