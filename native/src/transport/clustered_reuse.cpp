// SPDX-License-Identifier: GPL-3.0-or-later
//
// LINE_REUSE between clusters (patches/clusters.h). The input is averaged over the patches of each
// cluster, and each patch gets the light of its cluster.

#include <utility>

#include "patches/clusters.h"
#include "transport/scattered_light.h"
#include "transport/transport.h"

namespace raybundle {
namespace {

// Returns for each side of the clusters the value of one of its patches.
std::vector<bool> joined(const Clusters& clusters, const std::vector<bool>& values) {
    std::vector<bool> result(clusters.patches().sideCount());
    for (uint32_t side = 0; side < result.size(); ++side)
        result[side] = values[clusters.memberOf(side, 0)];
    return result;
}

// Returns the light of a first shot, per side of the clusters.
FirstShot joined(const Clusters& clusters, const FirstShot& shot) {
    FirstShot result;
    result.irradiance = clusters.mean(shot.irradiance);
    result.indirect = clusters.mean(shot.indirect);
    result.unshot = clusters.mean(shot.unshot);
    result.angles = clusters.mean(shot.angles);
    result.emission = clusters.mean(shot.emission);
    if (!shot.sentOn.empty()) result.sentOn = joined(clusters, shot.sentOn);
    for (uint32_t side = 0; !shot.incoming.empty() && side < result.irradiance.size(); ++side)
        result.incoming.push_back(shot.incoming[clusters.memberOf(side, 0)]);
    return result;
}

class ClusteredReuse : public Transport {
  public:
    explicit ClusteredReuse(const TransportInput& input)
        : clusters(*input.clusters),
          shot(joined(clusters, input.shot)),
          exposed(clusters.mean(input.exposed)),
          isShown(input.isShown ? joined(clusters, *input.isShown) : std::vector<bool>()) {}

    // Returns the input of the transport between the clusters. It refers to members of this object.
    TransportInput inner(const TransportInput& input) const {
        return {{clusters.patches(), exposed},
                input.visibility,
                shot,
                input.worldRadiance,
                input.settings,
                input.tracer,
                input.counts,
                input.solutions,
                input.isShown ? &isShown : nullptr,
                &clusters};
    }
    void take(std::unique_ptr<Transport> made) { transport = std::move(made); }

    void advance(uint32_t count, const Progress& progress) override {
        transport->advance(count, progress);
    }
    uint32_t bundleCount() const override { return transport->bundleCount(); }
    Irradiance irradiance(Half half, float tolerance) override {
        return spread(transport->irradiance(half, tolerance));
    }
    Irradiance finish(float tolerance, const std::vector<bool>& wanted, Report& report) override {
        return spread(transport->finish(tolerance, joined(clusters, wanted), report));
    }
    double bias() const override { return transport->bias(); }
    std::vector<float> openShare() const override {
        return clusters.spread(transport->openShare());
    }

  private:
    Irradiance spread(Irradiance light) const {
        light.direct = clusters.spread(light.direct);
        light.ofSources = clusters.spread(light.ofSources);
        light.indirect = clusters.spread(light.indirect);
        light.byAngle = clusters.spread(light.byAngle);
        if (light.scattered) {
            std::vector<uint32_t> sides(light.direct.size());
            for (uint32_t side = 0; side < sides.size(); ++side)
                sides[side] = clusters.sideOf(side);
            light.scattered =
                std::make_shared<const ScatteredLight>(light.scattered->renumbered(sides));
        }
        return light;
    }

    const Clusters& clusters;
    const FirstShot shot;
    const std::vector<float> exposed;
    const std::vector<bool> isShown;
    std::unique_ptr<Transport> transport;
};

}  // namespace

Transports lineReuseOfClusters(const std::vector<TransportInput>& inputs) {
    std::vector<std::unique_ptr<ClusteredReuse>> outer;
    std::vector<TransportInput> inner;
    for (const TransportInput& input : inputs) {
        outer.push_back(std::make_unique<ClusteredReuse>(input));
        inner.push_back(outer.back()->inner(input));
    }
    Transports made = lineReuseOfMany(inner), transports;
    for (size_t k = 0; k < made.size(); ++k) {
        outer[k]->take(std::move(made[k]));
        transports.push_back(std::move(outer[k]));
    }
    return transports;
}

}  // namespace raybundle
