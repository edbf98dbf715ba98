// SPDX-License-Identifier: GPL-3.0-or-later
#include "transport/transport.h"

#include <algorithm>
#include <cassert>

#include "patches/clusters.h"

namespace raybundle {
namespace {

struct Kind {
    const char* name;
    std::unique_ptr<Transport> (*make)(const TransportInput& input);
};

constexpr Kind kKinds[] = {
    {"LINE_REUSE", lineReuse},
    {"MULTIPATH", multipath},
    {"STOCHASTIC_ITERATION", stochasticIteration},
    {"RANDOM_WALK", randomWalk},
};

}  // namespace

HandOver handOver(const Patches& patches, const FirstShot& shot,
                  const std::vector<float>& exposed) {
    const size_t n = patches.sideCount();
    HandOver light{std::vector<glm::vec3>(n), std::vector<glm::vec3>(n), std::vector<glm::vec3>(n)};
    for (size_t i = 0; i < n; ++i) {
        // What came to the whole side came in through its exposed part.
        const float concentrated = exposed[i] > 0 ? 1 / exposed[i] : 0;
        light.gathered[i] = concentrated * shot.irradiance[i];
        if (!shot.indirect.empty()) light.indirect[i] = concentrated * shot.indirect[i];
        if (!patches.parentAt(uint32_t(i)).exchanges) continue;
        light.unshot[i] = shot.unshot.empty()
                              ? shotReflectance(patches, shot, i) * light.gathered[i]
                              : concentrated * shot.unshot[i];
    }
    return light;
}

std::unique_ptr<Transport> makeTransport(const std::string& kind, const TransportInput& input) {
    const auto row = std::find_if(std::begin(kKinds), std::end(kKinds),
                                  [&](const Kind& k) { return kind == k.name; });
    assert(row != std::end(kKinds) && "settings know the names");
    return row->make(input);
}

Transports makeTransports(const std::string& kind, const std::vector<TransportInput>& inputs) {
    if (inputs.front().clusters && !inputs.front().clusters->isNone()) {
        assert(kind == "LINE_REUSE" && "the settings have clusters for no other");
        return lineReuseOfClusters(inputs);
    }
    if (inputs.size() > 1) {
        assert(kind == "LINE_REUSE" && "checkCombination refuses light sets for others");
        return lineReuseOfMany(inputs);
    }
    Transports transports;
    transports.push_back(makeTransport(kind, inputs.front()));
    return transports;
}

}  // namespace raybundle
