// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/transport.h"

#include <cassert>

#include "job/cancellation.h"
#include "patches/clusters.h"

namespace raybundle {
namespace {

struct Kind {
    Solver value;
    std::unique_ptr<Transport> (*make)(const TransportInput& input);
};

constexpr Kind kKinds[] = {
    {Solver::LINE_REUSE, lineReuse},
    {Solver::MULTIPATH, multipath},
    {Solver::STOCHASTIC_ITERATION, stochasticIteration},
    {Solver::RANDOM_WALK, randomWalk},
};
static_assert(hasEveryValue(kKinds));

}  // namespace

std::vector<glm::vec3> Irradiance::all() const {
    std::vector<glm::vec3> result(direct.size());
    parallelFor(size_t(0), result.size(), [&](size_t side) { result[side] = all(side); });
    return result;
}

HandOver handOver(const LitSurfaces& surfaces, const FirstShot& shot) {
    const auto& [patches, exposed] = surfaces;
    const size_t n = patches.sideCount();
    HandOver light{std::vector<glm::vec3>(n), std::vector<glm::vec3>(n), std::vector<glm::vec3>(n)};
    for (size_t i = 0; i < n; ++i) {
        // The irradiance is a mean over the whole side, but only the exposed part receives light.
        const float concentrated = exposed[i] > 0 ? 1 / exposed[i] : 0;
        light.ofSources[i] = concentrated * shot.irradiance[i];
        if (!shot.indirect.empty()) light.indirect[i] = concentrated * shot.indirect[i];
        if (!patches.parentAt(uint32_t(i)).exchanges) continue;
        light.unshot[i] = shot.unshot.empty()
                              ? shotReflectance(patches, shot, i) * light.ofSources[i]
                              : concentrated * shot.unshot[i];
    }
    return light;
}

std::unique_ptr<Transport> makeTransport(Solver solver, const TransportInput& input) {
    return kKinds[size_t(solver)].make(input);
}

Transports makeTransports(Solver solver, const std::vector<TransportInput>& inputs) {
    if (inputs.front().clusters && !inputs.front().clusters->isNone()) {
        assert(solver == Solver::LINE_REUSE && "the settings have clusters for no other");
        return lineReuseOfClusters(inputs);
    }
    if (inputs.size() > 1) {
        assert(solver == Solver::LINE_REUSE && "checkCombination refuses light sets for others");
        return lineReuseOfMany(inputs);
    }
    Transports transports;
    transports.push_back(makeTransport(solver, inputs.front()));
    return transports;
}

}  // namespace raybundle
